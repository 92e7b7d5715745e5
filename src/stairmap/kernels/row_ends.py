"""Follow rows of a grid along the steps that they show, and look at what follows past their ends."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length
from stairmap.kernels.equations import TableArrays, nearest_entries

RowEnds: TypeAlias = tuple[IntArray, IntArray, Float64Array, Mask, Mask]
"""Row, entry, position, whether bounded, whether cut."""


class RowLimits(NamedTuple):
    """What decides where a row ends.

    ``tilt``, ``roll``, ``turn``: of the axes, rad. ``max_bridge``: width of gaps that are bridged, m.
    ``min_columns``: fewest on a step. ``depth_step``, ``depth_step_square``: by which something is nearer or
    farther, m, and more per square metre of distance. ``wall_near``, ``wall_far``: what is nearer is a wall
    between so far inside and outside of the end, m; ``max_wall_gap``: it comes nearer by at most this, m.
    ``max_ramp``: columns over which a sensor spreads an end; ``shift``: how many it moves it outward.
    """

    tilt: float
    roll: float
    turn: float
    max_bridge: float
    min_columns: int
    depth_step: float
    depth_step_square: float
    wall_near: float
    wall_far: float
    max_wall_gap: float
    max_ramp: int
    shift: float


def find_row_ends(
    cells: Float32Array,
    rays: tuple[Float64Array, Float64Array, Float64Array],
    table: TableArrays,
    steps: tuple[Float64Array, Mask],
    limits: RowLimits,
) -> RowEnds:
    """Find how far rows reach on the steps that they show, and whether that is a step's own end.

    Past an end, something farther, or a wall that stands there, says that it is the step's own; something
    nearer hides the rest, and the border of the grid cuts it.

    Parameters
    ----------
    cells
        (R, C) float32 inverse forward distance of a grid, 1/m; bearings fall from left to right.
    rays
        (R,) slope of its rows and (C,) bearing of its columns, and (L,) how far past an end it is looked, m.
    table
        What is predicted of rays in the turned axes.
    steps
        (G,) how far inverse distance may be off, 1/m, and whether the surface tells a step.
    limits
        What decides where a row ends.

    Returns
    -------
    row, entry
        (K,) rows that show a step over enough columns, and the table's entry in their middle.
    position
        (2, K) lateral positions of their left and right ends, m to the left.
    is_bounded, is_cut
        (2, K) whether the end is the step's own, and whether it was cut.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(cells, "cells", np.float32, 2)
    if len(rays) != 3:
        raise ValueError(f"rays: expected three arrays, got {len(rays)}")
    slope, bearing, outward = (check_array(part, f"rays[{i}]", np.float64, 1) for i, part in enumerate(rays))
    check_length(slope, "rays[0]", cells.shape[0])
    check_length(bearing, "rays[1]", cells.shape[1])
    at, value, by_slope, _, _, _ = check_arrays(table, "table", (np.float64,) * 6)
    tolerance, is_own = check_arrays(steps, "steps", (np.float64, np.bool_))
    check_length(tolerance, "steps[0]", len(at))
    if len(at) == 0:
        raise ValueError("table[0]: expected at least one ray, got none")
    limits = RowLimits(*limits)
    nothing = np.zeros(0, dtype=np.int64), np.zeros((2, 0)), np.zeros((2, 0), dtype=bool)
    if cells.size == 0 or len(outward) == 0:
        return nothing[0], nothing[0], nothing[1], nothing[2], nothing[2]
    column_slope = slope[:, None]
    ahead = 1.0 - limits.tilt * column_slope + limits.turn * bearing
    turned = (column_slope + limits.tilt + limits.roll * bearing) / ahead
    q = cells / ahead
    entry = nearest_entries(at, turned)
    expected = value[entry] + by_slope[entry] * (turned - at[entry])
    on = (q > 0) & (np.abs(q - expected) < tolerance[entry]) & is_own[entry]
    distance = 1.0 / expected
    lateral = (bearing - limits.roll * column_slope - limits.turn) / ahead * distance
    grid = _Grid(q, on, lateral, distance)
    row, first, last = _longest_runs(grid, limits)
    position, bounded, cut = [], [], []
    for inner, side in ((first, -1), (last, 1)):
        # Bearings fall from left to right, so the first column is the left end.
        is_bounded, is_free, is_cut, wall = _look_outward(grid, (row, inner, side), outward, limits)
        position.append(_end_positions(grid, (row, inner, side), (is_free, wall), limits))
        bounded.append(is_bounded)
        cut.append(is_cut)
    middle = entry[row, cells.shape[1] // 2]
    return row, middle, np.array(position), np.array(bounded), np.array(cut)


class _Grid(NamedTuple):
    """(R, C) inverse distance, whether on a step, lateral position and predicted distance."""

    q: Float64Array
    on: Mask
    lateral: Float64Array
    distance: Float64Array

    def spacing(self, row: IntArray) -> Float64Array:
        """Mean distance between columns of some rows, m."""
        return np.asarray(np.abs(self.lateral[row, 0] - self.lateral[row, -1]) / max(self.q.shape[1] - 1, 1))


def _longest_runs(grid: _Grid, limits: RowLimits) -> tuple[IntArray, IntArray, IntArray]:
    """Row, first and last column of the longest stretch on a step of each row, short gaps bridged."""
    num_rows, num_columns = grid.on.shape
    padded = np.zeros((num_rows, num_columns + 2), dtype=np.int8)
    padded[:, 1:-1] = grid.on
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[1] - 1
    if len(row) == 0:
        return row, first, last
    gap = np.abs(grid.lateral[row[1:], first[1:]] - grid.lateral[row[:-1], last[:-1]])
    starts = np.flatnonzero(np.append(True, (row[1:] != row[:-1]) | (gap > limits.max_bridge)))
    ends = np.append(starts[1:], len(row)) - 1
    row, first, last = row[starts], first[starts], last[ends]
    order = np.lexsort((last - first, row))
    is_longest = np.append(row[order][1:] != row[order][:-1], True)
    chosen = order[is_longest]
    chosen = chosen[last[chosen] - first[chosen] + 1 >= limits.min_columns]
    return row[chosen], first[chosen], last[chosen]


def _look_outward(
    grid: _Grid, end: tuple[IntArray, IntArray, int], outward: Float64Array, limits: RowLimits
) -> tuple[Mask, Mask, Mask, Float64Array]:
    """Whether each end is the step's own, is so before something farther, and was cut; lateral position of
    the wall that stands there, m, or NaN."""
    row, inner, side = end
    num_columns = grid.q.shape[1]
    distance, own = grid.distance[row, inner], grid.q[row, inner]
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.ceil(outward / grid.spacing(row)[:, None])
    steps = np.where(steps < num_columns + 1, steps, num_columns + 1)
    offset = np.maximum(steps.astype(np.int64), np.arange(1, len(outward) + 1))
    column = inner[:, None] + side * offset
    in_image = (column >= 0) & (column < num_columns)
    kept = column.clip(0, num_columns - 1)
    q = np.where(in_image, grid.q[row[:, None], kept], 0.0)
    tolerance = (limits.depth_step + limits.depth_step_square * distance**2) / distance
    is_nearer = q > (own * (1 + tolerance))[:, None]
    is_farther = (q > 0) & (q < (own * (1 - tolerance))[:, None])
    # Where the nearer thing stands: across at its own distance, not the step's.
    t = grid.lateral[row[:, None], kept] / grid.distance[row[:, None], kept] / np.where(q > 0, q, 1.0)
    past_end = -side * (t - grid.lateral[row, inner][:, None])
    is_wall = is_nearer & (past_end > limits.wall_near) & (past_end < limits.wall_far)
    never = len(outward)
    first_nearer, first_farther, first_outside = (
        np.where(seen.any(axis=1), np.argmax(seen, axis=1), never)
        for seen in (is_nearer, is_farther, ~in_image)
    )
    is_free = (first_farther < first_nearer) & (first_farther < never)
    hidden = (first_nearer < never) & ~is_free
    # A wall begins where the step ends; what stands before the stairs leaves a gap of depth.
    begins = q[np.arange(len(q)), first_nearer.clip(0, never - 1)]
    touches = distance - 1.0 / np.maximum(begins, 1e-6) < limits.max_wall_gap
    at_wall = hidden & touches & (first_farther == never)
    at_wall &= is_wall.sum(axis=1) > 0.5 * is_nearer.sum(axis=1)
    cut = ~is_free & ~hidden & (first_outside < never)
    wall = np.where(at_wall, t[np.arange(len(t)), np.argmax(is_wall, axis=1)], np.nan)
    return is_free | at_wall, is_free, (hidden & ~at_wall) | cut, wall


def _end_positions(
    grid: _Grid,
    end: tuple[IntArray, IntArray, int],
    beside: tuple[Mask, Float64Array],
    limits: RowLimits,
) -> Float64Array:
    """Lateral position of each row's end, m: where a wall stands within a column past the last one on the
    step, else half a column past it, or, where a sensor made a ramp of the end, where inverse distance is
    halfway to what follows."""
    row, inner, side = end
    is_free, wall = beside
    num_columns = grid.q.shape[1]
    column = inner[:, None] + side * np.arange(1, limits.max_ramp + 1)
    in_image = (column >= 0) & (column < num_columns)
    q = np.where(in_image, grid.q[row[:, None], column.clip(0, num_columns - 1)], 0.0)
    own = 1.0 / grid.distance[row, inner]
    beyond = np.where(q > 0, q, np.inf).min(axis=1, initial=np.inf)
    halfway = 0.5 * (own + np.where(np.isfinite(beyond), np.minimum(beyond, own), own))
    # A stringer that stands there is nearer, and no ramp.
    is_ramp = np.logical_and.accumulate((q > halfway[:, None]) & (q < own[:, None]), axis=1)
    num_more = np.where(is_free, is_ramp.sum(axis=1), 0)
    # Where the last ray met something: a wall, or a side that recedes from the end, stands at its own place.
    met = grid.lateral[row, inner] * own / grid.q[row, inner]
    more = (num_more + 0.5 - limits.shift * is_free) * grid.spacing(row)
    # What stands farther inside than the last ray on the step, a post, does not end it.
    at_wall = np.clip(-side * (wall - met), 0.0, grid.spacing(row))
    return np.asarray(met - side * np.where(np.isnan(wall), more, at_wall))
