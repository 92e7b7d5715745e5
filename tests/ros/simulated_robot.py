"""A robot as its own process: publishes depth, camera_info and TF at 30 Hz, takes down what the node says.

Runs in the environment of ``make_environment.py``, as ``simulated_robot.py DRIVE.npz ORDERS.json OUT.json``.
Orders are a list of phases; see ``ORDERS``. The outcome of each phase is one entry of the list in OUT.json.
"""

from __future__ import annotations

import array
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Path as PathMessage
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from stairmap_msgs.msg import StairwayArray
from tf2_msgs.msg import TFMessage
from vision_msgs.msg import Detection3DArray
from visualization_msgs.msg import Marker, MarkerArray

from stairmap.transforms import (
    interpolate_poses,
    invert_transform,
    quat_from_rotation,
    transform_from_parts,
)

ORDERS = {
    "mode": "drive",
    "reliability": "best_effort",
    "compressed": False,
    "tf_delay": 0.0,
    "clock_offset": 0.0,
    "until": "",
    "without": [],
    "lost": False,
    "max_seconds": 60.0,
}
"""A phase with its defaults. ``drive``: probe with the first image until the node answers, drive, wait
for the answer to the last image. ``listen``: publish the first image until diagnostics say ``until``.
``wait``: publish nothing, until the node says something. ``correct``: send the path of the last drive, 1 m
higher than it was. ``without``: what is kept back (depth, info, tf).
``lost``: TF holds NaN, as of a localiser that has lost itself."""

PERIOD = 1.0 / 30.0
MIN_ANSWERS = 25
OPTICAL = "camera_depth_optical_frame"

