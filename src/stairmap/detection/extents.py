"""Measure how far each step reaches to either side, and whether its own end was seen there.

Rows of an elevation run along the steps. So each row that shows a step is followed from end to end of the
rays that lie on it, and a step's end is the median of its rows. What follows past the end tells whether it is
the step's own: something farther, or a wall that stands there, and not something nearer that hides the rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import median

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation, sample_grid
from stairmap.detection.evidence import tolerances
from stairmap.detection.fit import FittedProfile
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.profile import Prediction
from stairmap.kernels import find_row_ends, outlines
from stairmap.kernels.row_ends import RowLimits

MAX_BRIDGE = 0.20
"""Gaps in a step up to this width, m, are bridged: balusters, a foot, a bag."""

LOOK_OUTWARD = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.10, 0.125, 0.15])
"""How far past an end it is looked, m: stringers and rails are thinner than the last."""

WALL_NEAR, WALL_FAR = -0.05, 0.10
"""What is nearer than the step, between so far inside and outside of its end, m, is a wall there."""

MAX_WALL_GAP = 0.30
"""A wall that stands at a step's end comes nearer from there by no more than this at once, m."""

DEPTH_STEP, DEPTH_STEP_SQUARE = 0.06, 0.01
"""Past an end something is nearer or farther by at least this much, m, and this much more per square metre of
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
        unknown, nowhere = np.full(n, np.nan), np.zeros(n, dtype=bool)
        return StepExtents(left=unknown, right=unknown, left_bounded=nowhere, right_bounded=nowhere)
    slope = grid.slope[rows]
    tolerance = tolerances(predicted, fitted.profile, 2.0 * fitted.noise)
    optics = fitted.optics
    limits = RowLimits(
        tilt=fitted.tilt,
        roll=fitted.roll,
        turn=fitted.turn,
        max_bridge=MAX_BRIDGE,
        min_columns=MIN_COLUMNS,
        depth_step=DEPTH_STEP,
        depth_step_square=DEPTH_STEP_SQUARE,
        wall_near=WALL_NEAR,
        wall_far=WALL_FAR,
        max_wall_gap=MAX_WALL_GAP,
        max_ramp=int(np.ceil(RAMP_REACH * optics.smoothing)),
        shift=optics.shift,
    )
    _, entry, position, is_bounded, is_cut = find_row_ends(
        sample_grid(image, grid, slope, bearing),
        (slope, bearing, LOOK_OUTWARD),
        predicted.table,
        (tolerance, _is_own(predicted.surface, fitted)),
        limits,
    )
    step = predicted.step[entry].tolist()
    left, left_bounded = _step_ends(step, position[0].tolist(), is_bounded[0].tolist(), is_cut[0].tolist(), n)
    right, right_bounded = _step_ends(
        step, position[1].tolist(), is_bounded[1].tolist(), is_cut[1].tolist(), n
    )
    return StepExtents(
        left=np.array(left),
        right=np.array(right),
        left_bounded=np.array(left_bounded),
        right_bounded=np.array(right_bounded),
    )


def _step_ends(
    step: list[int], position: list[float], is_bounded: list[bool], is_cut: list[bool], n: int
) -> tuple[list[float], list[bool]]:
    """One end of each step: the median of its rows', of those that show its own end if enough do."""
    ends, bounded = [], []
    rows_of_step: list[list[int]] = [[] for _ in range(n)]
    for row, index in enumerate(step):
        # In the middle of a row that is turned the floor before the first step may be seen.
        if index >= 0:
            rows_of_step[index].append(row)
    for rows in rows_of_step:
        own = [position[row] for row in rows if is_bounded[row]]
        num_cut = sum(is_cut[row] for row in rows)
        is_own = len(own) >= MIN_BOUNDED_ROWS and len(own) > BOUNDED_FACTOR * num_cut
        bounded.append(is_own)
        ends.append(
            median(own if is_own else [position[row] for row in rows]) if len(rows) >= MIN_ROWS else math.nan
        )
    return ends, bounded


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
    ascending = step if fitted.profile.run > 0 else -step
    place = np.arange(len(rows)) - np.searchsorted(ascending, ascending)
    spacing = np.maximum(-(-count[step] // MAX_ROWS), 1)
    return np.asarray(rows[place % spacing == spacing // 2])


def _is_own(surface: IntArray, fitted: FittedProfile) -> Mask:
    # Whole numbers: comparing with members of an enumeration takes numpy twenty times as long.
    is_tread = surface == outlines.TREAD
    if fitted.profile.run < 0:
        return np.asarray(is_tread)
    return np.asarray(is_tread | (surface == outlines.RISER) | (surface == outlines.FRONT))
