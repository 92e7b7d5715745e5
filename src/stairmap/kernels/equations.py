"""Compare rays with a tabulated prediction, and sum the normal equations of what they say together."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.kernels.checks import check_array, check_arrays, check_length

RayArrays: TypeAlias = tuple[Float64Array, Float64Array, Float64Array]
"""(N,) slope, bearing and inverse forward distance, 1/m, of each ray."""

TableArrays: TypeAlias = tuple[
    Float64Array, Float64Array, Float64Array, Float64Array, Float64Array, Float64Array
]
"""(G,) evenly spaced slopes, and of each Q, its derivative by the slope, sensitivity, edge spread and
farthest Q, as ``predict_rays`` returns them."""


class RayView(NamedTuple):
    """Small angles by which the rays' axes are turned, rad, and the range of slopes that is compared.

    The new up is up + tilt·forward + roll·left, the new forward is forward - tilt·up + turn·left.
    """

    tilt: float
    roll: float
    turn: float
    low: float
    high: float


class EquationLimits(NamedTuple):
    """What decides how rays count.

    ``told_noise``: standard deviation of Q where too few rays tell it, 1/m; ``least_noise``, ``most_noise``
    bound what they tell. Rays tell it where an edge's spread is below it, or below ``plain_share`` of the
    ``band``, and that are off by less than the band or ``band_sigma`` times the noise; the band is a distance
    along the surface's normal, m. ``min_rays`` do; ``sigma_of_median`` makes a standard deviation of their
    median. ``surface_variance``: how far surfaces may be off, m². ``tail``: beyond so many standard
    deviations rays pull ever less. ``rays_per_sample``: so many count as one. ``cost_std``: error that is
    taken for all rays when they are compared with those of another fit, m.
    """

    told_noise: float
    least_noise: float
    most_noise: float
    band: float
    plain_share: float
    band_sigma: float
    min_rays: float
    sigma_of_median: float
    surface_variance: float
    tail: float
    rays_per_sample: float
    cost_std: float


def sum_equations(
    rays: RayArrays, view: RayView, table: TableArrays, gradients: Float64Array, limits: EquationLimits
) -> tuple[float, float, Float64Array, Float64Array, float]:
    """Sum the normal equations of a round of robust Gauss-Newton over rays.

    Parameters
    ----------
    rays
        The rays.
    view
        How they are turned, and which of them are compared.
    table
        What is predicted, over the whole range.
    gradients
        (G, M + 1) derivatives of Q by the profile's M own values and by the shift of edges.
    limits
        What decides how rays count.

    Returns
    -------
    noise
        Standard deviation of Q about the prediction, 1/m.
    weight
        Sum of the rays' robust weights, each 1 at most.
    matrix, vector
        (M + 4, M + 4) and (M + 4,) normal matrix and gradient by the own values, the shift of edges, tilt,
        roll and turn.
    cost
        Robust squares of the residuals with one error for all.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    real = np.float64
    ray_slope, ray_bearing, ray_q = check_arrays(rays, "rays", (real,) * 3)
    slope, value, by_slope, sensitivity, spread, farthest = check_arrays(table, "table", (real,) * 6)
    check_array(gradients, "gradients", real, 2)
    if len(slope) == 0:
        raise ValueError("table[0]: expected at least one ray, got none")
    check_length(gradients, "gradients", len(slope))
    if gradients.shape[1] == 0:
        raise ValueError("gradients: expected at least one column, got none")
    view, limits = RayView(*view), EquationLimits(*limits)
    ahead = 1.0 - view.tilt * ray_slope + view.turn * ray_bearing
    tau = (ray_slope + view.tilt + view.roll * ray_bearing) / ahead
    chosen = np.flatnonzero((tau > view.low) & (tau < view.high))
    tau, ahead = tau[chosen], ahead[chosen]
    bearing = (ray_bearing[chosen] - view.roll * ray_slope[chosen] - view.turn) / ahead
    entry = nearest_entries(slope, tau)
    expected = value[entry] + by_slope[entry] * (tau - slope[entry])
    residual = np.maximum(ray_q[chosen] / ahead, farthest[entry]) - expected
    noise = _noise_seen(residual, entry, sensitivity, spread, limits)
    variance = (noise**2 + limits.surface_variance * sensitivity**2 + spread**2)[entry]
    # Rays beyond the tail pull ever less: what hides the stairs, or stands beside them, is no error.
    weight = 1.0 / (1.0 + residual**2 / variance / limits.tail**2) ** 2
    total = float(weight.sum())
    ratio = residual / (limits.cost_std * sensitivity[entry])
    cost = float(np.sum(ratio**2 / (1.0 + ratio**2 / limits.tail**2)))
    weight /= variance * limits.rays_per_sample
    count = len(slope)

    def summed(values: Float64Array) -> Float64Array:
        return np.asarray(np.bincount(entry, values, count), dtype=np.float64)

    # Rays of one entry share its derivatives: only the powers of their bearings differ.
    plain, across, squared = summed(weight), summed(weight * bearing), summed(weight * bearing**2)
    pull, pull_across = summed(weight * residual), summed(weight * residual * bearing)
    used = np.flatnonzero(plain)
    at, q, by = slope[used], value[used], by_slope[used]
    level = np.concatenate([-gradients[used], (q * at - by * (1 + at**2))[:, None]], axis=1)
    lateral = np.stack([-by, by * at - q], axis=1)
    mixed = (level * across[used, None]).T @ lateral
    matrix = np.block(
        [
            [(level * plain[used, None]).T @ level, mixed],
            [mixed.T, (lateral * squared[used, None]).T @ lateral],
        ]
    )
    vector = np.concatenate([level.T @ pull[used], lateral.T @ pull_across[used]])
    return noise, total, matrix, vector, cost


def nearest_entries(table_slopes: Float64Array, slopes: Float64Array) -> np.ndarray:
    """Return the (N,) index of the evenly spaced slope that is nearest to each of some slopes."""
    if len(table_slopes) < 2:
        return np.zeros(slopes.shape, dtype=np.int64)
    place = np.rint((slopes - table_slopes[0]) / (table_slopes[1] - table_slopes[0]))
    return np.asarray(np.clip(place, 0, len(table_slopes) - 1), dtype=np.int64)


def _noise_seen(
    residual: Float64Array,
    entry: np.ndarray,
    sensitivity: Float64Array,
    spread: Float64Array,
    limits: EquationLimits,
) -> float:
    """Standard deviation of the rays about the prediction away from its edges, 1/m."""
    told, near = limits.told_noise, limits.band * sensitivity
    is_plain = (spread < np.maximum(told, limits.plain_share * near))[entry]
    is_plain &= np.abs(residual) < np.maximum(limits.band_sigma * told, near)[entry]
    if np.count_nonzero(is_plain) < limits.min_rays:
        return told
    seen = limits.sigma_of_median * float(np.median(np.abs(residual[is_plain])))
    return float(np.clip(seen, limits.least_noise, limits.most_noise))
