"""The transforms of one coordinate frame to its parent, by time."""

from __future__ import annotations

from array import array
from bisect import bisect_left

import numpy as np

from stairmap.arrays import Transform
from stairmap.errors import TransformProblem
from stairmap.trajectory import SAME_STAMP_NS
from stairmap.transforms import interpolate_poses

MAX_TRANSFORM_GAP_NS = 500_000_000
"""Transforms farther apart than this, nanoseconds, are not interpolated: odometry of 5 Hz that loses a
message is. A robot that accelerates by 1 m/s² is then at most 3 cm from where a straight line puts it."""

MAX_SLOW_GAP_NS = 2_500_000_000
"""Up to this, nanoseconds, a longer gap is bridged if the frame has hardly moved: corrections of map -> odom
come as rarely as every second or two."""

SLOW_DISTANCE = 0.1
"""A frame has hardly moved if it is less than this from where it was before the gap, m: no pose in between
can be wrong by more."""

SLOW_ANGLE = 0.035
"""And if it is turned by less than this, rad: 2 deg."""

_NUM_VALUES = 12
"""Values kept of a transform: its upper three rows."""


class TransformHistory:
    """Stamped transforms ``parent_from_child``, 104 bytes each; in-order stamps cost the same forever."""

    def __init__(self) -> None:
        self._stamps_ns = array("q")
        self._values = array("d")
        self._num_dropped = 0

    def __len__(self) -> int:
        return len(self._stamps_ns) - self._num_dropped

    @property
    def first_ns(self) -> int:
        """Stamp of the oldest transform that is kept, in nanoseconds."""
        return self._stamps_ns[self._num_dropped]

    @property
    def last_ns(self) -> int:
        """Stamp of the newest transform, in nanoseconds."""
        return self._stamps_ns[-1]

    def add(self, stamp_ns: int, parent_from_child: Transform) -> None:
        """Insert a (4, 4) transform at its time; one of the same stamp replaces the one before."""
        values = array("d", np.ascontiguousarray(parent_from_child[:3], dtype=np.float64).tobytes())
        if not len(self) or stamp_ns > self.last_ns:
            self._stamps_ns.append(stamp_ns)
            self._values.extend(values)
            return
        index = bisect_left(self._stamps_ns, stamp_ns, lo=self._num_dropped)
        start = index * _NUM_VALUES
        if self._stamps_ns[index] == stamp_ns:
            self._values[start : start + _NUM_VALUES] = values
        else:
            self._stamps_ns.insert(index, stamp_ns)
            self._values[start:start] = values

    def drop_before(self, stamp_ns: int) -> None:
        """Forget transforms older than a stamp, but never the newest."""
        while len(self) > 1 and self.first_ns < stamp_ns:
            self._num_dropped += 1
        if self._num_dropped > len(self):
            del self._stamps_ns[: self._num_dropped]
            del self._values[: self._num_dropped * _NUM_VALUES]
            self._num_dropped = 0

    def at(self, stamp_ns: int, *, max_gap_ns: int) -> Transform | TransformProblem:
        """Return the (4, 4) ``parent_from_child`` at a stamp, or why there is none."""
        first, end = self._num_dropped, len(self._stamps_ns)
        after = bisect_left(self._stamps_ns, stamp_ns, lo=first)
        for index in (after, after - 1):
            if first <= index < end and abs(self._stamps_ns[index] - stamp_ns) <= SAME_STAMP_NS:
                return self._transform(index)
        if after == first:
            return TransformProblem.TOO_EARLY
        if after == end:
            return TransformProblem.NOT_YET
        stamps_ns = np.array([self._stamps_ns[after - 1], self._stamps_ns[after]])
        around = np.stack([self._transform(after - 1), self._transform(after)])
        gap_ns = int(stamps_ns[1] - stamps_ns[0])
        is_slow = gap_ns <= MAX_SLOW_GAP_NS and _has_hardly_moved(around[0], around[1])
        if gap_ns > max_gap_ns and not is_slow:
            return TransformProblem.GAP
        between: Transform = interpolate_poses(stamps_ns, around, np.array([stamp_ns]))[0]
        return between

    def stamps_around(self, stamp_ns: int) -> tuple[int, int]:
        """Return the last stamp before and the first one after, in nanoseconds, for a stamp in between."""
        after = bisect_left(self._stamps_ns, stamp_ns, lo=self._num_dropped)
        return self._stamps_ns[after - 1], self._stamps_ns[after]

    def distance_ns(self, stamp_ns: int) -> int:
        """Return how far a stamp is from the time that is covered, in nanoseconds; 0 within it."""
        return max(self.first_ns - stamp_ns, stamp_ns - self.last_ns, 0)

    def _transform(self, index: int) -> Transform:
        transform = np.eye(4)
        start = index * _NUM_VALUES
        transform[:3] = np.reshape(self._values[start : start + _NUM_VALUES], (3, 4))
        return transform


def _has_hardly_moved(before: Transform, after: Transform) -> bool:
    cosine = (np.trace(before[:3, :3].T @ after[:3, :3]) - 1.0) / 2.0
    distance = np.linalg.norm(after[:3, 3] - before[:3, 3])
    return bool(distance <= SLOW_DISTANCE and cosine >= np.cos(SLOW_ANGLE))