BASE_FROM_OPTICAL = transform_from_parts([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0.3, 0.0, 0.4])
MAP_FROM_ODOM = transform_from_parts([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [2.0, -1.0, 0.5])


class SimulatedRobot(Node):
    """Publishes a drive and keeps the latest answers."""

    def __init__(self, drive: dict[str, np.ndarray], reliability: str, *, compressed: bool) -> None:
        super().__init__("simulated_robot")
        self.drive = drive
        qos = QoSProfile(depth=5, reliability=ReliabilityPolicy[reliability.upper()])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        topic = "depth/image_rect_raw"
        self._depth_out = (
            self.create_publisher(CompressedImage, f"{topic}/compressedDepth", qos)
            if compressed
            else self.create_publisher(Image, topic, qos)
        )
        self._is_compressed = compressed
        self._path_out = self.create_publisher(PathMessage, "corrected_path", 1)
        self._path = PathMessage()
        self._info_out = self.create_publisher(CameraInfo, "depth/camera_info", qos)
        self._tf_out = self.create_publisher(TFMessage, "/tf", 100)
        self._static_out = self.create_publisher(TFMessage, "/tf_static", latched)
        self.create_subscription(StairwayArray, "stairmap/stairways", self._take_stairways, latched)
        self.create_subscription(MarkerArray, "stairmap/markers", self._take_markers, latched)
        self.create_subscription(Detection3DArray, "stairmap/detections", self._take_detections, latched)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._take_diagnostics, 10)
        self.last_answer_ns = 0
        self.delays: list[float] = []
        self.stairways: list[dict[str, Any]] | None = None
        self.markers: dict[tuple[str, int], Marker] = {}
        self.detections: list[Any] = []
        self.diagnostics: list[dict[str, Any]] = []
        self._late_transforms: list[tuple[float, TFMessage]] = []

    def publish_static(self) -> None:
        """Say once where the camera sits."""
        self._static_out.publish(TFMessage(transforms=[_stamped("base_link", OPTICAL, BASE_FROM_OPTICAL, 0)]))

    def publish(self, index: int, stamp_ns: int, order: dict[str, Any]) -> None:
        """Publish one image of the drive with its transforms."""
        self._publish_transforms(index, stamp_ns, order)
        depth = self.drive["depth"][index]
        height, width = depth.shape
        stamp = _time(stamp_ns)
        if "info" not in order["without"]:
            info = CameraInfo(height=height, width=width)
            fx, fy, cx, cy = self.drive["intrinsics"].tolist()
            info.k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1])
            info.p = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
            info.header.frame_id, info.header.stamp = OPTICAL, stamp
            self._info_out.publish(info)
        if "depth" not in order["without"]:
            image = self._compressed_image(depth) if self._is_compressed else _raw_image(depth)
            image.header.frame_id, image.header.stamp = OPTICAL, stamp
            self._depth_out.publish(image)
        self._path.poses.append(_stamped_pose(self.drive["map_from_camera"][index], stamp))

    def forget_path(self) -> None:
        """Begin a new path."""
        self._path = PathMessage()

    def publish_path(self) -> None:
        """Publish the robot's way so far, 1 m higher than TF has said."""
        for stamped in self._path.poses:
            stamped.pose.position.z += 1.0
        self._path.header.frame_id = "map"
        self._path_out.publish(self._path)

    def _compressed_image(self, depth: np.ndarray) -> CompressedImage:
        png = cv2.imencode(".png", depth)[1].tobytes()
        return CompressedImage(format="16UC1; compressedDepth png", data=array.array("B", bytes(12) + png))

    def _publish_transforms(self, index: int, stamp_ns: int, order: dict[str, Any]) -> None:
        """Publish map -> odom -> base_link half a period before and after the image's stamp.

        So the node must interpolate, and wait for the second.
        """
        if "tf" in order["without"]:
            return
        poses = self.drive["map_from_camera"]
        message = TFMessage()
        half_ns = int(PERIOD / 2 * 1e9)
        for neighbour, at_ns in ((index - 1, stamp_ns - half_ns), (index + 1, stamp_ns + half_ns)):
            other = poses[min(max(neighbour, 0), len(poses) - 1)]
            pose = interpolate_poses(np.array([0, 2]), np.stack([poses[index], other]), np.array([1]))[0]
            odom_from_base = invert_transform(MAP_FROM_ODOM) @ pose @ invert_transform(BASE_FROM_OPTICAL)
            message.transforms += [
                _stamped("map", "odom", MAP_FROM_ODOM, at_ns),
                _stamped("odom", "base_link", odom_from_base, at_ns),
            ]
        if order["lost"]:
            for stamped in message.transforms:
                stamped.transform.translation.x = float("nan")
        self._late_transforms.append((time.monotonic() + order["tf_delay"], message))
        self.send_due_transforms()

    def send_due_transforms(self) -> None:
        """Publish what has been held back long enough."""
        while self._late_transforms and self._late_transforms[0][0] <= time.monotonic():
            self._tf_out.publish(self._late_transforms.pop(0)[1])

    def spin_until(self, moment: float) -> None:
        """Take in messages until a moment of the monotonic clock."""
        while True:
            self.send_due_transforms()
            left = moment - time.monotonic()
            rclpy.spin_once(self, timeout_sec=min(max(left, 0.0), 0.01))
            if left <= 0:
                return

    def is_higher(self, height: float) -> bool:
        """Tell whether the stairway begins so far above the floor, m."""
        return bool(self.stairways) and self.stairways[0]["flights"][0]["base"][2] > height

    def was_told(self, text: str) -> bool:
        """Tell whether the node's last report on itself holds some text."""
        return bool(self.diagnostics) and text in self.diagnostics[-1]["message"]

    def outcome(self) -> dict[str, Any]:
        """Return all answers since the last call as JSON types."""
        outcome = {
            "stairways": self.stairways,
            "markers": [_marker_dict(marker) for marker in self.markers.values()],
            "detections": self.detections,
            "diagnostics": self.diagnostics,
            "median_delay": float(np.median(self.delays)) if self.delays else None,
            "num_answers": len(self.delays),
        }
        self.delays, self.diagnostics = [], []
        return outcome

    def _take_stairways(self, message: StairwayArray) -> None:
        self.last_answer_ns = _ns(message.header.stamp)
        self.delays.append((time.time_ns() - self.last_answer_ns) * 1e-9)
        self.stairways = [_stairway_dict(stairway, message) for stairway in message.stairways]

    def _take_markers(self, message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                self.markers.clear()
            else:
                self.markers[marker.ns, marker.id] = marker

    def _take_detections(self, message: Detection3DArray) -> None:
        self.detections = [
            {
                "id": detection.id,
                "class_id": detection.results[0].hypothesis.class_id,
                "center": _vector(detection.bbox.center.position),
                "size": _vector(detection.bbox.size),
                "frame_id": detection.header.frame_id,
            }
            for detection in message.detections
        ]

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        status = message.status[0]
        values = {item.key: item.value for item in status.values}
        self.diagnostics.append(
            {"level": int.from_bytes(status.level, "little"), "message": status.message, "values": values}
        )


def main() -> None:
    """Carry out all phases."""
    drive_file, orders_file, out_file = (Path(name) for name in sys.argv[1:])
    with np.load(drive_file) as arrays:
        drive = dict(arrays)
    orders = [{**ORDERS, **order} for order in json.loads(orders_file.read_text())]
    rclpy.init()
    robot = SimulatedRobot(drive, orders[0]["reliability"], compressed=orders[0]["compressed"])
    robot.publish_static()
    outcomes = []
    for order in orders:
        outcomes.append(carry_out(robot, order))
        new = out_file.with_suffix(".new")
        new.write_text(json.dumps(outcomes))
        new.replace(out_file)
    robot.destroy_node()
    rclpy.shutdown()


def carry_out(robot: SimulatedRobot, order: dict[str, Any]) -> dict[str, Any]:
    """Do one phase; its outcome says whether the node answered in time."""
    deadline = time.monotonic() + order["max_seconds"]
    if order["mode"] == "wait":
        while robot.stairways is None and time.monotonic() < deadline:
            robot.spin_until(time.monotonic() + 0.05)
        return robot.outcome()
    if order["mode"] == "listen":
        answered = send(robot, 0, order, lambda: robot.was_told(order["until"]), deadline)
        return {**robot.outcome(), "answered": answered}
    if order["mode"] == "correct":
        robot.publish_path()
        answered = send(robot, 0, order, lambda: robot.is_higher(0.9), deadline)
        return {**robot.outcome(), "answered": answered}
    # The first messages vanish while publishers and subscribers find each other.
    answered = send(robot, 0, order, answer_since_now(robot, order), deadline)
    robot.outcome()
    robot.forget_path()
    # On a busy machine one drive may be over before the node has seen enough of it.
    while len(robot.delays) < MIN_ANSWERS and time.monotonic() < deadline:
        for index in range(len(robot.drive["depth"])):
            send(robot, index, order, lambda: True, deadline)
    last = len(robot.drive["depth"]) - 1
    answered &= send(robot, last, order, answer_since_now(robot, order), deadline)
    # The node reports on itself once in a second.
    robot.spin_until(time.monotonic() + 1.2)
    return {**robot.outcome(), "answered": answered}


def answer_since_now(robot: SimulatedRobot, order: dict[str, Any]) -> Callable[[], bool]:
    """Return whether the node has answered to an image that is sent from now on."""
    now_ns = time.time_ns() + int(order["clock_offset"] * 1e9)
    return lambda: now_ns <= robot.last_answer_ns < now_ns + 60_000_000_000


def send(
    robot: SimulatedRobot, index: int, order: dict[str, Any], is_done: Callable[[], bool], deadline: float
) -> bool:
    """Publish one image of the drive at 30 Hz until something holds, at least once; false if it never did."""
    next_time = time.monotonic()
    while time.monotonic() < deadline:
        stamp_ns = time.time_ns() + int(order["clock_offset"] * 1e9)
        robot.publish(index, stamp_ns, order)
        next_time += PERIOD
        robot.spin_until(next_time)
        if is_done():
            return True
    return False


def _stamped(parent: str, child: str, parent_from_child: np.ndarray, stamp_ns: int) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, _time(stamp_ns)
    position, turn = message.transform.translation, message.transform.rotation
    position.x, position.y, position.z = parent_from_child[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quat_from_rotation(parent_from_child[:3, :3]).tolist()
    return message


def _stamped_pose(map_from_camera: np.ndarray, stamp: Time) -> PoseStamped:
    map_from_base = map_from_camera @ invert_transform(BASE_FROM_OPTICAL)
    message = PoseStamped()
    message.header.stamp = stamp
    position, turn = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = map_from_base[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quat_from_rotation(map_from_base[:3, :3]).tolist()
    return message


def _raw_image(depth: np.ndarray) -> Image:
    height, width = depth.shape
    data = array.array("B", depth.tobytes())
    return Image(height=height, width=width, encoding="16UC1", step=2 * width, data=data)


def _time(stamp_ns: int) -> Time:
    return Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)


def _ns(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _vector(point: Any) -> list[float]:
    return [point.x, point.y, point.z]


def _stairway_dict(stairway: Any, message: StairwayArray) -> dict[str, Any]:
    flights = []
    for flight in stairway.flights:
        turn = flight.pose.pose.orientation
        flights.append(
            {
                "base": _vector(flight.pose.pose.position),
                "heading": float(2.0 * np.arctan2(turn.z, turn.w)),
                "rise": flight.rise,
                "run": flight.run,
                "width": flight.width,
                "num_risers": flight.num_risers,
                "covariance": np.asarray(flight.covariance).tolist(),
                "pose_covariance": np.asarray(flight.pose.covariance).tolist(),
                "num_steps": len(flight.steps),
                "box_center": _vector(flight.box_center),
                "box_size": _vector(flight.box_size),
            }
        )
    return {
        "id": stairway.id,
        "frame_id": message.header.frame_id,
        "num_observations": stairway.num_observations,
        "first_seen_ns": _ns(stairway.first_seen),
        "last_seen_ns": _ns(stairway.last_seen),
        "flights": flights,
    }


def _marker_dict(marker: Marker) -> dict[str, Any]:
    return {
        "ns": marker.ns,
        "frame_id": marker.header.frame_id,
        "text": marker.text,
        "points": [_vector(point) for point in marker.points],
        "position": _vector(marker.pose.position),
        "scale": _vector(marker.scale),
    }


if __name__ == "__main__":
    main()
