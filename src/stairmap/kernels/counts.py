"""Turn rays, sum them over risers, and compare how well steps and a flat surface explain them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.kernels.checks import check_array, check_arrays
from stairmap.kernels.equations import RayArrays, TableArrays, nearest_entries


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
    values = (np.ones(len(s)), s, t, s * s, s * t, t * t)
    return np.array([np.bincount(index, each, n) for each in values], dtype=np.float64)


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
