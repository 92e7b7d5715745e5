"""Fit a section of stairs to rays: rounds of robust Gauss-Newton over what its outline predicts."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, readonly
from stairmap.kernels.checks import check_array, check_arrays, check_length
from stairmap.kernels.equations import EquationLimits, RayArrays, RayView, sum_equations
from stairmap.kernels.outlines import SectionLimits, SectionShape, trace_outline
from stairmap.kernels.predictions import EdgeOptics, PieceKinds, predict_rays

DISTANCE, HEIGHT, RUN, RISE, OVERHANG, THICKNESS, RAKE, GROUND, SLOPE, SHIFT, TILT, ROLL, TURN = range(13)
"""Places of a section's values in the equations: those of nosing 0 and of ``SectionShape``, the shift of
edges, and the angles by which the axes are turned."""

NUM_VALUES = 13
"""Of the values that all steps share; each nosing's and each tread's own place follows."""

SectionFit: TypeAlias = tuple[bool, Float64Array, Float64Array, float, float, Float64Array]
"""Whether there is one, values, places, noise, cost and covariance: see ``fit_section``."""


class FitLimits(NamedTuple):
    """What holds the values together, and how far they may go.

    ``spacing``: of the slopes at which rays are predicted, of ``max_entries`` at most. A riser or a run is
    off the regular one by ``irregularity``, the first riser by ``floor_irregularity``, m, beyond
    ``step_tail`` of them ever less; a place by ``place_std``, beyond ``tail`` of them ever less.
    ``back_rake_std``: of a rake below 0. ``floor_before``, ``level_behind``: how much is fitted before the
    stairs and behind them, in runs; ``above_last``: above the last nosing, in rises. The fit ends where run
    or rise change by more than the factor ``max_change``, the place by more than ``max_move`` of a run, or an
    angle beyond ``max_angle``.
    """

    spacing: float
    max_entries: int
    irregularity: float
    floor_irregularity: float
    step_tail: float
    place_std: float
    tail: float
    back_rake_std: float
    floor_before: float
    level_behind: float
    above_last: float
    max_change: float
    max_move: float
    max_angle: float


def fit_section(
    rays: RayArrays,
    start: tuple[Float64Array, Float64Array],
    prior: tuple[Float64Array, Float64Array],
    rounds: tuple[Float64Array, int, float],
    is_open: bool,
    edges: EdgeOptics,
    kinds: PieceKinds,
    section: SectionLimits,
    equations: EquationLimits,
    limits: FitLimits,
) -> SectionFit:
    """Fit a section to rays.

    Parameters
    ----------
    rays
        The rays.
    start
        (13,) values to begin with, and (2 n + 1,) how far each nosing and each tread is off its regular
        place, m.
    prior
        (13,) means and standard deviations of the values before a ray is seen, infinite where nothing is
        known.
    rounds
        (K,) how wrong the section may be in each round, m; the number of rounds in which no step has its own
        place; and the noise to begin with, 1/m.
    is_open
        Whether there is nothing between the treads.
    edges, kinds, section
        See ``predict_rays`` and ``trace_outline``; the shift is that of the values.
    equations
        See ``sum_equations``; what a round allows is added to the variance of surfaces.
    limits
        What holds the values together.

    Returns
    -------
    is_found
        Whether the fit came to an end; all else is that of the last round.
    values, places
        As ``start``.
    noise, cost
        See ``sum_equations``.
    covariance
        (P, P) of the 13 values and, if the last round had them, the own places.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_arrays(rays, "rays", (np.float64,) * 3)
    if len(start) != 2:
        raise ValueError(f"start: expected two arrays, got {len(start)}")
    values = check_array(start[0], "start[0]", np.float64, 1)
    places = check_array(start[1], "start[1]", np.float64, 1)
    check_length(values, "start[0]", NUM_VALUES)
    if len(places) < 3 or len(places) % 2 != 1:
        raise ValueError(f"start[1]: expected an odd number of values above 1, got {len(places)}")
    mean, std = check_arrays(prior, "prior", (np.float64,) * 2)
    check_length(mean, "prior[0]", NUM_VALUES)
    if len(rounds) != 3:
        raise ValueError(f"rounds: expected three values, got {len(rounds)}")
    coarse = check_array(rounds[0], "rounds[0]", np.float64, 1)
    num_coarse, noise = int(rounds[1]), float(rounds[2])
    if len(coarse) == 0:
        raise ValueError("rounds[0]: expected at least one round, got none")
    limits, equations, edges = FitLimits(*limits), EquationLimits(*equations), EdgeOptics(*edges)
    section = SectionLimits(*section)
    first, cost = values, 0.0
    none = False, values, places, noise, cost, np.zeros((0, 0))
    values, places = values.copy(), places.copy()
    for number, wrong in enumerate(coarse.tolist()):
        low, high = _slope_range(values, places, section, limits)
        count = (high - low) / limits.spacing
        if not count < limits.max_entries:
            return none
        slopes: Float64Array = low + limits.spacing * np.arange(max(int(count) + 2, 1), dtype=np.float64)
        outline = trace_outline(*_section_of(values, places), is_open, section)
        predicted = predict_rays(outline, slopes, edges._replace(shift=values[SHIFT]), kinds, True)
        tilt, roll, turn = values[TILT:NUM_VALUES].tolist()
        view = RayView(tilt, roll, turn, low, high)
        allowed = equations._replace(surface_variance=equations.surface_variance + wrong**2)
        noise, num_rays, matrix, vector, cost = sum_equations(
            rays, view, (slopes, *predicted[2:7]), predicted[7], allowed
        )
        if num_rays < equations.min_rays:
            return none
        chain = _chain(len(places) // 2, is_fine=number >= num_coarse)
        matrix, vector = chain.T @ matrix @ chain, chain.T @ vector
        _add_prior(matrix, vector, (values, places), (mean, std), limits)
        try:
            change = -np.linalg.solve(matrix, vector)
        except np.linalg.LinAlgError:
            return none
        values += change[:NUM_VALUES]
        if len(change) > NUM_VALUES:
            places += change[NUM_VALUES:]
        if not _is_sane(values, first, limits):
            return none
    return True, values, places, noise, cost, np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _section_of(
    values: Float64Array, places: Float64Array
) -> tuple[Float64Array, Float64Array, SectionShape]:
    """Nosings' distances, treads' heights and what all steps share, as ``trace_outline`` takes them."""
    n = len(places) // 2
    distances = values[DISTANCE] + values[RUN] * np.arange(n) + places[:n]
    heights = values[HEIGHT] + values[RISE] * np.arange(-1, n) + places[n:]
    shape = values[[RUN, OVERHANG, THICKNESS, RAKE, GROUND, SLOPE]].tolist()
    return distances, heights, SectionShape(*shape)


def _slope_range(
    values: Float64Array, places: Float64Array, section: SectionLimits, limits: FitLimits
) -> tuple[float, float]:
    """Slopes between which rays are fitted: from a piece of floor before the stairs to the level behind."""
    distances, heights, shape = _section_of(values, places)
    run, rise, nearest = abs(shape.run), float(values[RISE]), section.min_forward
    first_s, last_s = max(float(distances[0]), nearest), max(float(distances[-1]), nearest)
    floor, top = float(heights[0]), float(heights[-1])
    if shape.run > 0:
        low = floor / max(first_s - limits.floor_before * run, nearest)
        if top < 0:
            return low, top / (last_s + limits.level_behind * run)
        return low, (top + limits.above_last * rise) / last_s
    low = top / max(last_s - limits.floor_before * run, nearest)
    return low, floor / (first_s + limits.level_behind * run)


def _add_prior(
    matrix: Float64Array,
    vector: Float64Array,
    state: tuple[Float64Array, Float64Array],
    prior: tuple[Float64Array, Float64Array],
    limits: FitLimits,
) -> None:
    """Add the prior's part to equations."""
    (values, places), (mean, std) = state, prior
    if values[RAKE] < 0:
        std = std.copy()
        std[RAKE] = limits.back_rake_std
    information = 1.0 / std**2
    size = len(matrix)
    matrix.ravel()[: NUM_VALUES * (size + 1) : size + 1] += information
    vector[:NUM_VALUES] += information * (values - mean)
    if size == NUM_VALUES:
        return
    n = len(places) // 2
    differences = _neighbours(n)
    irregularity = np.full(len(differences), limits.irregularity)
    irregularity[n - 1] = limits.floor_irregularity
    off = differences @ places / irregularity
    weight = 1.0 / ((1.0 + (off / limits.step_tail) ** 2) * irregularity**2)
    own = (differences.T * weight) @ differences
    hold = 1.0 / (limits.place_std**2 + (places / limits.tail) ** 2)
    # The floor is no step.
    hold[n] = 0.0
    own.ravel()[:: len(own) + 1] += hold
    matrix[NUM_VALUES:, NUM_VALUES:] += own
    vector[NUM_VALUES:] += own @ places


@lru_cache(maxsize=128)
def _neighbours(num_steps: int) -> Float64Array:
    """(D, 2 * num_steps + 1) differences between the own places of neighbours: of nosings, then of treads."""
    n = num_steps
    differences = np.zeros((2 * n - 1, 2 * n + 1))
    differences[: n - 1, :n] = np.diff(np.eye(n), axis=0)
    differences[n - 1 :, n:] = np.diff(np.eye(n + 1), axis=0)
    return readonly(differences)


@lru_cache(maxsize=128)
def _chain(num_steps: int, *, is_fine: bool) -> Float64Array:
    """(M + 4, P) derivatives of an outline's values, shift, tilt, roll and turn by those of the equations."""
    n = num_steps
    chain = np.zeros((2 * n + 10, NUM_VALUES + 2 * n + 1))
    nosing, level = np.arange(n), n + np.arange(n + 1)
    chain[nosing, DISTANCE] = 1.0
    chain[nosing, RUN] = np.arange(n)
    chain[level, HEIGHT] = 1.0
    chain[level, RISE] = np.arange(-1, n)
    chain[2 * n + 1 + np.arange(9), OVERHANG + np.arange(9)] = 1.0
    chain[np.arange(2 * n + 1), NUM_VALUES + np.arange(2 * n + 1)] = 1.0
    return readonly(chain if is_fine else chain[:, :NUM_VALUES])


def _is_sane(values: Float64Array, first: Float64Array, limits: FitLimits) -> bool:
    """Whether the fit has not run away from where it began."""
    least, most = 1.0 / limits.max_change, limits.max_change
    return bool(
        np.isfinite(values[DISTANCE] + values[HEIGHT] + values[SHIFT])
        and least < values[RUN] / first[RUN] < most
        and least < values[RISE] / first[RISE] < most
        and abs(values[DISTANCE] - first[DISTANCE]) < limits.max_move * abs(first[RUN])
        and np.abs(values[TILT:NUM_VALUES]).max() < limits.max_angle
    )
