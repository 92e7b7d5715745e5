"""Turn rays, and count what they say for and against each step of a prediction, or for a flat surface."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length
from stairmap.kernels.equations import RayArrays, TableArrays, nearest_entries

RayCounts: TypeAlias = tuple[IntArray, Mask, Float64Array]
"""Counts, whether inside, and least Q of each ray."""

OWN, BESIDE = 1, 2
"""Surfaces that tell a step, and those beside them; 0 is neither."""


class SideLimits(NamedTuple):
    """Where stairs end aside.

    ``share``: of the rays on a step, ordered across, that lie outside. ``min_rays`` tell a step's side.
    ``least_expected``: inverse distance that is taken for farther rays, 1/m.
    """

    share: float
    min_rays: int
    least_expected: float


class ContinuationLimits(NamedTuple):
    """When a ray tells whether a surface goes on.

    ``noise``: of Q, 1/m. ``min_difference``: in standard deviations, between the surface and the stairs.
    ``tolerance``, ``num_sigma``: what is nearer than both by so much along the surface's normal, m, and so
    many standard deviations, or by ``max_share`` of the surface's Q, hides them.
    """

    noise: float
    min_difference: float
    tolerance: float
    num_sigma: float
    max_share: float


class LineLimits(NamedTuple):
    """How a straight line is fitted.

    ``low``, ``high``: slopes between which, and ``right``, ``left``: lateral positions, m. ``noise``: of Q,
    1/m. ``surface_std``: along a surface's normal, m. ``tail``: in standard deviations. ``num_rounds``,
    ``min_rays``; ``least_expected``: inverse distance that is taken for farther rays, 1/m.
    """

    low: float
    high: float
    right: float
    left: float
    noise: float
    surface_std: float
    tail: float
    num_rounds: int
    min_rays: int
    least_expected: float


class RiserLimits(NamedTuple):
    """Which rays are on the middle of a riser.

    ``floor``, ``rise``: height of the level before the first step and of each riser, m; rays within
    ``height_share`` of its middle count. ``overhang``: of nosings before it; ``band``: how far before or
    behind a ray ends at most, m. ``right``, ``left``: lateral positions between which it does, m.
    """

    floor: float
    rise: float
    height_share: float
    overhang: float
    band: float
    right: float
    left: float


def turn_rays(rays: RayArrays, tilt: float, roll: float, turn: float) -> RayArrays:
    """Return rays in axes turned by small angles, rad, as in ``equations.RayView``."""
    slope, bearing, q = check_arrays(rays, "rays", (np.float64,) * 3)
    ahead = 1.0 - tilt * slope + turn * bearing
    return (slope + tilt + roll * bearing) / ahead, (bearing - roll * slope - turn) / ahead, q / ahead


def sum_risers(rays: RayArrays, nosings: Float64Array, limits: RiserLimits) -> Float64Array:
    """Sum the places where rays end on each riser, seen from above.

    Parameters
    ----------
    rays
        The rays.
    nosings
        (n,) forward distance of each nosing, m.
    limits
        Which rays count.

    Returns
    -------
    (6, n) number of rays, and the sums of s, t, s·s, s·t and t·t: forward distance and lateral position, m.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    slope, bearing, q = check_arrays(rays, "rays", (np.float64,) * 3)
    check_array(nosings, "nosings", np.float64, 1)
    limits, n = RiserLimits(*limits), len(nosings)
    measured = q > 0
    inverse = np.where(measured, q, 1.0)
    s, z, t = 1.0 / inverse, slope / inverse, bearing / inverse
    phase = (z - limits.floor) / limits.rise
    place = np.floor(phase)
    inside = measured & (place >= 0) & (place < n) & (np.abs(phase - place - 0.5) < limits.height_share)
    inside &= ~((t < limits.right) | (t > limits.left))
    index, s, t = place[inside].astype(np.int64), s[inside], t[inside]
    near = np.abs(s - nosings[index] - limits.overhang) < limits.band
    index, s, t = index[near], s[near], t[near]
    return np.array([np.bincount(index, values, n) for values in (np.ones(len(s)), s, t, s * s, s * t, t * t)])


