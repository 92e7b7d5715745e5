"""Borders of unknown ground with what it costs to see across them and what that may show."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Vector, readonly
from stairmap.exploration.open_ground import STRIDE
from stairmap.exploration.sight import are_in_sight
from stairmap.navigation.exploration import MIN_FRONTIER
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

REACH = 0.9
"""A frontier is seen across from open ground at most so far from it, m."""

VIEW = 2.0
"""A look across a frontier shows unknown ground about so deep, m."""

UNREACHABLE = 1e9
"""Cost where there is no way, s."""

MAX_LENGTH = 3.0
"""Longer frontiers are cut: their ends are different places, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frontier:
    """A border of unknown ground.

    Attributes
    ----------
    position
        (2,) where the robot goes, m, map.
    target
        (2,) cell of the frontier that it looks at, m.
    cells
        (N, 2) centres of the frontier's cells, m.
    cost
        What it costs to get there, s.
    gain
        Unknown ground that may be seen, m².
    size
        Length of the border, m.
    """

    position: Vector
    target: Vector
    cells: Float64Array
    cost: float
    gain: float
    size: float

    def __post_init__(self) -> None:
        for name in ("position", "target", "cells"):
            object.__setattr__(self, name, readonly(getattr(self, name)))


def frontier_mask(grid: OccupancyGrid, settled: Mask) -> Mask:
    """Return the free cells beside unknown ones, but for those that were looked at in vain."""
    unknown = (grid.cells == UNKNOWN).astype(np.uint8)
    near = cv2.dilate(unknown, np.ones((3, 3), dtype=np.uint8)) > 0
    return np.asarray((grid.cells == FREE) & near & ~settled)


def find_frontiers_with_gain(
    grid: OccupancyGrid, settled: Mask, open_ground: OccupancyGrid, costs: Float64Array
) -> list[Frontier]:
    """Return the frontiers that can be seen across from open ground.

    Parameters
    ----------
    grid
        Map of a level.
    settled
        (rows, columns) where looking again gives nothing.
    open_ground
        Where the robot's middle can be.
    costs
        Cost to each of its cells, s; infinite where it cannot get.
    """
    mask = frontier_mask(grid, settled)
    num_labels, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    reach = round(REACH / open_ground.resolution)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    finite = np.where(np.isfinite(costs), costs, UNREACHABLE)
    nearest = np.asarray(
        cv2.erode(finite, disc, borderType=cv2.BORDER_CONSTANT, borderValue=(UNREACHABLE,)), dtype=np.float64
    )
    unknown = (grid.cells == UNKNOWN).astype(np.float32)
    window = round(2 * VIEW / grid.resolution) | 1
    around = np.asarray(
        cv2.boxFilter(unknown, -1, (window, window), normalize=False, borderType=cv2.BORDER_CONSTANT),
        dtype=np.float64,
    )
    rows, columns = np.nonzero(labels)
    order = np.argsort(labels[rows, columns], kind="stable")
    rows, columns = rows[order], columns[order]
    groups = np.searchsorted(labels[rows, columns], np.arange(1, num_labels + 1))
    found = []
    for begin, end in pairwise(groups):
        cells = np.column_stack([rows[begin:end], columns[begin:end]])
        for part in _cut(cells, grid.resolution):
            frontier = _frontier(part, grid, open_ground, finite, nearest, around)
            if frontier is not None:
                found.append(frontier)
    return found


def _frontier(
    cells: IntArray,
    grid: OccupancyGrid,
    open_ground: OccupancyGrid,
    costs: Float64Array,
    nearest: Float64Array,
    around: Float64Array,
) -> Frontier | None:
    size = len(cells) * grid.resolution
    if size < MIN_FRONTIER:
        return None
    coarse = cells // STRIDE
    cost_of_cells = nearest[coarse[:, 0], coarse[:, 1]]
    best = int(np.argmin(cost_of_cells))
    if cost_of_cells[best] >= UNREACHABLE:
        return None
    middle = int(np.argmin(np.linalg.norm(cells - cells.mean(axis=0), axis=1)))
    centers = grid.centers(cells[:, 0], cells[:, 1])
    for index in dict.fromkeys((middle, best, 0, len(cells) - 1)):
        place = _cheapest_in_sight(centers[index], coarse[index], grid, open_ground, costs)
        if place is not None:
            position, cost = place
            gain = float(np.median(around[cells[:, 0], cells[:, 1]])) * grid.resolution**2
            return Frontier(
                position=position,
                target=centers[index],
                cells=centers,
                cost=cost,
                gain=min(gain / 2, size * VIEW),
                size=size,
            )
    return None


def _cheapest_in_sight(
    target: Float64Array,
    cell: IntArray,
    grid: OccupancyGrid,
    open_ground: OccupancyGrid,
    costs: Float64Array,
) -> tuple[Float64Array, float] | None:
    """Return the open place, and the cost to it, from which nothing hides a (2,) target within reach."""
    reach = round(REACH / open_ground.resolution)
    low = np.maximum(cell - reach, 0)
    window = costs[low[0] : cell[0] + reach + 1, low[1] : cell[1] + reach + 1]
    rows, columns = np.nonzero(window < UNREACHABLE)
    if not len(rows):
        return None
    order = np.argsort(window[rows, columns], kind="stable")
    rows, columns = rows[order] + low[0], columns[order] + low[1]
    places = open_ground.centers(rows, columns)
    kept = np.linalg.norm(places - target, axis=1) <= REACH
    visible = np.flatnonzero(are_in_sight(grid, grid.cells == OCCUPIED, places[kept], target))
    if not len(visible):
        return None
    first = np.flatnonzero(kept)[visible[0]]
    return places[first], float(costs[rows[first], columns[first]])


def _cut(cells: IntArray, resolution: float) -> list[IntArray]:
    """Cut a long frontier along its longer side."""
    extent = np.ptp(cells, axis=0) * resolution
    num = math.ceil(float(extent.max()) / MAX_LENGTH)
    if num <= 1:
        return [cells]
    axis = int(np.argmax(extent))
    low = cells[:, axis].min()
    index = ((cells[:, axis] - low) * num // (np.ptp(cells[:, axis]) + 1)).astype(int)
    return [part for part in (cells[index == k] for k in range(num)) if len(part)]
