"""Which stamps got a pose since the last query, and which poses moved.

Poses are compared, not objects: a caller may build the trajectory anew for each query.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.trajectory import SAME_STAMP_NS, Trajectory


class PoseMemory:
    """The trajectory of the last query, compared with that of the next."""

    def __init__(self) -> None:
        self._last: Trajectory | None = None

    def goes_on(self, trajectory: Trajectory) -> bool:
        """Tell whether a trajectory has all poses of the last one, and perhaps more after them."""
        last = self._last
        if last is trajectory:
            return True
        if last is None or len(trajectory) < len(last):
            return False
        return np.array_equal(trajectory.stamps_ns[: len(last)], last.stamps_ns) and np.array_equal(
            trajectory.map_from_camera[: len(last)], last.map_from_camera
        )

    def keep(self, trajectory: Trajectory) -> None:
        """Take a trajectory for the last one."""
        self._last = trajectory

    def has_same(self, trajectory: Trajectory) -> bool:
        """Tell whether a trajectory has the poses of the last one and no other."""
        return self._last is not None and len(trajectory) == len(self._last) and self.goes_on(trajectory)

    @property
    def end_ns(self) -> int:
        """Stamp from which on a longer trajectory may change poses between its own."""
        assert self._last is not None
        return int(self._last.stamps_ns[-1]) - SAME_STAMP_NS


class PoseChange(NamedTuple):
    """What a query's trajectory says otherwise than that of the query before.

    Attributes
    ----------
    chosen
        (M,) indices of the stamps with a pose that may be another one now, ascending.
    poses
        (M, 4, 4) their poses.
    is_new
        (M,) whether they had none before.
    lost
        Indices of the stamps that had a pose and have none any more.
    """

    chosen: IntArray
    poses: Float64Array
    is_new: Mask
    lost: IntArray


class KnownPoses:
    """Whether each of a growing number of stamps had a pose in the last query."""

    def __init__(self) -> None:
        self._is_known: Mask = np.zeros(0, dtype=np.bool_)

    @property
    def is_known(self) -> Mask:
        """(N,) whether each stamp had a pose."""
        return self._is_known

    def renew(
        self, stamps_ns: IntArray, trajectory: Trajectory, *, memory: PoseMemory, goes_on: bool
    ) -> PoseChange:
        """Look the poses up that may be other than in the last query.

        Parameters
        ----------
        stamps_ns
            (N,) all stamps; those of the last query first.
        trajectory
            That of this query.
        memory, goes_on
            That of the last one, and whether this one goes on from it.
        """
        was_known = np.zeros(len(stamps_ns), dtype=np.bool_)
        was_known[: len(self._is_known)] = self._is_known
        asked = (
            np.flatnonzero(~was_known | (stamps_ns >= memory.end_ns))
            if goes_on
            else np.arange(len(stamps_ns))
        )
        has_pose = trajectory.has_pose(stamps_ns[asked])
        known = asked[has_pose]
        poses = trajectory.poses_at(stamps_ns[known]) if len(known) else np.zeros((0, 4, 4))
        is_known = was_known.copy()
        is_known[asked] = has_pose
        self._is_known = is_known
        return PoseChange(known, poses, ~was_known[known], np.flatnonzero(was_known & ~is_known))
