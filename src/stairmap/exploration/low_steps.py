"""Places of a level's map that look like the first steps of stairs that go up.

A robot that passes stairs sees their lowest treads from aside or from afar, and no detector finds stairs
there. They are worth a look from the front.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float64Array, IntArray
from stairmap.navigation.occupancy import FREE, OccupancyGrid

MIN_TOP, MAX_TOP = 0.11, 0.27
"""Height of a first tread above the floor, m."""

MIN_RISE, MAX_RISE = 0.07, 0.28
"""Height of the second above the first, m."""

MIN_LENGTH, MAX_DEPTH = 0.5, 0.6
"""A tread is at least so long, and at most so deep, m."""

MAX_APART = 0.45
"""The second tread lies at most so far behind the first, m."""

MIN_SHARE = 0.3
"""Area of the second tread near the first, at least, in areas of the first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LowSteps:
    """(2,) middle of the lower tread, m, map, the heading up, rad, and how many treads were seen: 1 or 2."""

    place: Float64Array
    heading: float
    num_seen: int


def find_low_steps(grid: OccupancyGrid, tops: NDArray[np.float32]) -> list[LowSteps]:
    """Return the places of a map, with the (rows, columns) height of what stands on each cell, m."""
    is_low = ((tops >= MIN_TOP) & (tops <= MAX_TOP)).astype(np.uint8)
    first = cv2.morphologyEx(is_low, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    num, labels, stats, centroids = cv2.connectedComponentsWithStats(first, connectivity=8)
    reach = round(MAX_APART / grid.resolution)
    found = []
    for label in range(1, num):
        left, top, width, height, area = (int(value) for value in stats[label])
        if max(width, height) * grid.resolution < MIN_LENGTH:
            continue
        window = np.s_[
            max(top - reach, 0) : top + height + reach, max(left - reach, 0) : left + width + reach
        ]
        own = labels[window] == label
        rows, columns = np.nonzero(own)
        (_, size, _) = cv2.minAreaRect(np.column_stack([columns, rows]).astype(np.float32))
        if max(size) * grid.resolution < MIN_LENGTH or (min(size) + 1) * grid.resolution > MAX_DEPTH:
            continue
        level = float(np.median(tops[window][own & (tops[window] > 0)]))
        near = cv2.dilate(own.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) > 0
        second = near & (tops[window] > level + MIN_RISE) & (tops[window] < level + MAX_RISE) & ~own
        middle = np.array([columns.mean(), rows.mean()])
        across = _short_axis(rows, columns)
        has_second = np.count_nonzero(second) >= MIN_SHARE * area
        # Up is square to the step, towards the next one or away from the ground before it.
        side = np.argwhere(second if has_second else near & (grid.cells[window] == FREE))[:, ::-1] - middle
        if not len(side):
            continue
        towards = float((side @ across).mean()) * (1 if has_second else -1)
        direction = across if towards > 0 else -across
        place = grid.centers(*(np.array([round(value)]) for value in centroids[label][::-1]))[0]
        heading = float(np.arctan2(direction[1], direction[0]))
        found.append(LowSteps(place=place, heading=heading, num_seen=1 + int(has_second)))
    return found


def _short_axis(rows: IntArray, columns: IntArray) -> Float64Array:
    """Return the (2,) x and y of the direction in which cells extend least."""
    centered = np.column_stack([columns - columns.mean(), rows - rows.mean()])
    return np.asarray(np.linalg.eigh(centered.T @ centered)[1][:, 0], dtype=np.float64)
