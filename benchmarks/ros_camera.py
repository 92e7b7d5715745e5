"""A depth camera on a robot, and one who listens, for ``ros_node.py``; both run in the wheels' environment.

``ros_camera.py publish DRIVE.npz SECONDS`` or ``ros_camera.py listen OUT.npz SECONDS``.
"""

from __future__ import annotations

import array
import itertools
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from stairmap.transforms import quat_from_rotation

PERIOD = 1.0 / 30.0
OPTICAL = "camera_depth_optical_frame"


def publish(drive_file: Path, seconds: float) -> None:
    """Publish the drive at 30 Hz, to its end and back again, over and over."""
    with np.load(drive_file) as arrays:
        depth, poses, intrinsics = arrays["depth"], arrays["map_from_camera"], arrays["intrinsics"]
    height, width = depth.shape[1:]
    data = [array.array("B", image.tobytes()) for image in depth]
    fx, fy, cx, cy = intrinsics.tolist()
    info = CameraInfo(height=height, width=width, p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]))
    info.header.frame_id = OPTICAL
    node = Node("camera")
    depth_out = node.create_publisher(Image, "depth/image_rect_raw", qos_profile_sensor_data)
    info_out = node.create_publisher(CameraInfo, "depth/camera_info", qos_profile_sensor_data)
    tf_out = node.create_publisher(TFMessage, "/tf", 100)
    there = list(range(len(depth)))
    start = time.monotonic()
    for count, index in enumerate(itertools.cycle(there + there[::-1])):
        time.sleep(max(0.0, start + count * PERIOD - time.monotonic()))
        if time.monotonic() - start > seconds:
            return
        stamp = time_from_ns(time.time_ns())
        tf_out.publish(TFMessage(transforms=[stamped(poses[index], stamp)]))
        info.header.stamp = stamp
        info_out.publish(info)
        image = Image(height=height, width=width, encoding="16UC1", step=2 * width, data=data[index])
        image.header.frame_id, image.header.stamp = OPTICAL, stamp
        depth_out.publish(image)


def listen(out_file: Path, seconds: float) -> None:
    """Write down when which image was answered with markers: (N, 2) arrival and stamp, nanoseconds."""
    node = Node("listener")
    answers: list[tuple[int, int]] = []

    def take(message: MarkerArray) -> None:
        if message.markers:
            stamp = message.markers[0].header.stamp
            answers.append((time.time_ns(), stamp.sec * 1_000_000_000 + stamp.nanosec))

    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(MarkerArray, "stairmap/markers", take, latched)
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.1)
    np.savez(out_file, answers=np.array(answers, dtype=np.int64).reshape(-1, 2))


def stamped(map_from_camera: np.ndarray, stamp: Time) -> TransformStamped:
    """Return a pose of the camera as a transform."""
    message = TransformStamped(child_frame_id=OPTICAL)
    message.header.frame_id, message.header.stamp = "map", stamp
    position, turn = message.transform.translation, message.transform.rotation
    position.x, position.y, position.z = map_from_camera[:3, 3].tolist()
    turn.x, turn.y, turn.z, turn.w = quat_from_rotation(map_from_camera[:3, :3]).tolist()
    return message


def time_from_ns(stamp_ns: int) -> Time:
    """Return a stamp as a message."""
    return Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)


if __name__ == "__main__":
    role, file, duration = sys.argv[1], Path(sys.argv[2]), float(sys.argv[3])
    rclpy.init()
    {"publish": publish, "listen": listen}[role](file, duration)
