"""Where the camera was: poses over time, interpolated between stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Transform, readonly
from stairmap.errors import TrajectoryError
from stairmap.transforms import find_pose_flaw, interpolate_poses

SAME_STAMP_NS = 1_000
"""Stamps this close are the same one, printed by way of a float, nanoseconds."""

MAX_GAP_NS = 100_000_000
"""A pose is not interpolated across more than this many nanoseconds (docs/inputs.md)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Poses of the camera's optical coordinate frame in the map.

    Attributes
    ----------
    stamps_ns
        (N,) strictly increasing int64 stamps, in nanoseconds.
    map_from_camera
        (N, 4, 4) rigid transforms, translation in metres.

    Raises
    ------
    TrajectoryError
        If stamps do not increase, shapes disagree, or a pose is no rigid transform.
    """

    stamps_ns: IntArray
    map_from_camera: Float64Array

    def __post_init__(self) -> None:
        stamps = readonly(self.stamps_ns, np.int64)
        poses = readonly(self.map_from_camera).reshape(-1, 4, 4)
        if stamps.ndim != 1 or len(stamps) != len(poses) or len(stamps) == 0:
            raise TrajectoryError(
                f"expected one pose per stamp and at least one, got {stamps.size} stamps "
                f"and {len(poses)} poses"
            )
        backward = np.flatnonzero(np.diff(stamps) <= 0)
        if len(backward):
            raise TrajectoryError(
                f"expected stamps that increase, but pose {backward[0] + 2} has stamp "
                f"{stamps[backward[0] + 1] * 1e-9:.6f} s after {stamps[backward[0]] * 1e-9:.6f} s"
            )
        flaw = find_pose_flaw(poses)
        if flaw is not None:
            raise TrajectoryError(
                f"expected rigid transforms, but pose {flaw[0] + 1} of {len(poses)}, at "
                f"{stamps[flaw[0]] * 1e-9:.6f} s, has {flaw[1]}"
            )
        object.__setattr__(self, "stamps_ns", stamps)
        object.__setattr__(self, "map_from_camera", poses)

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def has_pose(self, stamps_ns: IntArray, *, max_gap_ns: int = MAX_GAP_NS) -> Mask:
        """Tell for each of (M,) stamps whether a pose can be given.

        A pose can be given at a stamp of the trajectory itself (to a microsecond), or between
        two that are at most ``max_gap_ns`` apart. Nothing is extrapolated.
        """
        wanted, is_own = self._snap(stamps_ns)
        after = np.searchsorted(self.stamps_ns, wanted)
        inside = (after > 0) & (after < len(self))
        after = np.clip(after, 1, max(len(self) - 1, 1))
        gap = self.stamps_ns[np.minimum(after, len(self) - 1)] - self.stamps_ns[after - 1]
        return np.asarray(is_own | (inside & (gap <= max_gap_ns)))

    def poses_at(self, stamps_ns: IntArray, *, max_gap_ns: int = MAX_GAP_NS) -> Float64Array:
        """Return the (M, 4, 4) poses at (M,) stamps.

        Raises
        ------
        TrajectoryError
            If a stamp lies outside the trajectory or in a gap of more than ``max_gap_ns``.
        """
        wanted, is_own = self._snap(stamps_ns)
        known = self.has_pose(wanted, max_gap_ns=max_gap_ns)
        if not known.all():
            stamp = wanted[np.flatnonzero(~known)[0]]
            raise TrajectoryError(
                f"no pose within {max_gap_ns * 1e-9:.3g} s of stamp {stamp * 1e-9:.6f} s; poses run from "
                f"{self.stamps_ns[0] * 1e-9:.6f} s to {self.stamps_ns[-1] * 1e-9:.6f} s"
            )
        poses = np.empty((len(wanted), 4, 4))
        poses[is_own] = self.map_from_camera[np.searchsorted(self.stamps_ns, wanted[is_own])]
        if not is_own.all():
            between = ~is_own
            poses[between] = interpolate_poses(self.stamps_ns, self.map_from_camera, wanted[between])
        return poses

    def pose_at(self, stamp_ns: int, *, max_gap_ns: int = MAX_GAP_NS) -> Transform:
        """Return the (4, 4) pose at one stamp; see ``poses_at``."""
        pose: Transform = self.poses_at(np.array([stamp_ns]), max_gap_ns=max_gap_ns)[0]
        return pose

    def _snap(self, stamps_ns: IntArray) -> tuple[IntArray, Mask]:
        """Move stamps within a microsecond of the trajectory's own onto them; tell which were."""
        wanted = np.atleast_1d(np.asarray(stamps_ns, dtype=np.int64))
        after = np.searchsorted(self.stamps_ns, wanted)
        later = self.stamps_ns[np.minimum(after, len(self) - 1)]
        earlier = self.stamps_ns[np.maximum(after - 1, 0)]
        nearest = np.where(np.abs(later - wanted) <= np.abs(wanted - earlier), later, earlier)
        is_own = np.abs(nearest - wanted) <= SAME_STAMP_NS
        return np.where(is_own, nearest, wanted), np.asarray(is_own)
