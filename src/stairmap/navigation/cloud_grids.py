"""Occupancy grids of floors cut from a map of points.

A cell is free where points lie at the floor's height, occupied where some stand on it up to the robot's
height. Where no point lies at the floor's height it is unknown: a hole, stairs that lead down, or the round
shadow under a scanner's tripod, which is floor when most of what lies around it is.
"""

from __future__ import annotations

import cv2
import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, MapError, OccupancyGrid

RESOLUTION = 0.05
"""Size of a cell, m."""

FLOOR_BAND = 0.07
"""Points this near to a floor's height are floor, m: finish, and the noise of a robot's map."""

STEP_HEIGHT, ROBOT_HEIGHT = 0.11, 1.2
"""What stands between these heights on the floor is an obstacle, m."""

MIN_OBSTACLE_POINTS = 3
"""Fewest points that make a cell occupied: single ones are people who walked by, or noise."""

CLOSING_CELLS = 5
"""Gaps between points on the floor are closed up to so many cells."""

MAX_SHADOW_AREA, MAX_SHADOW_ASPECT, MIN_SHADOW_FILL = 4.0, 1.6, 0.6
"""A tripod's shadow is no larger than this, m², no longer than so many times its width, and fills this share
of its box: a circle fills 0.79. A stairwell is longer."""

MIN_FREE_BORDER = 0.5
"""Share of what borders on a shadow that must be free floor; the rest is walls."""

MAX_CELLS = 50_000_000
"""Most cells of a floor: 350 m by 350 m."""


def grids_from_points(
    points: Points, floors: FloorStack, *, resolution: float = RESOLUTION
) -> dict[int, OccupancyGrid]:
    """Return the grid of each floor that points show, by level.

    Parameters
    ----------
    points
        (N, 3) points, map, m.
    floors
        The floors.
    resolution
        Size of a cell, m.

    Raises
    ------
    MapError
        If no point lies on any floor, or the map is too large for such cells.
    """
    grids = {}
    for floor in floors.floors:
        grid = _cut_floor(points, floor, resolution)
        if grid is not None:
            grids[floor.level] = grid
    if not grids:
        raise MapError("no point of the map lies on a floor, so there is no map to plan on")
    return grids


def _cut_floor(points: Points, floor: Floor, resolution: float) -> OccupancyGrid | None:
    height = points[:, 2] - floor.height
    near = (height > -FLOOR_BAND) & (height < ROBOT_HEIGHT)
    places, height = points[near, :2], height[near]
    is_floor = np.abs(height) < FLOOR_BAND
    if not is_floor.any():
        return None
    # The map of a floor ends where its floor does, a border aside.
    border = (CLOSING_CELLS + 1) * resolution
    low = places[is_floor].min(axis=0) - border
    shape = np.ceil((places[is_floor].max(axis=0) + border - low) / resolution).astype(np.int64)
    if int(shape[0]) * int(shape[1]) > MAX_CELLS:
        raise MapError(
            f"floor {floor.level} reaches over {shape[0] * resolution:.0f} m by "
            f"{shape[1] * resolution:.0f} m, too "
            f"much for cells of {resolution:g} m"
        )
    cell = np.floor((places - low) / resolution).astype(np.int64)
    inside = np.all((cell >= 0) & (cell < shape), axis=1)
    flat = cell[inside, 1] * shape[0] + cell[inside, 0]
    height = height[inside]
    floor_hits = _count(flat[np.abs(height) < FLOOR_BAND], shape)
    standing = _count(flat[height > STEP_HEIGHT], shape)
    is_occupied = standing >= MIN_OBSTACLE_POINTS
    is_free = _closed(floor_hits > 0) & ~is_occupied
    is_free |= _shadows(is_free, is_occupied, resolution)
    cells = np.full(is_free.shape, UNKNOWN, dtype=np.int8)
    cells[is_free] = FREE
    cells[is_occupied] = OCCUPIED
    return OccupancyGrid(cells=cells, resolution=resolution, origin=(float(low[0]), float(low[1])))


def _count(flat: IntArray, shape: IntArray) -> Float64Array:
    return np.asarray(np.bincount(flat, minlength=int(shape.prod())).reshape(int(shape[1]), int(shape[0])))


def _closed(mask: Mask) -> Mask:
    kernel = np.ones((CLOSING_CELLS, CLOSING_CELLS), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, kernel) > 0)


def _shadows(is_free: Mask, is_occupied: Mask, resolution: float) -> Mask:
    """Unknown areas like a tripod's shadow, with free floor around most of them."""
    is_unknown = ~is_free & ~is_occupied
    count, label, stats, _ = cv2.connectedComponentsWithStats(is_unknown.astype(np.uint8), connectivity=4)
    free_around, all_around = np.zeros(count), np.zeros(count)
    for axis in (0, 1):
        for shift in (1, -1):
            beside = np.roll(label, shift, axis=axis)
            is_border = (beside != label) & (beside > 0) & (label == 0)
            free_around += np.bincount(beside[is_border & is_free], minlength=count)
            all_around += np.bincount(beside[is_border], minlength=count)
    area, width, height = (
        stats[:, column].astype(np.float64)
        for column in (cv2.CC_STAT_AREA, cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT)
    )
    is_shadow = (area * resolution**2 <= MAX_SHADOW_AREA) & (area >= MIN_SHADOW_FILL * width * height)
    is_shadow &= np.maximum(width, height) <= MAX_SHADOW_ASPECT * np.minimum(width, height)
    is_shadow &= free_around >= MIN_FREE_BORDER * np.maximum(all_around, 1)
    is_shadow[0] = False
    return np.asarray(is_shadow[label])
