"""Where the middle of a robot can be on a level, on a coarse grid that a planner searches quickly."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.exploration.body import Body
from stairmap.navigation.footprints import Rectangle
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

STRIDE = 2
"""Cells of the map per cell of the planner, along each axis."""

UNKNOWN_MARGIN = 0.20
"""The robot's middle keeps so far from ground that nobody saw, m: few of its feet could step there."""

MIN_ISLAND = 0.1
"""Smallest open ground, m², that counts where there is larger one. Beside stairs that were found when the
robot stood there, the spot where its middle was is all that is left open, and no way leads off a spot."""


def find_open_ground(
    grid: OccupancyGrid, trail: Mask, body: Body, stairs: Sequence[Rectangle] = ()
) -> OccupancyGrid:
    """Return a grid that is free where the robot's middle can be, and unknown elsewhere.

    Parameters
    ----------
    grid
        Map of a level.
    trail
        (rows, columns) where the body was already: it can go back there whatever the map says.
    body
        Its size.
    stairs
        Ground of stairs, which is entered through their ends only.
    """
    free = grid.cells == FREE
    blocked = grid.cells == OCCUPIED
    if stairs:
        on_stairs = _cover(grid, stairs)
        blocked |= on_stairs
    is_open = free & ~blocked
    is_open &= _distance(~blocked) * grid.resolution > body.radius + body.clearance
    is_open &= _distance(grid.cells != UNKNOWN) * grid.resolution > UNKNOWN_MARGIN
    # Its middle was where its body reached half its width in every direction.
    was_there = _distance(trail) * grid.resolution > body.radius - grid.resolution
    is_open |= was_there & ~on_stairs if stairs else was_there
    coarse = _without_islands(is_open[::STRIDE, ::STRIDE], MIN_ISLAND / (STRIDE * grid.resolution) ** 2)
    cells = np.where(coarse, FREE, UNKNOWN).astype(np.int8)
    shift = (STRIDE - 1) * grid.resolution / 2
    return OccupancyGrid(
        cells=cells,
        resolution=grid.resolution * STRIDE,
        origin=(grid.origin[0] - shift, grid.origin[1] - shift),
    )


def _without_islands(is_open: Mask, min_cells: float) -> Mask:
    """Leave out parts of fewer cells than these, unless there is no larger one."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(is_open.astype(np.uint8), connectivity=8)
    is_large = stats[:, cv2.CC_STAT_AREA] >= min_cells
    is_large[0] = False  # what is not open
    return np.asarray(is_large[labels]) if is_large.any() else is_open


def _cover(grid: OccupancyGrid, rectangles: Sequence[Rectangle]) -> Mask:
    """Return which cells lie in one of the rectangles."""
    image = np.zeros(grid.cells.shape, dtype=np.uint8)
    for rectangle in rectangles:
        corners = (rectangle.corners() - grid.origin) / grid.resolution - 0.5
        cv2.fillConvexPoly(image, np.round(corners * 16).astype(np.int32), 1, shift=4)
    return np.asarray(image > 0)


def _distance(mask: Mask) -> Float64Array:
    """Distance of each marked cell from the nearest that is not, cells."""
    if mask.all():
        return np.full(mask.shape, np.inf)
    return np.asarray(
        cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE), dtype=np.float64
    )
