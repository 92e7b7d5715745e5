"""Keep a bounded number of the points of a cloud, whatever its size: one measured point in each small cube.

A kept point is one that was measured, never a mean: means of points on both sides of an edge would round it.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Vector

FINEST_SIZE = 0.02
"""Side of the cubes while there is room, m: a tread of 0.28 by 1 m keeps 700 points, and its height is known
to a fortieth of the noise."""

COARSEST_SIZE = 0.08
"""Side above which steps could not be told apart any more, m."""

MAX_POINTS = 16_000_000
"""Most points that are kept: 200 MB, and as much again while they are sorted."""

GROWTH = float(np.sqrt(2.0))
"""The cubes grow by this factor when there are too many."""

PENDING_SHARE = 0.25
"""New points are sorted in among the others when they are this share of them."""

_BITS = 21
"""Bits of a cube's number along one axis: 42 km at 20 mm."""

_HALF = 1 << (_BITS - 1)


class ThinnedCloud:
    """A cloud that takes points in chunks and keeps one in each cube.

    Parameters
    ----------
    origin
        (3,) point near the cloud, in its coordinates, m; points are kept relative to it, so that national
        grids lose nothing in float32.
    size
        Side of the cubes to begin with, m.
    max_points
        Most points that are kept; the cubes grow when there are more.

    Attributes
    ----------
    origin, size
        As given; ``size`` as it is now.
    num_added
        Points that came in, those that were dropped included.
    """

    def __init__(self, origin: Vector, *, size: float = FINEST_SIZE, max_points: int = MAX_POINTS) -> None:
        self.origin = np.asarray(origin, dtype=np.float64)
        self.size = size
        self.num_added = 0
        self._max_points = max_points
        self._keys: IntArray = np.zeros(0, dtype=np.int64)
        self._points: Float32Array = np.zeros((0, 3), dtype=np.float32)
        self._pending: list[tuple[IntArray, Float32Array]] = []
        self._num_pending = 0

    def add(self, points: Float64Array) -> None:
        """Take in (N, 3) finite points, m, in the cloud's coordinates."""
        self.num_added += len(points)
        local = (points - self.origin).astype(np.float32)
        keys, first = first_of_each(cube_keys(local, self.size))
        is_new = ~_is_in(keys, self._keys)
        self._pending.append((keys[is_new], local[first[is_new]]))
        self._num_pending += int(np.count_nonzero(is_new))
        if self._num_pending > PENDING_SHARE * max(len(self._keys), len(points)):
            self._merge()

    def points(self) -> Float32Array:
        """Return the (M, 3) points kept so far, relative to ``origin``, m."""
        self._merge()
        return self._points

    def _merge(self) -> None:
        if self._pending:
            # Both parts are sorted already: a stable sort merges them.
            keys = np.concatenate([self._keys, *(part for part, _ in self._pending)])
            points = np.concatenate([self._points, *(part for _, part in self._pending)])
            self._pending, self._num_pending = [], 0
            self._keys, first = first_of_each(keys)
            self._points = points[first]
        while len(self._keys) > self._max_points and self.size < COARSEST_SIZE:
            self.size = min(self.size * GROWTH, COARSEST_SIZE)
            self._keys, first = first_of_each(cube_keys(self._points, self.size))
            self._points = self._points[first]


def cube_keys(points: Float32Array, size: float) -> IntArray:
    """Return the (N,) number of the cube that each of (N, 3) points lies in, x first."""
    cubes = np.floor(points * np.float32(1.0 / size)).astype(np.int64) + _HALF
    np.clip(cubes, 0, 2 * _HALF - 1, out=cubes)
    return np.asarray((cubes[:, 0] << (2 * _BITS)) | (cubes[:, 1] << _BITS) | cubes[:, 2])


def first_of_each(keys: IntArray) -> tuple[IntArray, IntArray]:
    """Return the distinct keys in ascending order and where each stands first."""
    # Neighbours in a scan often share a cube: this is cheaper than sorting all of them.
    starts = (
        np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
        if len(keys)
        else np.zeros(0, np.int64)
    )
    order = np.argsort(keys[starts], kind="stable")
    ordered = keys[starts[order]]
    is_first = np.concatenate([[True], ordered[1:] != ordered[:-1]]) if len(ordered) else np.zeros(0, bool)
    return ordered[is_first], starts[order[is_first]]


def _is_in(keys: IntArray, known: IntArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Tell which of some sorted keys are among others, sorted as well."""
    if not len(known):
        return np.zeros(len(keys), dtype=bool)
    place = np.minimum(np.searchsorted(known, keys), len(known) - 1)
    return np.asarray(known[place] == keys)
