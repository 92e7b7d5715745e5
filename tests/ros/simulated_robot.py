"""A robot as its own process: publishes depth, camera_info and TF at 30 Hz, takes down what the node says.

Runs in the environment of ``make_environment.py``, as ``simulated_robot.py DRIVE.npz ORDERS.json OUT.json``.
Orders are a list of phases; see ``ORDERS``. The outcome of each phase is one entry of the list in OUT.json.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import Path as PathMessage
from planner_ear import PlannerEar
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from robot_messages import (
    BASE_FROM_OPTICAL,
    compressed_image,
    marker_dict,
    ns_from,
    pose_message,
    raw_image,
    stairway_dict,
    time_message,
    transform_message,
    vector,
)
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from stairmap_msgs.msg import StairwayArray
from stairmap_msgs.srv import LoadMap, SaveMap
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from vision_msgs.msg import Detection3DArray
from visualization_msgs.msg import Marker, MarkerArray

from stairmap.transforms import interpolate_poses, invert_transform, transform_from_parts

ORDERS = {
    "mode": "drive",
    "reliability": "best_effort",
    "compressed": "",
    "topic": "depth/image_rect_raw",
    "latched_info": False,
    "distortion": 0.0,
    "depth_factor": 1,
    "service": "",
    "type": "",
    "request": {},
    "tf_delay": 0.0,
    "clock_offset": 0.0,
    "until": "",
    "until_others": {},
    "without": [],
    "lost": False,
    "odometry_every": 0,
    "correction_every": 0,
    "period": 1.0 / 30.0,
    "max_seconds": 60.0,
}
"""A phase with its defaults. ``mode`` is one of:

``drive``: probe with the first image until the node answers, drive, wait for the answer to the last image.
``hear``: drive twice with transforms of their own rate, and wait until the node has dealt with all images.
``listen``: publish the first image until diagnostics say ``until``.
With ``until_others`` other nodes' diagnostics, by their name, must hold some text too before a drive ends.
``wait``: publish nothing, until the node says something.
``correct``: send the path of the last drive, 1 m higher than it was.
``call``: call a ``service`` of a ``type`` with the fields of a ``request``; its answer is in the outcome.

