"""A cloud of the map that stays small: one point for each voxel that something was seen in."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points

_BITS = 21
"""Voxels along each axis are counted in so many bits, so that three of them make one int64 key."""


class VoxelCloud:
    """Keeps the first point of each voxel.

    When there are more than ``max_points``, voxels grow until half as many are left, so memory is bounded
    whatever the size of the map.

    Parameters
    ----------
    voxel_size
        Edge of a voxel at the start, m.
    max_points
        How many points are kept at most.
    """

    def __init__(self, voxel_size: float, max_points: int) -> None:
        self.voxel_size = voxel_size
        self._max_points = max_points
        self._keys: IntArray = np.empty(0, dtype=np.int64)
        self._points: Points = np.empty((0, 3))

    @property
    def points(self) -> Points:
        """(N, 3) points kept, map, m."""
        return self._points

    def add(self, points: Points) -> Points:
        """Take in (M, 3) points; return the (K, 3) points of voxels in which there was none before.

        Points that are not finite are left out.
        """
        points = np.asarray(points, dtype=np.float64)
        points = points[np.isfinite(points).all(axis=1)]
        keys, first = np.unique(self._voxel_keys(points), return_index=True)
        places = np.searchsorted(self._keys, keys)
        is_new = np.ones(len(keys), dtype=bool)
        inside = places < len(self._keys)
        is_new[inside] = self._keys[places[inside]] != keys[inside]
        new_points = points[first[is_new]]
        self._points = np.concatenate([self._points, new_points])
        # Sorted keys are found in logarithmic time; they need not stand in the order of the points.
        self._keys = np.insert(self._keys, places[is_new], keys[is_new])
        while len(self._points) > self._max_points:
            self._coarsen()
        return new_points

    def _coarsen(self) -> None:
        while len(self._points) > self._max_points // 2:
            self.voxel_size *= 1.25
            self._keys, first = np.unique(self._voxel_keys(self._points), return_index=True)
            self._points = self._points[first]

    def _voxel_keys(self, points: Float64Array) -> IntArray:
        cells = np.floor(points / self.voxel_size).astype(np.int64) + (1 << (_BITS - 1))
        cells = np.clip(cells, 0, (1 << _BITS) - 1)
        keys: IntArray = (cells[:, 0] << (2 * _BITS)) | (cells[:, 1] << _BITS) | cells[:, 2]
        return keys
