"""From where the map was seen: stamps and poses of the images that entered it. No ROS in here."""

from __future__ import annotations

from collections import Counter

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Transform
from stairmap.trajectory import Trajectory

PLACE_SIZE = 0.1
"""Edge of the cells in which viewpoints are counted, m."""

PLACE_ANGLE = np.radians(10.0)
"""Range of viewing directions of a cell, rad."""

INDEX_STEP_NS = 1_000_000_000
"""Distance of two index stamps: far beyond what a trajectory interpolates over."""


class Viewpoints:
    """Poses that grow by doubling, with the number of times that each place was looked from.

    The modeler knows an image by its index stamp, ``INDEX_STEP_NS`` times its number: so a map outlives
    clocks that start again, in a restarted simulation or a bag that is played in a loop.

    Parameters
    ----------
    per_place
        How many images from one place are of use.
    """

    def __init__(self, *, per_place: int) -> None:
        self._per_place = per_place
        self._stamps_ns = np.zeros(64, dtype=np.int64)
        self._poses = np.zeros((64, 4, 4))
        self._count = 0
        self._places: Counter[tuple[int, ...]] = Counter()

    def __len__(self) -> int:
        return self._count

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) real stamps of the images, in nanoseconds."""
        return self._stamps_ns[: self._count]

    @property
    def poses(self) -> Float64Array:
        """(N, 4, 4) ``map_from_camera``, as they were taken or corrected since."""
        return self._poses[: self._count]

    @property
    def next_index_stamp_ns(self) -> int:
        """Index stamp of the image that is added next."""
        return (self._count + 1) * INDEX_STEP_NS

    def is_wanted(self, map_from_camera: Transform) -> bool:
        """Tell whether an image from this (4, 4) pose adds to the map."""
        return self._places[_place(map_from_camera)] < self._per_place

    def add(self, stamp_ns: int, map_from_camera: Transform) -> None:
        """Append an image."""
        if self._count == len(self._stamps_ns):
            self._stamps_ns = np.concatenate([self._stamps_ns, np.zeros_like(self._stamps_ns)])
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)])
        self._stamps_ns[self._count] = stamp_ns
        self._poses[self._count] = map_from_camera
        self._count += 1
        self._places[_place(map_from_camera)] += 1

    def correct(self, first: int, poses: Float64Array) -> None:
        """Replace the poses from number ``first`` on by (M, 4, 4) better ones."""
        self._poses[first : first + len(poses)] = poses

    def trajectory(self) -> Trajectory:
        """Return the poses over index stamps.

        Raises
        ------
        TrajectoryError
            If there are none.
        """
        index_stamps_ns = np.arange(1, self._count + 1) * INDEX_STEP_NS
        return Trajectory(stamps_ns=index_stamps_ns, map_from_camera=self.poses)

    def real_stamp_ns(self, index_stamp_ns: int) -> int:
        """Return an image's own stamp from its index stamp."""
        return int(self._stamps_ns[index_stamp_ns // INDEX_STEP_NS - 1])


def _place(map_from_camera: Transform) -> tuple[int, ...]:
    forward = map_from_camera[:3, 2]
    angles = np.array([np.arctan2(forward[1], forward[0]), np.arcsin(np.clip(forward[2], -1.0, 1.0))])
    cells = np.concatenate([map_from_camera[:3, 3] / PLACE_SIZE, angles / PLACE_ANGLE])
    return tuple(np.floor(cells).astype(int).tolist())
