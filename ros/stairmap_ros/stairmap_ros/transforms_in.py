"""``/tf`` and ``/tf_static`` into stairmap's own buffer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from stairmap.arrays import Transform
from stairmap.errors import StairmapError
from stairmap.recordings.bags.pose_message import transform_from_ros
from stairmap.recordings.transform_buffer import TransformBuffer
from stairmap_ros.node_status import NodeStatus

MAX_AGE_NS = 10_000_000_000
"""Transforms older than this are forgotten, as tf2 does."""


class TransformsIn:
    """Takes transforms and looks them up.

    Parameters
    ----------
    node
        Who subscribes.
    max_gap
        Transforms farther apart than this are not interpolated, s.
    status
        Where what is wrong with them is noted.
    watch_clock
        Called with the name of a source and each of its stamps, nanoseconds.
    changed
        Called when there is more to be looked up.

    Raises
    ------
    StairmapError
        If tf2_msgs is not installed.
    """

    def __init__(
        self,
        node: Node,
        *,
        max_gap: float,
        status: NodeStatus,
        watch_clock: Callable[[str, int], None],
        changed: Callable[[], None],
    ) -> None:
        try:
            from tf2_msgs.msg import TFMessage  # noqa: PLC0415
        except ImportError as error:
            raise StairmapError(
                "tf2_msgs is not installed, so the camera's pose cannot be known; "
                "run: sudo apt install ros-$ROS_DISTRO-tf2-msgs"
            ) from error
        self._node, self._status = node, status
        self._watch_clock, self._changed = watch_clock, changed
        self._buffer = TransformBuffer(max_age_ns=MAX_AGE_NS, max_gap_ns=round(max_gap * 1e9))
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._subscriptions = [
            node.create_subscription(TFMessage, "/tf", self._take, QoSProfile(depth=100)),
            node.create_subscription(TFMessage, "/tf_static", self._take_static, latched),
        ]

    def lookup(self, destination: str, source: str, stamp_ns: int) -> Transform:
        """Return the (4, 4) ``destination_from_source`` at a stamp; see ``TransformBuffer.lookup``."""
        return self._buffer.lookup(destination, source, stamp_ns)

    def clear(self) -> None:
        """Forget all transforms but the static ones."""
        self._buffer.clear()

    def close(self) -> None:
        """End the subscriptions."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _take(self, message: Any) -> None:
        for stamped in message.transforms:
            self._watch_clock(f"/tf of {stamped.child_frame_id}", ns_from_time(stamped.header.stamp))
        self._add(message, is_static=False)

    def _take_static(self, message: Any) -> None:
        self._add(message, is_static=True)

    def _add(self, message: Any, *, is_static: bool) -> None:
        for stamped in message.transforms:
            if not add_transform(self._buffer, stamped, is_static=is_static):
                self._status.num_invalid_transforms += 1
                self._node.get_logger().warning(
                    f"the transform from {stamped.child_frame_id} to {stamped.header.frame_id} has a value "
                    "that is not finite or a quaternion whose length is not 1, and is not used",
                    throttle_duration_sec=10.0,
                )
        self._changed()


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
