"""What can be seen from where on the map of a level."""

from __future__ import annotations

import math

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.exploration.odometry import Planar
from stairmap.navigation.occupancy import OccupancyGrid


def are_in_sight(grid: OccupancyGrid, opaque: Mask, places: Float64Array, targets: Float64Array) -> Mask:
    """Tell which of (N, 2) targets nothing hides from places, one for each or one for all.

    Parameters
    ----------
    grid
        Where the cells of ``opaque`` lie.
    opaque
        (rows, columns) what hides things.
    places, targets
        (N, 2) or (2,), m, map.
    """
    places, targets = np.broadcast_arrays(np.atleast_2d(places), np.atleast_2d(targets))
    way = targets - places
    num = math.ceil(float(np.linalg.norm(way, axis=1).max(initial=0.0)) / grid.resolution) + 1
    shares = np.linspace(0.0, 1.0, num)[:, None]
    index, inside = grid.cells_at((places[:, None] + shares * way[:, None]).reshape(-1, 2))
    index = np.clip(index, 0, np.array(opaque.shape) - 1)
    hidden = opaque[index[:, 0], index[:, 1]] | ~inside
    return np.asarray(~hidden.reshape(-1, num).any(axis=1))


def are_in_view(
    grid: OccupancyGrid, opaque: Mask, pose: Planar, half_view: float, targets: Float64Array
) -> Mask:
    """Tell which of (N, 2) targets a camera sees that looks ahead and so far to both sides, rad."""
    offsets = targets - pose.place[:2]
    is_ahead = offsets @ pose.forward[:2] > math.cos(half_view) * np.linalg.norm(offsets, axis=1)
    return np.asarray(is_ahead & are_in_sight(grid, opaque, pose.place[:2], targets))