def count_rays(
    rays: RayArrays,
    table: TableArrays,
    entries: tuple[Float64Array, IntArray, IntArray, Mask],
    num_steps: int,
    limits: SideLimits,
) -> RayCounts:
    """Count the rays for and against each step, between the sides of what lies on it.

    Parameters
    ----------
    rays
        All rays, turned; Q is 0 where nothing was measured.
    table
        What is predicted.
    entries
        (G,) each: how far Q may be off, 1/m; step, negative for none; ``OWN``, ``BESIDE`` or 0; and whether
        no edge is near.
    num_steps
        Number of steps.
    limits
        Where stairs end aside.

    Returns
    -------
    counts
        (6, num_steps) rays on, nearer, farther and unmeasured on own surfaces, on and farther on those
        beside.
    inside
        (N,) whether each ray would meet the stairs between their sides.
    least
        (N,) predicted Q of each, 1/m, or that from which on anything farther agrees.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    slope, bearing, q = check_arrays(rays, "rays", (np.float64,) * 3)
    at, value, by_slope, _, _, farthest = check_arrays(table, "table", (np.float64,) * 6)
    tolerance, step, role, is_plain = check_arrays(
        entries, "entries", (np.float64, np.int64, np.int64, np.bool_)
    )
    check_length(tolerance, "entries[0]", len(at))
    if len(at) == 0:
        raise ValueError("table[0]: expected at least one ray, got none")
    _check_steps(step, num_steps)
    limits = SideLimits(*limits)
    entry = nearest_entries(at, slope)
    expected = value[entry] + by_slope[entry] * (slope - at[entry])
    limit, steps, roles, plain = tolerance[entry], step[entry], role[entry], is_plain[entry]
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
    return np.array(counts), inside, np.maximum(expected, farthest[entry])


def _sides(
    across: Float64Array, step: IntArray, on: Mask, num_steps: int, limits: SideLimits
) -> tuple[float, float]:
    """Right and left side: the medians of those of the steps; nothing lies between where none is told."""
    lefts, rights = [], []
    for index in range(num_steps):
        mine = np.sort(across[on & (step == index)])
        few = int(limits.share * len(mine))
        if len(mine) >= limits.min_rays:
            rights.append(mine[few])
            lefts.append(mine[len(mine) - 1 - few])
    return (float(np.median(rights)), float(np.median(lefts))) if lefts else (np.inf, -np.inf)


def count_continuations(
    rays: RayArrays,
    seen: tuple[Float64Array, Mask],
    order: tuple[IntArray, Float64Array],
    surfaces: tuple[Float64Array, Float64Array],
    limits: ContinuationLimits,
) -> IntArray:
    """Count the rays about each nosing that see a surface go on where it should end, and those that do not.

    Parameters
    ----------
    rays
        All rays, turned.
    seen
        (N,) Q of the stairs that each would see at least, 1/m, and whether it counts.
    order
        (K,) steps in the order in which their nosings are seen from below, and the ascending slopes of these.
    surfaces
        (3, n) for the surface above each nosing: the slope up to which it is looked for, a and b of its
        Q = a + b·tau; (2, n) for the level beneath it: the slope from which on, and b of its Q = b·tau;
        infinite where it is not looked for.
    limits
        When a ray tells something.

    Returns
    -------
    (2, 2, n) above and beneath: rays that see the surface go on, and rays that do not.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    slope, _, q = check_arrays(rays, "rays", (np.float64,) * 3)
    least, usable = check_arrays(seen, "seen", (np.float64, np.bool_))
    check_length(least, "seen[0]", len(slope))
    steps, nosing = check_arrays(order, "order", (np.int64, np.float64))
    if len(surfaces) != 2:
        raise ValueError(f"surfaces: expected two arrays, got {len(surfaces)}")
    upper = check_array(surfaces[0], "surfaces[0]", np.float64, 2)
    lower = check_array(surfaces[1], "surfaces[1]", np.float64, 2)
    num_steps = upper.shape[1]
    check_length(upper, "surfaces[0]", 3)
    check_length(lower, "surfaces[1]", 2)
    check_length(lower, "surfaces[1]", num_steps, 1)
    if len(steps) and (steps.min() < 0 or steps.max() >= num_steps):
        raise ValueError(f"order[0]: expected steps below {num_steps}, got others")
    limits = ContinuationLimits(*limits)
    counts = np.zeros((2, 2, num_steps), dtype=np.int64)
    if len(steps) == 0:
        return counts
    chosen = usable & (q > 0)
    slope, q, stairs = slope[chosen], q[chosen], least[chosen]
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
        differ &= q < surface + np.minimum(near, limits.max_share * surface)
        goes_on = q > 0.5 * (surface + stairs)
        counts[row, 0] = np.bincount(step[differ & goes_on], minlength=num_steps)
        counts[row, 1] = np.bincount(step[differ & ~goes_on], minlength=num_steps)
    return counts


