"""Count what rays say for and against each step of a section: on it, nearer, farther, and what goes on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length
from stairmap.kernels.equations import RayArrays, nearest_entries
from stairmap.kernels.outlines import (
    FRONT,
    RISER,
    TREAD,
    UNDERSIDE,
    SectionLimits,
    SectionShape,
    trace_outline,
)
from stairmap.kernels.predictions import EdgeOptics, PieceKinds, predict_rays

OWN, BESIDE = 1, 2
"""Surfaces that tell a step, and those beside them; 0 is neither."""

MAX_ENTRIES = 1e6
"""Slopes at which rays are predicted at most."""


class CountLimits(NamedTuple):
    """When a ray is on a step, where stairs end aside, and when a ray tells whether a surface goes on.

    ``spacing``: of the slopes at which rays are predicted. ``noise``: of Q, 1/m. A ray is on its surface
    within ``tolerance`` along its normal, m, and ``num_sigma`` standard deviations, never more than
    ``max_tolerance_share`` of a run or rise. Of the rays on a step, ordered across, ``side_share`` lie
    outside; ``min_rays`` tell its side; ``least_expected`` is taken for farther rays, 1/m. A surface that
    goes on is told where it makes a difference of ``min_difference`` standard deviations; what is nearer than
    both by the tolerance, or by ``max_hiding_share`` of the surface's Q, hides them. It is looked for up to
    ``continued_height`` above a nosing, in rises, or in runs for a level; ``least_depth``: a level less than
    this below the camera is seen edge-on, m.
    """

    spacing: float
    noise: float
    tolerance: float
    num_sigma: float
    max_tolerance_share: float
    side_share: float
    min_rays: int
    least_expected: float
    min_difference: float
    max_hiding_share: float
    continued_height: float
    least_depth: float


def count_steps(
    rays: RayArrays,
    places: tuple[Float64Array, Float64Array],
    rise: float,
    shape: SectionShape,
    is_open: bool,
    edges: EdgeOptics,
    kinds: PieceKinds,
    section: SectionLimits,
    limits: CountLimits,
) -> tuple[IntArray, IntArray]:
    """Count the rays for and against each step of a section, between the sides of what lies on it.

    Parameters
    ----------
    rays
        All rays, turned; Q is 0 where nothing was measured.
    places
        (n,) distances of nosings and (n + 1,) heights of treads, as ``trace_outline`` takes them.
    rise
        Height of a step, m.
    shape, is_open, section
        See ``trace_outline``.
    edges, kinds
        See ``predict_rays``.
    limits
        How rays count.

    Returns
    -------
    counts
        (6, n) rays on, nearer, farther and unmeasured on what tells a step, its riser and front or, where
        stairs descend, its tread; then on and farther on the tread beside it.
    continued
        (2, 2, n) above and beneath each nosing: rays that see a surface go on where it should end, and rays
        that do not.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    slope, bearing, q = check_arrays(rays, "rays", (np.float64,) * 3)
    if len(places) != 2:
        raise ValueError(f"places: expected two arrays, got {len(places)}")
    distances = check_array(places[0], "places[0]", np.float64, 1)
    heights = check_array(places[1], "places[1]", np.float64, 1)
    if len(distances) == 0:
        raise ValueError("places[0]: expected at least one nosing, got none")
    check_length(heights, "places[1]", len(distances) + 1)
    limits, shape, section = CountLimits(*limits), SectionShape(*shape), SectionLimits(*section)
    n = len(distances)
    if len(slope) == 0:
        return np.zeros((6, n), dtype=np.int64), np.zeros((2, 2, n), dtype=np.int64)
    low = float(slope.min())
    entries = min((float(slope.max()) - low) / limits.spacing, MAX_ENTRIES)
    at: Float64Array = low + limits.spacing * np.arange(max(int(entries) + 2, 1), dtype=np.float64)
    outline = trace_outline(distances, heights, shape, is_open, section)
    surface, step, value, by_slope, sensitivity, spread, farthest, _ = predict_rays(
        outline, at, edges, kinds, False
    )
    is_tread, is_face = surface == TREAD, (surface == RISER) | (surface == FRONT)
    most = np.where(is_tread | (surface == UNDERSIDE), rise, abs(shape.run)) * limits.max_tolerance_share
    tolerance = np.minimum(
        limits.tolerance * sensitivity + limits.num_sigma * limits.noise, most * sensitivity
    )
    role = np.where(is_tread, OWN, 0)
    if shape.run > 0:
        role = np.where(is_face, OWN, np.where(is_tread, BESIDE, 0))
    entry = nearest_entries(at, slope)
    expected = value[entry] + by_slope[entry] * (slope - at[entry])
    # Where an edge's place within the row decides what a ray sees, it tells nothing of the surface.
    seen = step[entry], role[entry], (spread < tolerance)[entry]
    counts, inside = _count_on((bearing, q), expected, tolerance[entry], seen, n, limits)
    least = np.maximum(expected, farthest[entry])
    chosen = inside & (q > 0)
    surfaces = _surfaces_about(distances, heights, shape.run, rise, section.min_forward, limits)
    return counts, _count_going_on((slope[chosen], q[chosen]), least[chosen], surfaces, n, limits)


