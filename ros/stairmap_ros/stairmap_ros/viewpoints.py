"""From where the map was seen, and when: real stamps of the images that entered it. No ROS in here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from enum import Enum

import numpy as np

from stairmap.arrays import IntArray, Transform

PLACE_SIZE = 0.1
"""Edge of the cells in which viewpoints are counted, m."""

PLACE_ANGLE = np.radians(10.0)
"""Range of viewing directions of a cell, rad."""

INDEX_STEP_NS = 1_000_000_000
"""Distance of two index stamps: far beyond what a trajectory interpolates over."""


GROUND_SHARE = 0.3
"""So large a share of the images from one place may show ground and nothing else: it tells of floors, and
against edges that are gone, with few."""


class ViewKind(Enum):
    """What an image adds to the map."""

    STAIRS = "shows stairs"
    MISSED_STAIRS = "misses stairs that are in the map"
    DROP = "shows an edge of the ground"
    GROUND = "shows ground"

    @property
    def opposite(self) -> ViewKind:
        """What speaks against it."""
        return _OPPOSITES[self]


_OPPOSITES = {
    ViewKind.STAIRS: ViewKind.MISSED_STAIRS,
    ViewKind.MISSED_STAIRS: ViewKind.STAIRS,
    ViewKind.DROP: ViewKind.GROUND,
    ViewKind.GROUND: ViewKind.DROP,
}


class Viewpoints:
    """Stamps of images, and how often each place was looked from.

    The session knows an image by its index stamp, ``INDEX_STEP_NS`` times its number: so a map outlives
    clocks that start again, in a restarted simulation or a bag that is played in a loop.

    Parameters
    ----------
    per_place
        How many images of one kind from one place are of use; of ground alone, a share of that. One of a kind
        makes room for another of the opposite kind, so stairs that were taken away and came back are seen
        again from a place that was looked from often enough.
    """

    def __init__(self, *, per_place: int) -> None:
        self._per_place = per_place
        self._stamps_ns = np.zeros(64, dtype=np.int64)
        self._count = 0
        self._places: dict[ViewKind, Counter[tuple[int, ...]]] = {kind: Counter() for kind in ViewKind}

    def __len__(self) -> int:
        return self._count

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) real stamps of the images, in nanoseconds."""
        return self._stamps_ns[: self._count]

    @property
    def next_index_stamp_ns(self) -> int:
        """Index stamp of the image that is added next."""
        return (self._count + 1) * INDEX_STEP_NS

    def is_wanted(self, map_from_camera: Transform, kind: ViewKind) -> bool:
        """Tell whether an image of a kind from this (4, 4) pose adds to the map."""
        most = np.ceil(GROUND_SHARE * self._per_place) if kind is ViewKind.GROUND else self._per_place
        return bool(self._places[kind][_place(map_from_camera)] < most)

    def add(self, stamp_ns: int, map_from_camera: Transform, kinds: Iterable[ViewKind]) -> None:
        """Append an image for what it was wanted for."""
        if self._count == len(self._stamps_ns):
            self._stamps_ns = np.concatenate([self._stamps_ns, np.zeros_like(self._stamps_ns)])
        self._stamps_ns[self._count] = stamp_ns
        self._count += 1
        place = _place(map_from_camera)
        for kind in kinds:
            self._places[kind][place] += 1
            others = self._places[kind.opposite]
            others[place] = max(others[place] - 1, 0)

    def real_stamp_ns(self, index_stamp_ns: int) -> int:
        """Return an image's own stamp from its index stamp."""
        return int(self._stamps_ns[index_stamp_ns // INDEX_STEP_NS - 1])


def index_stamps_ns(num_images: int) -> IntArray:
    """Return the (N,) index stamps of a map of so many images."""
    return np.asarray(np.arange(1, num_images + 1, dtype=np.int64) * INDEX_STEP_NS)


def _place(map_from_camera: Transform) -> tuple[int, ...]:
    forward = map_from_camera[:3, 2]
    angles = np.array([np.arctan2(forward[1], forward[0]), np.arcsin(np.clip(forward[2], -1.0, 1.0))])
    cells = np.concatenate([map_from_camera[:3, 3] / PLACE_SIZE, angles / PLACE_ANGLE])
    return tuple(np.floor(cells).astype(int).tolist())
