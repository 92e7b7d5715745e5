"""All looks so far, and which flights they speak against.

Looks stay in the camera frame with their stamps, as observations do. A query places them by its trajectory,
so a loop closure moves a look with the frame that took it: one that looked at the wrong place, because poses
had drifted, then is of no flight any more.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.modeling.looks import Look
from stairmap.modeling.observation_table import rotated, with_room
from stairmap.modeling.saved_records import check_records
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_points

LOOK_FIELDS = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("middle", np.float64, 3),
        ("forward", np.float64, 3),
        ("is_absent", np.bool_),
    ]
)

MAX_OFFSET = 0.25
"""A look is of a flight when the line it looked along is no farther from the flight's, m: less than half a
landing or the height of two steps, more than what one frame's pose is off against its neighbours."""

MAX_TURN = float(np.radians(10.0))
"""... and the direction is no more off, rad."""

NUM_VIEWS = 18
"""A flight is judged by the last views, this many, that tell whether it is there: looks and observations. Six
neighbouring frames err together, by one wrong pose or one bad image, so these are three independent ones."""

MAX_SUPPORT = 3
"""A flight is withdrawn when no more of these see it. Three observations make a stairway, and what removed it
must not hang on the last few frames that saw it; a fourth later one brings it back."""


class LookTable:
    """Looks in arrays that grow by doubling, and where a trajectory puts them."""

    def __init__(self) -> None:
        self._records = np.zeros(64, dtype=LOOK_FIELDS)
        self._num = 0
        self.middle: Float64Array = np.zeros((0, 3))
        self.heading: Float64Array = np.zeros(0)

    @classmethod
    def from_records(cls, records: np.ndarray[tuple[int], np.dtype[np.void]]) -> LookTable:
        """Rebuild a table from its ``records``.

        Raises
        ------
        ValueError
            If the records have other fields or hold numbers that are none.
        """
        check_records("looks", records, LOOK_FIELDS)
        table = cls()
        table._records, table._num = records.copy(), len(records)
        return table

    def __len__(self) -> int:
        return self._num

    @property
    def records(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(N,) records of ``LOOK_FIELDS``, camera frame, m."""
        return self._records[: self._num]

    def add(self, look: Look) -> None:
        """Take in a look; one that neither sees its flight nor misses it says nothing."""
        if not (look.is_absent or look.is_present):
            return
        self._records = with_room(self._records, self._num + 1)
        self._records[self._num] = (look.stamp_ns, look.middle, look.forward, look.is_absent)
        self._num += 1

    def place(self, chosen: IntArray, poses: Float64Array) -> Mask:
        """Put (M,) looks where (M, 4, 4) poses say; return which of them moved."""
        self.middle, self.heading = with_room(self.middle, self._num), with_room(self.heading, self._num)
        records = self.records[chosen]
        middle = rotated(poses, records["middle"]) + poses[:, :3, 3]
        forward = rotated(poses, records["forward"])
        heading = np.arctan2(forward[:, 1], forward[:, 0])
        moved = (self.middle[chosen] != middle).any(axis=1) | (self.heading[chosen] != heading)
        self.middle[chosen], self.heading[chosen] = middle, heading
        return np.asarray(moved)

    def are_at(self, flight: Flight, chosen: IntArray) -> Mask:
        """Tell which of (M,) looks were at a flight as it is modelled now."""
        if not len(chosen):
            return np.zeros(0, dtype=np.bool_)
        local = transform_points(invert_transform(flight.map_from_flight), self.middle[chosen])
        turn = (self.heading[chosen] - flight.heading + np.pi) % (2 * np.pi) - np.pi
        offset = (local[:, 2] - flight.rise) * np.cos(flight.pitch) - local[:, 0] * np.sin(flight.pitch)
        end = (flight.num_risers - 1) * flight.run
        return np.asarray(
            (np.abs(turn) < MAX_TURN)
            & (np.abs(offset) < MAX_OFFSET)
            & (np.abs(local[:, 1]) < MAX_OFFSET)
            & (local[:, 0] > 0.0)
            & (local[:, 0] < end)
        )


def is_withdrawn(absent_ns: IntArray, seen_ns: IntArray) -> bool:
    """Tell whether a flight is withdrawn, by the stamps of the views that missed it and that saw it.

    It is when the last ``NUM_VIEWS`` of them hold at most ``MAX_SUPPORT`` that saw it.
    """
    if len(absent_ns) < NUM_VIEWS - MAX_SUPPORT:
        return False
    stamps = np.concatenate([absent_ns, seen_ns])
    is_seen = np.arange(len(stamps)) >= len(absent_ns)
    # Of one frame that says both, what it saw counts as the later.
    last = np.lexsort((is_seen, stamps))[-NUM_VIEWS:]
    return len(last) >= NUM_VIEWS and int(np.count_nonzero(is_seen[last])) <= MAX_SUPPORT
