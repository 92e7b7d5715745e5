"""End to end: a robot with a LiDAR and no camera."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ros_environment import ENVIRONMENT, RosEnvironment

from stairmap.simulation.lidars import MID_360
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sweeps import LidarDrive

pytestmark = pytest.mark.usefixtures("wheels")


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Mid-360 that comes up to eight steps of 170 x 280 mm."""
    scene = make_scene("free_standing", 0)
    drive = LidarDrive(scene, MID_360, ROBOTS["spot"], seed=0, num_frames=42, odometry=PERFECT_ODOMETRY)
    found = [item.sweep for item in drive.sweeps()]
    file = tmp_path_factory.mktemp("sweeps") / "sweeps.npz"
    np.savez(
        file,
        points=np.concatenate([sweep.points for sweep in found]),
        offsets_ns=np.concatenate([sweep.offsets_ns for sweep in found]),
        counts=[len(sweep) for sweep in found],
        map_from_lidar=drive.true_path.map_from_camera,
    )
    return file


def test_the_stairway_of_a_robot_with_a_lidar_is_published(
    ros: RosEnvironment, sweeps: Path, tmp_path: Path
) -> None:
    ros.start_node(inputs="points")
    out = tmp_path / "heard.json"
    robot = Path(__file__).parent / "lidar_robot.py"
    subprocess.run(
        [ENVIRONMENT / "bin/python", robot, sweeps, out], env=ros.variables, check=True, timeout=120
    )
    heard = json.loads(out.read_text())
    (flight,) = heard["stairways"]
    assert flight["rise"] == pytest.approx(0.17, abs=0.006)
    assert flight["run"] == pytest.approx(0.28, abs=0.006)
    assert "1 stairway" in heard["diagnostics"]
    # Wheels are kept off the stairs though no camera tells where the ground is.
    planner = heard["planner"]
    forbidden = np.array(planner["masks"]["current"]["forbidden"])
    ahead = forbidden[np.abs(forbidden[:, 1]) < 0.3, 0]
    assert ahead.min() == pytest.approx(0.0, abs=0.15)
    assert ahead.max() > 1.5
    assert len(planner["obstacles"]) > 20
    assert planner["floors"][0]["height"] == pytest.approx(0.0, abs=0.05)


def test_a_lidar_that_is_silent_is_named(ros: RosEnvironment) -> None:
    ros.start_node(inputs="points", max_silence=1.0)
    (outcome,) = ros.run_robot(
        [{"mode": "listen", "until": "no point cloud ever came on /points", "without": ["depth", "info"]}]
    )
    assert outcome["answered"], outcome["diagnostics"]
