"""``/tf`` and ``/tf_static`` into stairmap's own buffer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from stairmap.errors import StairmapError
from stairmap.recordings.bags.pose_message import transform_from_ros
from stairmap.recordings.transform_buffer import TransformBuffer

MAX_AGE_NS = 10_000_000_000
"""Transforms older than this are forgotten, as tf2 does."""


def subscribe_transforms(node: Node, take: Callable[[Any, bool], None]) -> None:
    """Call ``take(message, is_static)`` with every ``tf2_msgs/TFMessage``.

    Raises
    ------
    StairmapError
        If tf2_msgs is not installed.
    """
    try:
        from tf2_msgs.msg import TFMessage  # noqa: PLC0415
    except ImportError as error:
        raise StairmapError(
            "tf2_msgs is not installed, so the camera's pose cannot be known; "
            "run: sudo apt install ros-$ROS_DISTRO-tf2-msgs"
        ) from error
    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(TFMessage, "/tf", lambda message: take(message, False), QoSProfile(depth=100))
    node.create_subscription(TFMessage, "/tf_static", lambda message: take(message, True), latched)


def add_transform(buffer: TransformBuffer, stamped: Any, *, is_static: bool) -> bool:
    """Put one ``geometry_msgs/TransformStamped`` into the buffer.

    Returns
    -------
    False if it is no rigid transform and was not taken: one NaN of a localiser that is lost would spoil
    the map for good.
    """
    parent_from_child = transform_from_ros(stamped.transform.translation, stamped.transform.rotation)
    if parent_from_child is None:
        return False
    parent, child = stamped.header.frame_id, stamped.child_frame_id
    if is_static:
        buffer.add_static(parent, child, parent_from_child)
    else:
        buffer.add(parent, child, ns_from_time(stamped.header.stamp), parent_from_child)
    return True


def ns_from_time(time: Any) -> int:
    """Return a ``builtin_interfaces/Time`` in nanoseconds."""
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)