def _count_on(
    rays: tuple[Float64Array, Float64Array],
    expected: Float64Array,
    limit: Float64Array,
    seen: tuple[IntArray, IntArray, Mask],
    num_steps: int,
    limits: CountLimits,
) -> tuple[IntArray, Mask]:
    """Counts of rays, and which of them would meet the stairs between their sides."""
    (bearing, q), (steps, roles, plain) = rays, seen
    off = q - expected
    measured = q > 0
    is_on = measured & (np.abs(off) < limit)
    is_nearer, is_farther = measured & (off >= limit), measured & (off <= -limit)
    own, beside = roles == OWN, roles == BESIDE
    across = bearing / np.maximum(expected, limits.least_expected)
    right, left = _sides(across, steps, is_on & own & (steps >= 0), num_steps, limits)
    inside = (across >= right) & (across <= left)
    kept = inside & plain & (steps >= 0)

    def count(chosen: Mask) -> IntArray:
        return np.bincount(steps[chosen & kept], minlength=num_steps)

    counts = [count(own & is_on), count(own & is_nearer), count(own & is_farther), count(own & ~measured)]
    counts += [count(beside & is_on), count(beside & is_farther)]
    return np.array(counts), inside


def _sides(
    across: Float64Array, step: IntArray, on: Mask, num_steps: int, limits: CountLimits
) -> tuple[float, float]:
    """Right and left side: the medians of those of the steps; nothing lies between where none is told."""
    lefts, rights = [], []
    for index in range(num_steps):
        mine = np.sort(across[on & (step == index)])
        few = int(limits.side_share * len(mine))
        if len(mine) >= max(limits.min_rays, 1):
            rights.append(mine[few])
            lefts.append(mine[len(mine) - 1 - few])
    return (float(np.median(rights)), float(np.median(lefts))) if lefts else (np.inf, -np.inf)


class _Surfaces(NamedTuple):
    """Nosings in the order in which they are seen, their ascending slopes, and what would go on about each.

    ``upper``: (3, n) the slope up to which the surface above is looked for, a and b of its Q = a + b·tau.
    ``lower``: (2, n) the slope from which on the level beneath is, and b of its Q = b·tau.
    """

    order: IntArray
    nosing: Float64Array
    upper: Float64Array
    lower: Float64Array


def _surfaces_about(
    distances: Float64Array,
    z: Float64Array,
    run: float,
    rise: float,
    min_forward: float,
    limits: CountLimits,
) -> _Surfaces:
    """The surfaces that would go on about each nosing.

    Above the nosing the surface beneath it would go on: a wall, or a floor for stairs that descend. Beneath
    the nosing of stairs that ascend, the tread would go on towards the camera: a floor.
    """
    s = np.maximum(distances, min_forward)
    # Steps in the order in which their nosings are seen, those beside the camera left out.
    order = np.flatnonzero(distances > min_forward)[:: 1 if run > 0 else -1]
    nosing = np.maximum.accumulate(z[1:][order] / s[order])
    level = 1.0 / np.minimum(z[1:], -limits.least_depth)
    if run > 0:
        upper = np.array([(z[1:] + limits.continued_height * rise) / s, 1.0 / s, np.zeros_like(s)])
        lower = np.array([np.where(z[1:] < 0, z[:-1] / s, np.inf), level])
    else:
        upper = np.array([z[1:] / (s + limits.continued_height * abs(run)), np.zeros_like(s), level])
        lower = np.array([np.full_like(s, np.inf), level])
    return _Surfaces(order, nosing, upper, lower)


def _count_going_on(
    rays: tuple[Float64Array, Float64Array],
    stairs: Float64Array,
    surfaces: _Surfaces,
    num_steps: int,
    limits: CountLimits,
) -> IntArray:
    """(2, 2, n) rays about each nosing that see a surface go on, and those that do not.

    In the order of ``count_steps``: above the nosings, then beneath them.
    """
    (slope, q), (steps, nosing, upper, lower) = rays, surfaces
    counts = np.zeros((2, 2, num_steps), dtype=np.int64)
    if len(steps) == 0:
        return counts
    place = np.searchsorted(nosing, slope)
    last = len(steps) - 1
    above, beneath = steps[(place - 1).clip(0, last)], steps[place.clip(0, last)]
    is_above = (place > 0) & (slope < upper[0][above])
    is_beneath = (place <= last) & (slope > lower[0][beneath])
    for row, (step, inside, surface) in enumerate(
        (
            (above, is_above, upper[1][above] + upper[2][above] * slope),
            (beneath, is_beneath, lower[1][beneath] * slope),
        )
    ):
        # Only where the two can be told apart; what is nearer than both hides them.
        differ = inside & (surface - stairs > limits.min_difference * limits.noise)
        near = limits.tolerance * surface**2 + limits.num_sigma * limits.noise
        differ &= q < surface + np.minimum(near, limits.max_hiding_share * surface)
        goes_on = q > 0.5 * (surface + stairs)
        counts[row, 0] = np.bincount(step[differ & goes_on], minlength=num_steps)
        counts[row, 1] = np.bincount(step[differ & ~goes_on], minlength=num_steps)
    return counts
