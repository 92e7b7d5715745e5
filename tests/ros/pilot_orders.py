"""Gives a robot behind the two actions a few orders, as a mission does, and tells how they ended.

Runs in the environment of ``make_environment.py``, as ``pilot_orders.py OUT.json``, beside
``exploring_robot.py`` and the map's node.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor

from stairmap_ros.explorer import ExplorerNode

MAX_SECONDS = 60.0
BESIDE_THE_STAIRS, BEFORE_THE_STAIRS = [2.8, 0.7], [1.4, 2.0]


def main() -> None:
    """Spin the node in another thread meanwhile, as the program does."""
    rclpy.init()
    node = ExplorerNode()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = Thread(target=executor.spin)
    spinning.start()
    try:
        told = give_orders(node)
    finally:
        executor.shutdown()
        spinning.join()
        node.destroy_node()
        rclpy.try_shutdown()
    Path(sys.argv[1]).write_text(json.dumps(told))


def give_orders(node: ExplorerNode) -> dict[str, Any]:
    """Look, drive with a pause, and climb; return how the orders ended."""
    view = node.wait_for_first_view(lambda: False)
    mission = node.make_mission(view)
    known, pilot = mission.known, mission.pilot
    known.enter_level()
    told: dict[str, Any] = {"start": known.pose.to_row().tolist()}
    for heading in (math.radians(8), math.radians(-8), 0.0):
        pilot.turn(heading)
        told["turn"] = finish(pilot)
    told["heading"] = known.pose.heading
    known.refresh_stairs()
    (link,) = known.stairs.links
    told["link"] = [link.lower, link.portal.verdict, link.flight.num_risers]

    pilot.drive(np.array([known.pose.place[:2], BESIDE_THE_STAIRS]))
    poll_until_moved(pilot, known)
    pilot.is_paused = True
    poll_for(pilot, 0.6)
    paused = known.pose.place
    told["while_paused"] = poll_for(pilot, 0.5)
    told["moved_in_pause"] = float(np.linalg.norm(known.pose.place - paused))
    pilot.is_paused = False
    told["drive"] = finish(pilot)
    way_back = np.array([BESIDE_THE_STAIRS, [0.6, 2.0], BEFORE_THE_STAIRS])
    pilot.drive(way_back)
    poll_until_moved(pilot, known)
    pilot.close()
    pilot.drive(way_back)
    told["drive_back"] = finish(pilot)
    told["after_drive"] = known.pose.to_row().tolist()

    known.leave_level()
    pilot.climb(link, is_up=True)
    told["climb"] = finish(pilot)
    told["after_climb"] = known.pose.to_row().tolist()
    told["num_frames_on_stairs"] = sum(record.level is None for record in known.records)

    pilot.climb(link, is_up=False)
    told["climb_down"] = finish(pilot)
    told["after_climb_down"] = known.pose.to_row().tolist()

    pilot.drive(np.array([known.pose.place[:2], [-5.0, 2.0]]))
    told["lost"] = finish(pilot)
    pilot.close()
    return told


def finish(pilot: Any) -> list[Any]:
    """Poll an order to its end; return how it ended, why, and whether the robot is stranded."""
    deadline = time.monotonic() + MAX_SECONDS
    while (progress := pilot.poll()).state == "running":
        assert time.monotonic() < deadline, "the order does not end"
        time.sleep(0.01)
    return [progress.state, progress.reason, progress.is_stranded]


def poll_until_moved(pilot: Any, known: Any) -> None:
    """Poll a drive until the robot is on its way."""
    start = known.pose.place
    while np.linalg.norm(known.pose.place - start) < 0.1:
        assert pilot.poll().state == "running"
        time.sleep(0.01)


def poll_for(pilot: Any, seconds: float) -> str:
    """Poll an order for some time; return how far it is."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        state = pilot.poll().state
        time.sleep(0.01)
    return state


if __name__ == "__main__":
    main()
