"""Measure how far each step reaches to either side, and whether its own end was seen there.

Rows of an elevation run along the steps. So each row that shows a step is followed from end to end of the
rays that lie on it, and a step's end is the median of its rows. What follows past the end tells whether it is
the step's own: something farther, or a wall that stands there, and not something nearer that hides the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation, sample_grid
from stairmap.detection.evidence import tolerances
from stairmap.detection.fit import FittedProfile
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.profile import Prediction, Surface

MAX_BRIDGE = 0.20
"""Gaps in a step up to this width, m, are bridged: balusters, a foot, a bag."""

LOOK_OUTWARD = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.10, 0.125, 0.15])
"""How far past an end it is looked, m: stringers and rails are thinner than the last."""

WALL_NEAR, WALL_FAR = -0.05, 0.10
"""What is nearer than the step, between so far inside and outside of its end, m, is a wall there."""

MAX_WALL_GAP = 0.30
"""A wall that stands at a step's end comes nearer from there by no more than this at once, m."""

DEPTH_STEP, DEPTH_STEP_SQUARE = 0.06, 0.01
"""Past an end something is nearer or farther by at least this much, m, and so much more per square metre of
distance, with which the noise of triangulating sensors grows."""

RAMP_REACH = 2.5
"""From a step's last column to the middle of the ramp that a smoothing sensor makes of its end, at most, in
standard deviations of the smoothing: beyond, what falls away is a side that recedes."""

MIN_COLUMNS = 3
"""Fewest columns of a row on a step."""

MAX_ROWS = 12
"""Most rows of a step that are followed."""

MIN_ROWS = 2
"""Fewest rows that tell a step's end."""

MIN_BOUNDED_ROWS = 2
"""Fewest rows that show an end to be the step's own."""

