"""Poses and transforms as ROS sends them; any object with the message's fields will do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from stairmap.arrays import Transform
from stairmap.recordings.tum_trajectory import QUAT_NORM_TOLERANCE

StampedTransform = tuple[str, str, int, Transform | None]
"""Parent, child, stamp in nanoseconds, and ``parent_from_child``; ``None`` if that is no rigid transform."""


def transform_from_ros(translation: Any, rotation: Any) -> Transform | None:
    """Return the (4, 4) transform of a ``Vector3`` or ``Point`` (m) and a ``Quaternion``.

    Returns
    -------
    ``None`` if a value is not finite or the quaternion's length is not one within 0.01, as that of a
    publisher that has no pose yet.
    """
    x, y, z, w = float(rotation.x), float(rotation.y), float(rotation.z), float(rotation.w)
    position = float(translation.x), float(translation.y), float(translation.z)
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not (abs(norm - 1.0) <= QUAT_NORM_TOLERANCE and all(map(math.isfinite, position))):
        return None
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), position[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), position[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), position[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def stamp_ns_of(header: Any) -> int:
    """Return the stamp of a ``std_msgs/Header`` of ROS 1 or ROS 2, in nanoseconds."""
    stamp = header.stamp
    nanoseconds = stamp.nanosec if hasattr(stamp, "nanosec") else stamp.nsec
    seconds = stamp.sec if hasattr(stamp, "sec") else stamp.secs
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def transforms_from_tf(message: Any) -> Iterator[StampedTransform]:
    """Return what a ``TFMessage`` holds."""
    for stamped in message.transforms:
        yield _from_transform_stamped(stamped)


def transform_from_pose_message(message: Any) -> StampedTransform:
    """Return what an ``Odometry``, ``PoseStamped``, its kind with covariance or a ``TransformStamped`` holds.

    The child is empty where the message does not name whose pose it is.
    """
    if hasattr(message, "transform"):
        return _from_transform_stamped(message)
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    return (
        message.header.frame_id,
        getattr(message, "child_frame_id", ""),
        stamp_ns_of(message.header),
        transform_from_ros(pose.position, pose.orientation),
    )


def _from_transform_stamped(stamped: Any) -> StampedTransform:
    transform = stamped.transform
    return (
        stamped.header.frame_id,
        stamped.child_frame_id,
        stamp_ns_of(stamped.header),
        transform_from_ros(transform.translation, transform.rotation),
    )
