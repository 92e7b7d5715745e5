"""Find the edges between tops: where a level ends above a lower one that is as far below as a step's rise.

An edge knows which way is up the stairs: from the lower top to the higher one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.clouds.tops import Columns, Tops

LEVEL_TOLERANCE = 0.04
"""Tops of neighbouring columns within this height of each other are of one level, m: half of a low rise."""

REACH = 0.16
"""A lower level begins within this distance of an edge, m: a column's width, the blur of a doubled riser, and
the nosing's shadow on the tread below it."""

MIN_RISER = 0.06
"""A run at least this tall may be a riser seen without the treads about it, m."""

MAX_TOPS = 12
"""Most tops of one column that are looked at, one above the other: storeys."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeCells:
    """Tops at an edge.

    Attributes
    ----------
    place
        (N, 2) x and y, m.
    height
        (N,) z, m.
    direction
        (N,) heading up the stairs, rad; NaN for a riser of which no lower top was seen.
    """

    place: Float64Array
    height: Float64Array
    direction: Float64Array

    def __len__(self) -> int:
        return len(self.height)


def find_edge_cells(columns: Columns, tops: Tops, *, min_rise: float, max_rise: float) -> EdgeCells:
    """Find the tops that have a lower one beside them, lower by a rise.

    Parameters
    ----------
    columns, tops
        The cloud.
    min_rise, max_rise
        Least and most that the other is lower, m.
    """
    first, last = _column_bounds(columns, tops)
    is_border = _count_same_level(columns, tops, first, last) < 4
    border = np.flatnonzero(is_border)
    pull = np.zeros((len(border), 2))
    for dx, dy in _offsets(columns.cell):
        distance = np.hypot(dx, dy)
        for row, other in _neighbours(columns, tops, border, (dx, dy), first, last):
            drop = tops.height[border[row]] - tops.height[other]
            is_step = (drop > min_rise) & (drop < max_rise)
            # Each lower neighbour pulls away from itself; nearer ones more.
            np.add.at(pull, row[is_step], -np.array([dx, dy], dtype=np.float64) / distance**2)
    has_lower = np.hypot(pull[:, 0], pull[:, 1]) > 1e-9
    direction = np.where(has_lower, np.arctan2(pull[:, 1], pull[:, 0]), np.nan)
    is_riser = tops.thickness[border] > MIN_RISER
    keep = has_lower | (is_riser & (tops.thickness[border] < max_rise + LEVEL_TOLERANCE))
    chosen = border[keep]
    return EdgeCells(place=tops.place[chosen], height=tops.height[chosen], direction=direction[keep])


def _offsets(cell: float) -> list[tuple[int, int]]:
    reach = max(int(np.ceil(REACH / cell - 1e-9)), 1)
    steps = range(-reach, reach + 1)
    return [(dx, dy) for dx in steps for dy in steps if 0 < np.hypot(dx, dy) * cell <= max(REACH, 1.5 * cell)]


def _column_bounds(columns: Columns, tops: Tops) -> tuple[IntArray, IntArray]:
    """The distinct columns, and where the tops of each begin, with the end of the last."""
    begin = (
        np.flatnonzero(np.concatenate([[True], tops.key[1:] != tops.key[:-1]]))
        if len(tops)
        else np.zeros(0, np.int64)
    )
    return tops.key[begin], np.append(begin, len(tops))


def _neighbours(
    columns: Columns,
    tops: Tops,
    chosen: IntArray,
    offset: tuple[int, int],
    column: IntArray,
    begin: IntArray,
) -> list[tuple[IntArray, IntArray]]:
    """Pairs (place in ``chosen``, top) of tops in the column at an offset, by their number in it."""
    if not len(column):
        return []
    y = tops.key[chosen] % columns.num_y + offset[1]
    wanted = tops.key[chosen] + offset[0] * columns.num_y + offset[1]
    place = np.minimum(np.searchsorted(column, wanted), len(column) - 1)
    rows = np.flatnonzero((column[place] == wanted) & (y >= 0) & (y < columns.num_y))
    start, count = begin[place[rows]], begin[place[rows] + 1] - begin[place[rows]]
    pairs = []
    for number in range(min(int(count.max(initial=0)), MAX_TOPS)):
        has = count > number
        pairs.append((rows[has], start[has] + number))
    return pairs


def _count_same_level(columns: Columns, tops: Tops, column: IntArray, begin: IntArray) -> IntArray:
    """(M,) how many of the four columns about each top hold a top of the same level."""
    everything = np.arange(len(tops))
    count = np.zeros(len(tops), dtype=np.int64)
    for offset in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        for row, other in _neighbours(columns, tops, everything, offset, column, begin):
            count[row] += np.abs(tops.height[row] - tops.height[other]) < LEVEL_TOLERANCE
    return count


def is_finite_direction(cells: EdgeCells) -> Mask:
    """(N,) which edges know which way is up."""
    return np.asarray(np.isfinite(cells.direction))