``without``: what is kept back (depth, info, tf). ``lost``: TF holds NaN, as of a localiser that has lost
itself.
``compressed``: png or rvl. ``latched_info``: camera_info comes once, before everything else, and latched.
``odometry_every``: odom -> base_link comes with about every so many images, not before and after each one;
``correction_every``: likewise for map -> odom, which moves by ``CORRECTION`` and back each time."""

CORRECTION = 0.05

SERVICES = {kind.__name__: kind for kind in (ChangeState, GetState, LoadMap, SaveMap, Trigger)}

PERIOD = 1.0 / 30.0
MIN_ANSWERS = 25
OPTICAL = "camera_depth_optical_frame"

MAP_FROM_ODOM = transform_from_parts([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [2.0, -1.0, 0.5])


class SimulatedRobot(Node):
    """Publishes a drive and keeps the latest answers."""

    def __init__(self, drive: dict[str, np.ndarray], order: dict[str, Any]) -> None:
        super().__init__("simulated_robot")
        self.drive = drive
        qos = QoSProfile(depth=5, reliability=ReliabilityPolicy[order["reliability"].upper()])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        topic, self._compressed = order["topic"], order["compressed"]
        self._depth_out = (
            self.create_publisher(CompressedImage, f"{topic}/compressedDepth", qos)
            if self._compressed
            else self.create_publisher(Image, topic, qos)
        )
        self._path_out = self.create_publisher(PathMessage, "corrected_path", 1)
        self._path = PathMessage()
        self._has_latched_info = order["latched_info"]
        info_qos = latched if self._has_latched_info else qos
        self._info_out = self.create_publisher(CameraInfo, "depth/camera_info", info_qos)
        if self._has_latched_info:
            self._info_out.publish(self._camera_info(0, order))
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
        self.others: dict[str, dict[str, None]] = {}
        self._ear = PlannerEar(self)
        self._late_transforms: list[tuple[float, TFMessage]] = []
        self._compressed_images: dict[int, CompressedImage] = {}
        self._num_published = self._next_odometry = 0
        self._jitter = np.random.default_rng(1)

    def publish_static(self) -> None:
        """Say once where the camera sits."""
        self._static_out.publish(
            TFMessage(transforms=[transform_message("base_link", OPTICAL, BASE_FROM_OPTICAL, 0)])
        )

    def publish(self, index: int, stamp_ns: int, order: dict[str, Any]) -> None:
        """Publish one image of the drive with its transforms."""
        self._publish_transforms(index, stamp_ns, order)
        depth = self.drive["depth"][index] * np.uint16(order["depth_factor"])
        stamp = time_message(stamp_ns)
        if "info" not in order["without"] and not self._has_latched_info:
            self._info_out.publish(self._camera_info(stamp_ns, order))
        if "depth" not in order["without"]:
            image = self._compressed_image(index, depth) if self._compressed else raw_image(depth)
            image.header.frame_id, image.header.stamp = OPTICAL, stamp
            self._depth_out.publish(image)
        self._path.poses.append(pose_message(self.drive["map_from_camera"][index], stamp))

    def forget_path(self) -> None:
        """Begin a new path."""
        self._path = PathMessage()

    def publish_path(self) -> None:
        """Publish the robot's way so far, 1 m higher than TF has said."""
        for stamped in self._path.poses:
            stamped.pose.position.z += 1.0
        self._path.header.frame_id = "map"
        self._path_out.publish(self._path)

    def _compressed_image(self, index: int, depth: np.ndarray) -> CompressedImage:
        """Compress each image once: RVL takes Python longer than a camera's period."""
        if index not in self._compressed_images:
            self._compressed_images[index] = compressed_image(depth, self._compressed)
        return self._compressed_images[index]

    def _camera_info(self, stamp_ns: int, order: dict[str, Any]) -> CameraInfo:
        height, width = self.drive["depth"][0].shape
        info = CameraInfo(height=height, width=width)
        fx, fy, cx, cy = self.drive["intrinsics"].tolist()
        info.k = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1])
        info.p = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
        info.d = [order["distortion"], 0.0, 0.0, 0.0, 0.0]
        info.header.frame_id, info.header.stamp = OPTICAL, time_message(stamp_ns)
        return info

    def call(self, order: dict[str, Any], deadline: float) -> dict[str, Any] | None:
        """Call a service; return its answer, ``None`` if there was none in time."""
        kind = SERVICES[order["type"]]
        client = self.create_client(kind, order["service"])
        request = kind.Request()
        for name, value in order["request"].items():
            setattr(request, name, Transition(id=value) if name == "transition" else value)
        while not client.service_is_ready() and time.monotonic() < deadline:
            self.spin_until(time.monotonic() + 0.05)
        future = client.call_async(request)
        while not future.done() and time.monotonic() < deadline:
            self.spin_until(time.monotonic() + 0.05)
        answer = future.result() if future.done() else None
        if answer is None:
            return None
        fields = answer.get_fields_and_field_types()
        return {name: str(getattr(answer, name)) for name in fields}

    def _publish_transforms(self, index: int, stamp_ns: int, order: dict[str, Any]) -> None:
        """Publish map -> odom -> base_link half a period before and after the image's stamp.

        So the node must interpolate, and wait for the second.
        """
        if "tf" in order["without"]:
            return
        if order["odometry_every"]:
            self._publish_slow_transforms(index, stamp_ns, order)
            return
        poses = self.drive["map_from_camera"]
        message = TFMessage()
        half_ns = int(PERIOD / 2 * 1e9)
        for neighbour, at_ns in ((index - 1, stamp_ns - half_ns), (index + 1, stamp_ns + half_ns)):
            other = poses[min(max(neighbour, 0), len(poses) - 1)]
            pose = interpolate_poses(np.array([0, 2]), np.stack([poses[index], other]), np.array([1]))[0]
            odom_from_base = invert_transform(MAP_FROM_ODOM) @ pose @ invert_transform(BASE_FROM_OPTICAL)
            message.transforms += [
                transform_message("map", "odom", MAP_FROM_ODOM, at_ns),
                transform_message("odom", "base_link", odom_from_base, at_ns),
            ]
        if order["lost"]:
            for stamped in message.transforms:
                stamped.transform.translation.x = float("nan")
        self._late_transforms.append((time.monotonic() + order["tf_delay"], message))
        self.send_due_transforms()

    def _publish_slow_transforms(self, index: int, stamp_ns: int, order: dict[str, Any]) -> None:
        """Publish transforms of this very moment if they are due, as odometry and a localiser of their own
        do."""
        pose = self.drive["map_from_camera"][index] @ invert_transform(BASE_FROM_OPTICAL)
        if self._num_published >= self._next_odometry:
            odom_from_base = invert_transform(MAP_FROM_ODOM) @ pose
            self._tf_out.publish(
                TFMessage(transforms=[transform_message("odom", "base_link", odom_from_base, stamp_ns)])
            )
            # One in seven is lost, the others come a little early or late.
            every = order["odometry_every"]
            self._next_odometry = (
                self._num_published + every + int(self._jitter.choice([-1, 0, 0, 0, 0, 1, every]))
            )
        if self._num_published % order["correction_every"] == 0:
            moved = MAP_FROM_ODOM.copy()
            moved[1, 3] += CORRECTION * (self._num_published // order["correction_every"] % 2)
            self._tf_out.publish(TFMessage(transforms=[transform_message("map", "odom", moved, stamp_ns)]))
        self._num_published += 1

    def num_unsettled(self) -> int:
        """How many images the node has received and not dealt with, by its last report."""
        values = self.diagnostics[-1]["values"] if self.diagnostics else {}
        ends = ("processed", "superseded by newer ones", "dropped without a transform", "refused")
        return int(values.get("images received", 1)) - sum(
            int(values.get(f"images {end}", 0)) for end in ends
        )

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

    def have_others_told(self, order: dict[str, Any]) -> bool:
        """Tell whether other nodes have reported what is waited for."""
        return all(
            any(text in message for message in self.others.get(name, ()))
            for name, text in order["until_others"].items()
        )

    def outcome(self) -> dict[str, Any]:
        """Return all answers since the last call as JSON types."""
        outcome = {
            "stairways": self.stairways,
            "markers": [marker_dict(marker) for marker in self.markers.values()],
            "detections": self.detections,
            "diagnostics": self.diagnostics,
            "planner": self._ear.heard(),
            "others": {name: list(messages) for name, messages in self.others.items()},
            "median_delay": float(np.median(self.delays)) if self.delays else None,
            "num_answers": len(self.delays),
        }
        self.delays, self.diagnostics = [], []
        return outcome

    def _take_stairways(self, message: StairwayArray) -> None:
        self.last_answer_ns = ns_from(message.header.stamp)
        self.delays.append((time.time_ns() - self.last_answer_ns) * 1e-9)
        self.stairways = [stairway_dict(stairway, message) for stairway in message.stairways]

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
                "center": vector(detection.bbox.center.position),
                "size": vector(detection.bbox.size),
                "frame_id": detection.header.frame_id,
            }
            for detection in message.detections
        ]

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        status = message.status[0]
        if not status.name.startswith("stairmap:"):
            self.others.setdefault(status.name.partition(":")[0], {})[status.message] = None
            return
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
    robot = SimulatedRobot(drive, orders[0])
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
    if order["mode"] == "call":
        answer = robot.call(order, deadline)
        robot.spin_until(time.monotonic() + 0.2)
        return {**robot.outcome(), "answer": answer}
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
    if order["mode"] == "hear":
        answered = send(robot, 0, order, answer_since_now(robot, order), deadline)
        robot.outcome()
        send(robot, 0, order, lambda: bool(robot.diagnostics), deadline)
        for _ in range(2):
            for index in range(len(robot.drive["depth"])):
                send(robot, index, order, lambda: True, deadline)
        heard = robot.outcome()
        silent = {**order, "without": ["depth", "info"]}
        answered &= send(
            robot, len(robot.drive["depth"]) - 1, silent, lambda: not robot.num_unsettled(), deadline
        )
        after = robot.outcome()
        return {
            **after,
            "diagnostics": [heard["diagnostics"][0], *after["diagnostics"]],
            "answered": answered,
        }
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
    # The node reports on itself once in a second; images that came in a bunch are looked at after the newest.
    robot.diagnostics.clear()
    while robot.num_unsettled() and time.monotonic() < deadline:
        robot.spin_until(time.monotonic() + 0.05)
    answered &= send(robot, last, order, lambda: robot.have_others_told(order), deadline)
    robot.spin_until(time.monotonic() + 0.1)
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
        next_time += order["period"]
        robot.spin_until(next_time)
        if is_done():
            return True
    return False


if __name__ == "__main__":
    main()