BOUNDED_FACTOR = 2.0
"""An end is the step's own where this many times more rows say so than deny it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepExtents:
    """Lateral extents of each step, m to the left of the camera's sagittal plane; all (num_steps,).

    Attributes
    ----------
    left, right
        Ends of the step; NaN where it was not seen.
    left_bounded, right_bounded
        Whether the step's own end was seen there, not the image's border or an occlusion.
    """

    left: Float64Array
    right: Float64Array
    left_bounded: Mask
    right_bounded: Mask


def measure_extents(
    image: InverseDepthImage,
    elevation: Elevation,
    fitted: FittedProfile,
    predicted: Prediction,
    columns: tuple[int, int],
) -> StepExtents:
    """Measure how far each step of a fitted profile reaches to either side.

    Parameters
    ----------
    image
        Inverse depth of the frame.
    elevation
        Its elevation.
    fitted, predicted
        The profile of the steps that were seen, and what it says of the elevation's rays.
    columns
        First column of the grid that is looked at, and one past the last.
    """
    n = fitted.profile.num_steps
    grid = elevation.grid
    bearing = grid.bearing[columns[0] : columns[1]]
    rows = _rows_of_steps(grid.slope, fitted, predicted)
    if len(rows) == 0 or len(bearing) < MIN_COLUMNS:
        nothing = np.full(n, np.nan)
        return StepExtents(left=nothing, right=nothing, left_bounded=nothing > 0, right_bounded=nothing > 0)
    cells = sample_grid(image, grid, grid.slope[rows], bearing).astype(np.float64)
    slope = grid.slope[rows, None]
    ahead = 1.0 - fitted.tilt * slope + fitted.turn * bearing
    turned = (slope + fitted.tilt + fitted.roll * bearing) / ahead
    cells /= ahead
    across = (bearing - fitted.roll * slope - fitted.turn) / ahead
    entry = predicted.entries(turned)
    expected = predicted.expected(turned, entry)
    tolerance = tolerances(predicted, fitted.profile, 2.0 * fitted.noise)
    own = _is_own(predicted.surface, fitted)
    step = predicted.step[entry]
    on = (cells > 0) & (np.abs(cells - expected) < tolerance[entry]) & own[entry]
    middle = cells.shape[1] // 2
    row_step = step[:, middle]
    # A step's distance is that of the row, so that columns are metres.
    distance = 1.0 / expected
    lateral = across * distance
    optics = fitted.optics
    followed = _Rows(
        cells=cells, on=on, lateral=lateral, distance=distance, step=row_step, shift=optics.shift,
        max_ramp=int(np.ceil(RAMP_REACH * optics.smoothing)),
    )  # fmt: skip
    return _extents(followed, n)


def _rows_of_steps(slope: Float64Array, fitted: FittedProfile, predicted: Prediction) -> IntArray:
    """Rows that show a surface which tells a step."""
    n = fitted.profile.num_steps
    is_plain = predicted.edge_spread < 2.0 * fitted.noise + 0.02 * predicted.inverse_distance
    useful = is_plain & _is_own(predicted.surface, fitted) & (predicted.step >= 0) & (predicted.step < n)
    entry = predicted.entries(slope)
    rows = np.flatnonzero(useful[entry])
    # More rows of a step would tell the same ends again.
    step = predicted.step[entry[rows]]
    count = np.bincount(step, minlength=n)
    place = np.arange(len(rows)) - np.searchsorted(step, step) if fitted.profile.run > 0 else None
    if place is None:
        place = np.arange(len(rows)) - np.searchsorted(-step, -step)
    spacing = np.maximum(-(-count[step] // MAX_ROWS), 1)
    return np.asarray(rows[place % spacing == spacing // 2])


def _is_own(surface: IntArray, fitted: FittedProfile) -> Mask:
    is_face = (surface == Surface.RISER) | (surface == Surface.FRONT)
    is_tread = surface == Surface.TREAD
    return np.asarray(is_face | is_tread if fitted.profile.run > 0 else is_tread)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rows:
    """Rows of a grid that show steps; arrays are (R, C), ``step`` is (R,).

    ``shift`` is how many columns the sensor moves the ends of near surfaces outward, ``max_ramp`` over how
    many it may spread them.
    """

    cells: Float64Array
    on: Mask
    lateral: Float64Array
    distance: Float64Array
    step: IntArray
    shift: float
    max_ramp: int


def _extents(rows: _Rows, n: int) -> StepExtents:
    row, first, last = _longest_runs(rows)
    step = rows.step[row]
    ends, bounded = [], []
    for inner, side in ((first, -1), (last, 1)):
        # Bearings fall from left to right, so the first column is the left end.
        at_end = _look_outward(rows, row, inner, side)
        position = _end_positions(rows, row, inner, side, at_end.is_free)
        tells = at_end.is_bounded
        values, is_bounded = np.full(n, np.nan), np.zeros(n, dtype=bool)
        for k in np.unique(step):
            mine = step == k
            num_bounded, num_not = np.count_nonzero(mine & tells), np.count_nonzero(mine & at_end.is_cut)
            is_bounded[k] = num_bounded >= MIN_BOUNDED_ROWS and num_bounded > BOUNDED_FACTOR * num_not
            chosen = mine & tells if is_bounded[k] else mine
            if np.count_nonzero(mine) >= MIN_ROWS:
                values[k] = np.median(position[chosen])
        ends.append(values)
        bounded.append(is_bounded)
    return StepExtents(left=ends[0], right=ends[1], left_bounded=bounded[0], right_bounded=bounded[1])


def _longest_runs(rows: _Rows) -> tuple[IntArray, IntArray, IntArray]:
    """Row, first and last column of the longest stretch on a step of each row, short gaps bridged."""
    num_rows, num_columns = rows.on.shape
    padded = np.zeros((num_rows, num_columns + 2), dtype=np.int8)
    padded[:, 1:-1] = rows.on
    change = np.diff(padded, axis=1)
    row, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[1] - 1
    if len(row) == 0:
        return row, first, last
    gap = np.abs(rows.lateral[row[1:], first[1:]] - rows.lateral[row[:-1], last[:-1]])
    starts = np.flatnonzero(np.append(True, (row[1:] != row[:-1]) | (gap > MAX_BRIDGE)))
    ends = np.append(starts[1:], len(row)) - 1
    row, first, last = row[starts], first[starts], last[ends]
    order = np.lexsort((last - first, row))
    is_longest = np.append(row[order][1:] != row[order][:-1], True)
    chosen = order[is_longest]
    chosen = chosen[last[chosen] - first[chosen] + 1 >= MIN_COLUMNS]
    return row[chosen], first[chosen], last[chosen]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Beyond:
    """What follows past the ends of some rows, (N,) each: the step's own end, before something farther; or
    what cut it."""

    is_bounded: Mask
    is_free: Mask
    is_cut: Mask


def _look_outward(rows: _Rows, row: IntArray, inner: IntArray, side: int) -> _Beyond:
    """Look past the end of each row, to the right for side +1, to the left for -1."""
    num_columns = rows.cells.shape[1]
    distance, own = rows.distance[row, inner], rows.cells[row, inner]
    spacing = np.abs(rows.lateral[row, 0] - rows.lateral[row, -1]) / max(num_columns - 1, 1)
    offset = np.ceil(LOOK_OUTWARD / spacing[:, None]).astype(np.int64)
    offset = np.maximum(offset, np.arange(1, len(LOOK_OUTWARD) + 1))
    column = inner[:, None] + side * offset
    in_image = (column >= 0) & (column < num_columns)
    kept = column.clip(0, num_columns - 1)
    q = rows.cells[row[:, None], kept] * in_image
    tolerance = (DEPTH_STEP + DEPTH_STEP_SQUARE * distance**2) / distance
    is_nearer = q > (own * (1 + tolerance))[:, None]
    is_farther = (q > 0) & (q < (own * (1 - tolerance))[:, None])
    # Where the nearer thing stands: across at its own distance, not the step's.
    t = rows.lateral[row[:, None], kept] / rows.distance[row[:, None], kept] / np.where(q > 0, q, 1.0)
    past_end = -side * (t - rows.lateral[row, inner][:, None])
    is_wall = is_nearer & (past_end > WALL_NEAR) & (past_end < WALL_FAR)
    never = len(LOOK_OUTWARD)
    first_nearer, first_farther, first_outside = (
        np.where(seen.any(axis=1), np.argmax(seen, axis=1), never)
        for seen in (is_nearer, is_farther, ~in_image)
    )
    is_free = (first_farther < first_nearer) & (first_farther < never)
    hidden = (first_nearer < never) & ~is_free
    # A wall begins where the step ends; what stands before the stairs leaves a gap of depth.
    begins = q[np.arange(len(q)), first_nearer.clip(0, never - 1)]
    touches = distance - 1.0 / np.maximum(begins, 1e-6) < MAX_WALL_GAP
    at_wall = hidden & touches & (first_farther == never)
    at_wall &= is_wall.sum(axis=1) > 0.5 * is_nearer.sum(axis=1)
    cut = ~is_free & ~hidden & (first_outside < never)
    return _Beyond(is_bounded=is_free | at_wall, is_free=is_free, is_cut=(hidden & ~at_wall) | cut)


def _end_positions(rows: _Rows, row: IntArray, inner: IntArray, side: int, is_free: Mask) -> Float64Array:
    """Lateral position of each row's end, m: half a column past the last one on the step, or, where a sensor
    made a ramp of the end, where inverse distance is halfway to what follows."""
    num_columns = rows.cells.shape[1]
    column = inner[:, None] + side * np.arange(1, rows.max_ramp + 1)
    in_image = (column >= 0) & (column < num_columns)
    q = rows.cells[row[:, None], column.clip(0, num_columns - 1)] * in_image
    own = 1.0 / rows.distance[row, inner]
    beyond = np.where(q > 0, q, np.inf).min(axis=1)
    halfway = 0.5 * (own + np.where(np.isfinite(beyond), np.minimum(beyond, own), own))
    # A stringer that stands there is nearer, and no ramp.
    is_ramp = np.logical_and.accumulate((q > halfway[:, None]) & (q < own[:, None]), axis=1)
    num_more = np.where(is_free, is_ramp.sum(axis=1), 0)
    spacing = np.abs(rows.lateral[row, 0] - rows.lateral[row, -1]) / max(num_columns - 1, 1)
    # Where the last ray met something: a wall, or a side that recedes from the end, stands at its own place.
    met = rows.lateral[row, inner] * own / rows.cells[row, inner]
    return np.asarray(met - side * (num_more + 0.5 - rows.shift * is_free) * spacing)
