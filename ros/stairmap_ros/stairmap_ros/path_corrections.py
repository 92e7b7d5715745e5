"""Loop closures: moves viewpoints along with a path that SLAM has corrected. No ROS in here.

What SLAM now says of the robot's pose at some stamps, against what TF said of it then, is a correction at
these stamps. Between them it is interpolated; before the first and after the last it is that of the nearest.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Transform
from stairmap.errors import TrajectoryError
from stairmap.recordings.bags.pose_message import transform_from_ros
from stairmap.trajectory import Trajectory
from stairmap.transforms import interpolate_poses, invert_transforms, spread_corrections

MIN_DISTANCE = 0.05
"""The robot's pose is noted again when it has moved this far, m, or turned by ``MIN_ANGLE``."""

MIN_ANGLE = np.radians(3.0)
"""See ``MIN_DISTANCE``, rad."""


class PathCorrections:
    """Remembers where TF said the robot was, every few centimetres of its way.

    Parameters
    ----------
    first
        Number of the first viewpoint of this session; those before it came from a file and stay.
    """

    def __init__(self, *, first: int) -> None:
        self._first = first
        self._stamps_ns: list[int] = []
        self._map_from_body: list[Float64Array] = []
        self._recorded = np.zeros((0, 4, 4))

    def add(self, stamp_ns: int, map_from_body: Transform) -> None:
        """Note a (4, 4) pose of the robot as TF gives it; stamps that do not increase are passed over."""
        if self._stamps_ns and stamp_ns <= self._stamps_ns[-1]:
            return
        # The newest is always kept; the one before it goes if the robot has hardly moved over it.
        if len(self._stamps_ns) > 1 and _is_near(self._map_from_body[-2], map_from_body):
            del self._stamps_ns[-1], self._map_from_body[-1]
        self._stamps_ns.append(stamp_ns)
        self._map_from_body.append(np.array(map_from_body))

    def corrected(
        self, path: Trajectory, stamps_ns: IntArray, poses: Float64Array
    ) -> tuple[int, Float64Array]:
        """Return the number of the first viewpoint to correct, and (M, 4, 4) poses from there on.

        Parameters
        ----------
        path
            ``map_from_body`` as SLAM gives it now.
        stamps_ns, poses
            (N,) stamps of the images in the map, in nanoseconds, and (N, 4, 4) their poses; each is corrected
            from the pose that TF gave it, whatever was done since.

        Raises
        ------
        TrajectoryError
            If the path has no stamp of the time that was noted.
        """
        self._keep_recorded(poses)
        noted_ns = np.array(self._stamps_ns, dtype=np.int64)
        known = np.zeros(len(path), dtype=bool)
        if len(noted_ns) > 1:
            known = (path.stamps_ns >= noted_ns[0]) & (path.stamps_ns <= noted_ns[-1])
        if not known.any():
            raise TrajectoryError("no stamp of the path lies in the time since this node started")
        path_ns = path.stamps_ns[known]
        noted = interpolate_poses(noted_ns, np.array(self._map_from_body), path_ns)
        corrections = path.map_from_camera[known] @ invert_transforms(noted)
        moved = spread_corrections(path_ns, corrections, stamps_ns[self._first :])
        return self._first, np.asarray(moved @ self._recorded)

    def _keep_recorded(self, poses: Float64Array) -> None:
        """Copy the poses of viewpoints that are new since the last correction: these are still TF's."""
        num_kept = len(self._recorded)
        new = poses[self._first + num_kept :]
        self._recorded = np.concatenate([self._recorded, new])


def _is_near(pose: Transform, other: Transform) -> bool:
    moved = np.linalg.norm(other[:3, 3] - pose[:3, 3])
    cosine = (np.trace(pose[:3, :3].T @ other[:3, :3]) - 1.0) / 2.0
    return bool(moved < MIN_DISTANCE and cosine > np.cos(MIN_ANGLE))


def trajectory_from_path(message: Any) -> Trajectory:
    """Return the poses of a ``nav_msgs/Path``, whose poses carry their own stamps.

    Raises
    ------
    TrajectoryError
        If it is empty, its stamps do not increase, or a pose of it is none.
    """
    stamps_ns: list[int] = []
    poses: list[Transform] = []
    for stamped in message.poses:
        stamp, pose = stamped.header.stamp, stamped.pose
        stamps_ns.append(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec))
        map_from_body = transform_from_ros(pose.position, pose.orientation)
        if map_from_body is None:
            raise TrajectoryError(
                f"pose {len(poses) + 1} of the path has a value that is not finite or a quaternion whose "
                "length is not 1"
            )
        poses.append(map_from_body)
    return Trajectory(stamps_ns=np.array(stamps_ns, dtype=np.int64), map_from_camera=np.array(poses))
