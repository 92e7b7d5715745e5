"""From where the map was seen, and when: real stamps of the images that entered it. No ROS in here."""

from __future__ import annotations

from collections import Counter

import numpy as np

from stairmap.arrays import IntArray, Transform

PLACE_SIZE = 0.1
"""Edge of the cells in which viewpoints are counted, m."""

PLACE_ANGLE = np.radians(10.0)
"""Range of viewing directions of a cell, rad."""

INDEX_STEP_NS = 1_000_000_000
"""Distance of two index stamps: far beyond what a trajectory interpolates over."""


class Viewpoints:
    """Stamps of images, and how often each place was looked from.

    The session knows an image by its index stamp, ``INDEX_STEP_NS`` times its number: so a map outlives
    clocks that start again, in a restarted simulation or a bag that is played in a loop.

    Parameters
    ----------
    per_place
        How many images from one place are of use: of those that show stairs, and again of those that miss
        stairs which are in the map. One of either kind makes room for another of the other kind, so stairs
        that were taken away and came back are seen again from a place that was looked from often enough.
    """

    def __init__(self, *, per_place: int) -> None:
        self._per_place = per_place
        self._stamps_ns = np.zeros(64, dtype=np.int64)
        self._count = 0
        self._places: dict[bool, Counter[tuple[int, ...]]] = {False: Counter(), True: Counter()}

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

    def is_wanted(self, map_from_camera: Transform, *, shows_stairs: bool) -> bool:
        """Tell whether an image from this (4, 4) pose, which shows or misses stairs, adds to the map."""
        return self._places[shows_stairs][_place(map_from_camera)] < self._per_place

    def add(self, stamp_ns: int, map_from_camera: Transform, *, shows_stairs: bool) -> None:
        """Append an image."""
        if self._count == len(self._stamps_ns):
            self._stamps_ns = np.concatenate([self._stamps_ns, np.zeros_like(self._stamps_ns)])
        self._stamps_ns[self._count] = stamp_ns
        self._count += 1
        place = _place(map_from_camera)
        self._places[shows_stairs][place] += 1
        others = self._places[not shows_stairs]
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
