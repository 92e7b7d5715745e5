"""The aggregate cloud E of the report's Algorithm 1: how it is kept small and clean."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from stairmap.arrays import Float64Array, IntArray, Points

VOXEL_SIZE = 0.01
"""Edge of the voxel grid, m (the report: 1 cm)."""

OUTLIER_NEIGHBOURS = 50
"""Neighbours of the statistical outlier removal; the report does not say, PCL's tutorials use 50."""

OUTLIER_STD_FACTOR = 1.0
"""Standard deviations beyond which a point is an outlier; the report does not say, PCL's tutorials use 1."""

CLUSTER_RADIUS = 0.02
"""Radius of Euclidean clusters, m; the report does not say, PCL's tutorials use 2 cm."""


def downsample(points: Points, size: float = VOXEL_SIZE) -> Points:
    """Return the (M, 3) centroids of the points in each voxel (line 5), sorted by voxel."""
    return _cell_centroids(points, size)[0]


def remove_statistical_outliers(points: Points) -> Points:
    """Remove points far from their neighbours (line 6).

    A point goes when the mean distance to its 50 nearest neighbours exceeds the mean of that figure over
    all points by more than one standard deviation (Rusu et al. 2008, as in PCL).
    """
    num_neighbours = min(OUTLIER_NEIGHBOURS, len(points) - 1)
    if num_neighbours < 1:
        return points
    distances, _ = cKDTree(points).query(points, k=num_neighbours + 1)
    means = np.asarray(distances, dtype=np.float64)[:, 1:].mean(axis=1)
    return np.asarray(points[means <= means.mean() + OUTLIER_STD_FACTOR * means.std()])


def find_clusters(points: Float64Array) -> IntArray:
    """Label the Euclidean clusters of points of a plane (line 11).

    Two points share a cluster when a chain of points joins them whose links are at most 2 cm. The links are
    searched between the occupied cells of a grid a quarter as wide, because thousands of points of an edge
    fall on a few square centimetres of the cross-section and have millions of pairs.

    Parameters
    ----------
    points
        (N, 2) points, in metres.

    Returns
    -------
    (N,) labels from 0.
    """
    if len(points) == 0:
        return np.empty(0, dtype=np.int64)
    centroids, cells = _cell_centroids(points, CLUSTER_RADIUS / 4)
    pairs = cKDTree(centroids).query_pairs(CLUSTER_RADIUS, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(centroids),) * 2)
    _, labels = connected_components(links, directed=False)
    return np.asarray(labels[cells], dtype=np.int64)


def _cell_centroids(points: Float64Array, size: float) -> tuple[Float64Array, IntArray]:
    """(M, C) centroids of the occupied cells of a grid through the origin, and (N,) cell of each point."""
    indices = np.floor(points / size).astype(np.int64)
    if len(points) == 0:
        return points, np.empty(0, dtype=np.int64)
    indices -= indices.min(axis=0)
    keys = np.ravel_multi_index(tuple(indices.T), tuple(indices.max(axis=0) + 1))
    _, cells, counts = np.unique(keys, return_inverse=True, return_counts=True)
    sums = [np.bincount(cells, weights=column) for column in points.T]
    return np.stack(sums, axis=1) / counts[:, None], np.asarray(cells)
