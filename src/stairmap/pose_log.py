"""The poses of frames as they come in, some not known yet, all of them moved by a loop closure."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Transform
from stairmap.errors import TrajectoryError
from stairmap.trajectory import Trajectory
from stairmap.transforms import check_pose, invert_transforms, spread_corrections

INITIAL_LENGTH = 64
"""Frames that fit before the arrays grow for the first time."""


class PoseLog:
    """Stamps and poses in arrays that grow by doubling: adding one costs the same at any length."""

    def __init__(self) -> None:
        self._stamps_ns = np.zeros(INITIAL_LENGTH, dtype=np.int64)
        self._poses = np.zeros((INITIAL_LENGTH, 4, 4))
        self._has_pose = np.zeros(INITIAL_LENGTH, dtype=np.bool_)
        self._count = 0
        self._num_placed = 0
        self._trajectory: Trajectory | None = None

    @classmethod
    def from_arrays(cls, stamps_ns: IntArray, map_from_camera: Float64Array) -> PoseLog:
        """Build a log of (N,) stamps and (N, 4, 4) poses, NaN where there is none.

        Raises
        ------
        ValueError
            If there are more of one than of the other.
        TrajectoryError
            If stamps do not increase or a pose is no rigid transform.
        """
        if len(stamps_ns) != len(map_from_camera):
            raise ValueError(f"{len(stamps_ns)} stamps have {len(map_from_camera)} poses")
        log = cls()
        if len(stamps_ns):
            placed: Mask = np.asarray(~np.isnan(map_from_camera).all(axis=(1, 2)))
            # It checks what comes from outside.
            Trajectory(
                stamps_ns=stamps_ns,
                map_from_camera=np.where(placed[:, None, None], map_from_camera, np.eye(4)),
            )
            log._stamps_ns = np.array(stamps_ns, dtype=np.int64)
            log._poses = np.array(map_from_camera, dtype=np.float64)
            log._has_pose = np.array(placed)
            log._count = len(stamps_ns)
            log._num_placed = int(np.count_nonzero(placed))
        return log

    def __len__(self) -> int:
        return self._count

    @property
    def num_placed(self) -> int:
        """Number of frames with a pose."""
        return self._num_placed

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all frames, in nanoseconds."""
        return self._stamps_ns[: self._count]

    @property
    def map_from_camera(self) -> Float64Array:
        """(N, 4, 4) poses of all frames, NaN where there is none."""
        return self._poses[: self._count]

    @property
    def has_pose(self) -> Mask:
        """(N,) which frames have a pose."""
        return self._has_pose[: self._count]

    def check_stamp(self, stamp_ns: int) -> None:
        """Refuse a stamp that is not after all others.

        Raises
        ------
        TrajectoryError
            If it is not.
        """
        if self._count and stamp_ns <= self._stamps_ns[self._count - 1]:
            last_ns = int(self._stamps_ns[self._count - 1])
            raise TrajectoryError(
                f"expected a frame after that at {last_ns * 1e-9:.6f} s ({last_ns} ns), got one at "
                f"{stamp_ns * 1e-9:.6f} s ({stamp_ns} ns); add frames in the order of their stamps, each once"
            )

    def add(self, stamp_ns: int, map_from_camera: Transform | None) -> None:
        """Append a frame.

        Raises
        ------
        TrajectoryError
            If its stamp is not after the one before it, or its pose is no rigid transform.
        """
        self.check_stamp(stamp_ns)
        pose = np.full((4, 4), np.nan) if map_from_camera is None else check_pose(map_from_camera)
        if self._count == len(self._stamps_ns):
            self._stamps_ns = np.concatenate([self._stamps_ns, np.zeros_like(self._stamps_ns)])
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)])
            self._has_pose = np.concatenate([self._has_pose, np.zeros_like(self._has_pose)])
        self._stamps_ns[self._count] = stamp_ns
        self._poses[self._count] = pose
        self._has_pose[self._count] = map_from_camera is not None
        self._count += 1
        if map_from_camera is not None:
            self._num_placed += 1
            self._trajectory = None

    def trajectory(self) -> Trajectory:
        """Return the poses of the frames that have one.

        Raises
        ------
        TrajectoryError
            If none has.
        """
        if self._trajectory is None:
            placed = self.has_pose
            self._trajectory = Trajectory(
                stamps_ns=self.stamps_ns[placed], map_from_camera=self.map_from_camera[placed]
            )
        return self._trajectory

    def correct(self, path: Trajectory) -> None:
        """Move the poses along with a corrected path; see ``MapSession.correct``.

        Raises
        ------
        TrajectoryError
            If the path has the stamp of no frame.
        """
        stamps, placed = self.stamps_ns, self.has_pose
        is_on_path = path.has_pose(stamps) if len(stamps) else placed
        if not is_on_path.any():
            first, last = path.stamps_ns[[0, -1]] * 1e-9
            raise TrajectoryError(
                "expected corrected poses at stamps of frames, or at most 0.1 s apart around them, but the "
                f"{len(path)} poses from {first:.6f} s to {last:.6f} s have the stamp of none of the "
                f"{len(stamps)} frames"
            )
        poses = self._poses[: self._count].copy()
        poses[is_on_path] = path.poses_at(stamps[is_on_path])
        anchors, others = placed & is_on_path, placed & ~is_on_path
        if anchors.any() and others.any():
            corrections = poses[anchors] @ invert_transforms(self._poses[: self._count][anchors])
            poses[others] = spread_corrections(stamps[anchors], corrections, stamps[others]) @ poses[others]
        self._poses[: self._count] = poses
        self._has_pose[: self._count] |= is_on_path
        self._num_placed = int(np.count_nonzero(self.has_pose))
        self._trajectory = None
