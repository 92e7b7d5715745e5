"""A robot with a LiDAR as its own process: publishes sweeps and TF, and takes down the stairways it is told.

Runs in the environment of ``make_environment.py``, as ``lidar_robot.py SWEEPS.npz OUT.json``. The file holds
the points of all sweeps (``points``, ``offsets_ns``, ``counts``) and ``map_from_lidar`` every 0.1 s.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from planner_ear import PlannerEar
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from robot_messages import time_message, transform_message
from sensor_msgs.msg import PointCloud2, PointField
from stairmap_msgs.msg import StairwayArray
from tf2_msgs.msg import TFMessage

from stairmap.transforms import interpolate_poses

PERIOD_NS = 100_000_000
FACTOR = 2.0
"""The drive runs so much slower than it was, for machines that are busy."""

PATIENCE = 20.0
"""After the drive, stairways are waited for no longer, s."""


class LidarRobot(Node):
    """Publishes a drive once and listens."""

    def __init__(self) -> None:
        super().__init__("lidar_robot")
        self.stairways: list[dict[str, float]] = []
        self.diagnostics: list[str] = []
        self.planner = PlannerEar(self)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._points = self.create_publisher(PointCloud2, "points", 5)
        self._tf = self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(StairwayArray, "stairmap/stairways", self._take, latched)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._note, 10)

    def _take(self, message: StairwayArray) -> None:
        self.stairways = [
            {"rise": flight.rise, "run": flight.run, "width": flight.width, "num_risers": flight.num_risers}
            for stairway in message.stairways
            for flight in stairway.flights
        ]

    def _note(self, message: DiagnosticArray) -> None:
        self.diagnostics += [status.message for status in message.status]

    def say_pose(self, stamp_ns: int, map_from_lidar: np.ndarray) -> None:
        self._tf.publish(TFMessage(transforms=[transform_message("map", "lidar", map_from_lidar, stamp_ns)]))

    def say_sweep(self, stamp_ns: int, points: np.ndarray, offsets_ns: np.ndarray) -> None:
        records = np.zeros(len(points), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4")])
        for column, axis in enumerate("xyz"):
            records[axis] = points[:, column]
        records["t"] = offsets_ns
        message = PointCloud2(height=1, width=len(points), point_step=16, row_step=16 * len(points))
        message.header.stamp, message.header.frame_id = time_message(stamp_ns), "lidar"
        kinds = {
            "x": PointField.FLOAT32,
            "y": PointField.FLOAT32,
            "z": PointField.FLOAT32,
            "t": PointField.UINT32,
        }
        message.fields = [
            PointField(name=name, offset=4 * number, datatype=kind, count=1)
            for number, (name, kind) in enumerate(kinds.items())
        ]
        message.data = records.tobytes()
        self._points.publish(message)


def main() -> None:
    """Drive, wait for a stairway, and write what was heard."""
    with np.load(sys.argv[1]) as file:
        points, offsets, counts, poses = (
            file[name] for name in ("points", "offsets_ns", "counts", "map_from_lidar")
        )
    rclpy.init()
    robot = LidarRobot()
    ends = np.cumsum(counts)
    start_ns = time.time_ns()
    stamps = np.arange(len(poses)) * PERIOD_NS
    deadline = time.monotonic() + 15.0
    while robot.count_subscribers("points") == 0 and time.monotonic() < deadline:
        rclpy.spin_once(robot, timeout_sec=0.1)
    for index, (end, count) in enumerate(zip(ends, counts, strict=True)):
        begin = time.monotonic()
        stamp_ns = start_ns + index * PERIOD_NS
        for late_ns in range(0, PERIOD_NS + 1, PERIOD_NS // 5):
            (pose,) = interpolate_poses(stamps, poses, np.array([index * PERIOD_NS + late_ns]))
            robot.say_pose(stamp_ns + late_ns, pose)
        robot.say_sweep(stamp_ns, points[end - count : end], offsets[end - count : end])
        while time.monotonic() - begin < FACTOR * PERIOD_NS * 1e-9:
            rclpy.spin_once(robot, timeout_sec=0.02)
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        is_masked = robot.planner.heard()["masks"].get("current", {}).get("forbidden")
        if robot.stairways and "1 stairway" in robot.diagnostics and is_masked:
            break
        rclpy.spin_once(robot, timeout_sec=0.1)
    Path(sys.argv[2]).write_text(
        json.dumps(
            {
                "stairways": robot.stairways,
                "diagnostics": robot.diagnostics[-20:],
                "planner": robot.planner.heard(),
            }
        )
    )
    rclpy.shutdown()


if __name__ == "__main__":
    main()
