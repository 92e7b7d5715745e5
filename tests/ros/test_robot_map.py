"""What the explorer takes from the map's node: where the robot must not go, floor by floor."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from ros_environment import ENVIRONMENT

pytestmark = pytest.mark.usefixtures("wheels")

CODE = """
import json
import numpy as np
import rclpy
from stairmap.exploration.body import load_body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.scans import FLOOR, Scan
from stairmap.navigation.occupancy import FREE, OccupancyGrid
from stairmap_msgs.msg import Floor, FloorArray, StairwayArray
from stairmap_ros.map_results_in import MapResultsIn
from stairmap_ros.messages import make_header
from stairmap_ros.navigation_messages import make_mask
from stairmap_ros.robot_map import RobotMap

rclpy.init()
node = rclpy.create_node("listener")
results = MapResultsIn(node, "stairmap")
known = RobotMap(load_body("spot"), Planar(x=0.0, y=0.0, z=3.0, heading=0.0), results, allow_unknown=False)
level, _ = known.enter_level()
steps = np.arange(-2.0, 2.0, 0.04)
ground = np.stack([*np.meshgrid(steps, steps), np.zeros((len(steps), len(steps)))], axis=-1).reshape(-1, 3)
scan = Scan(stamp_ns=1, points=ground.astype(np.float32), kinds=np.full(len(ground), FLOOR, dtype=np.int8))
level.map.add(scan, known.pose, radius=known.body.radius)

def east():
    "Farthest open place to the east of the robot, and whether it can stay where it is."
    open_ground = known.open_ground(level, level.map.grid())
    x = open_ground.centers(*np.nonzero(open_ground.cells == FREE))[:, 0]
    return [float(x.max()), open_ground.value_at([0.0, 0.0])]

told = {"nothing": east()}
heights = {"/low": 0.0, "/high": 3.1}
floors = [Floor(height=height, keepout_mask_topic=topic) for topic, height in heights.items()]
results._take_floors(FloorArray(header=make_header("map", 1), floors=floors))
cells = np.full((80, 80), -1, dtype=np.int8)
cells[:, 40 + 16:] = 100
half = OccupancyGrid(cells=cells, resolution=0.05, origin=(-2.0, -2.0))
every = OccupancyGrid(cells=np.full((80, 80), 100, dtype=np.int8), resolution=0.05, origin=(-2.0, -2.0))
results._take_mask("/low", make_mask(every, 0.0, make_header("map", 1)))
told["low"] = east()
results._take_mask("/high", make_mask(half, 3.1, make_header("map", 1)))
told["high"] = east()
results._take_mask("/high", make_mask(every, 3.1, make_header("map", 1)))
told["every"] = east()
changes = []
for stamp_ns in (5_000_000_000, 6_000_000_000):
    results._take_stairways(StairwayArray(header=make_header("map", stamp_ns)))
    changes.append([results.looked_ns, results.num_changes])
told["changes"] = changes
print(json.dumps(told))
"""


def test_no_goal_lies_in_the_keepout_mask_of_its_floor() -> None:
    variables = {
        k: v for k, v in os.environ.items() if k not in ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONPATH")
    }
    variables |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(os.getpid() % 100 + 1)}
    command = [ENVIRONMENT / "bin/python", "-c", CODE]
    ended = subprocess.run(command, env=variables, cwd=Path("/"), capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    told: dict[str, Any] = json.loads(ended.stdout)
    assert told["nothing"][0] > 1.6
    assert told["low"] == told["nothing"], "the mask of another floor"
    assert 0.6 < told["high"][0] < 0.8, "beyond 0.8 m it is forbidden"
    assert told["every"][0] < 0.3, "only where the robot was already"
    assert told["every"][1] == 0
    assert told["changes"] == [[5_000_000_000, 1], [6_000_000_000, 1]]