def compare_with_line(rays: RayArrays, table: TableArrays, limits: LineLimits) -> tuple[int, float, float]:
    """Compare how well a prediction explains rays with how well a straight line over slope does.

    The line is fitted to the same rays, robustly and with the same noise.

    Parameters
    ----------
    rays
        All rays, turned.
    table
        What is predicted.
    limits
        Which rays, and how.

    Returns
    -------
    How many rays were compared, the robust cost of the prediction, and that of the line.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    slope, bearing, q = check_arrays(rays, "rays", (np.float64,) * 3)
    at, value, by_slope, sensitivity, _, farthest = check_arrays(table, "table", (np.float64,) * 6)
    if len(at) == 0:
        raise ValueError("table[0]: expected at least one ray, got none")
    limits = LineLimits(*limits)
    chosen = np.flatnonzero((slope > limits.low) & (slope < limits.high) & (q > 0))
    entry = nearest_entries(at, slope[chosen])
    expected = value[entry] + by_slope[entry] * (slope[chosen] - at[entry])
    across = bearing[chosen] / np.maximum(expected, limits.least_expected)
    inside = (across > limits.right) & (across < limits.left)
    chosen, entry, expected = chosen[inside], entry[inside], expected[inside]
    if len(chosen) < limits.min_rays:
        return len(chosen), 0.0, 0.0
    tau, q = slope[chosen], q[chosen]
    variance = limits.noise**2 + (limits.surface_std * sensitivity[entry]) ** 2
    # What lies behind an edge may be as far as it likes.
    by_steps = (np.maximum(q, farthest[entry]) - expected) ** 2
    weight = 1.0 / variance
    middle = tau - tau.mean()
    by_flat = np.zeros_like(q)
    for _ in range(limits.num_rounds):
        total = weight.sum()
        mean, center = (weight * q).sum() / total, (weight * middle).sum() / total
        spread = max((weight * (middle - center) ** 2).sum(), 1e-12)
        steepness = (weight * (middle - center) * (q - mean)).sum() / spread
        by_flat = (q - mean - steepness * (middle - center)) ** 2
        weight = 1.0 / (variance * (1.0 + by_flat / variance / limits.tail**2) ** 2)

    def cost(squares: Float64Array) -> float:
        ratio = squares / variance
        return float(np.sum(ratio / (1.0 + ratio / limits.tail**2)))

    return len(chosen), cost(by_steps), cost(by_flat)


def _check_steps(step: IntArray, num_steps: int) -> None:
    if num_steps < 1:
        raise ValueError(f"num_steps: expected at least 1, got {num_steps}")
    if len(step) and step.max() >= num_steps:
        raise ValueError(f"entries[1]: expected steps below {num_steps}, got others")
