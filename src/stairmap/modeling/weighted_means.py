"""Means over the observations of a flight, and standard deviations that know that neighbours err together."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.detection.fit import EDGE_SHIFT_STD
from stairmap.modeling.rise_information import solve_rise_and_shift, with_rise_variance

POSE_STD = 0.01
"""Standard deviation of a pose's position against its neighbours, m: keeps one frame from ruling."""

DRIFT_ALONG = 0.5
"""How much of the spread that drift gave the places of a flight is the standard deviation of its place along
the heading: near frames, which weigh most, were taken within a shorter time than all."""

FRAMES_PER_SAMPLE = 6.0
"""Neighbouring frames see the same steps from nearly the same place: this many count as one."""

SYSTEMATIC_RISE_STD, SYSTEMATIC_STD = 0.0009, 0.0003
"""What no number of observations averages out of the rise, and of run and overhang, m: the rise feels how a
sensor shows edges, by up to 1.2 mm on average of one sensor's drives, the others do not."""


def weighted_mean(values: Float64Array, weights: Float64Array) -> float:
    """Mean of (N,) values by (N,) weights; ``numpy.average`` takes several times as long."""
    return float(values @ weights / weights.sum())


def robust_mean(values: Float64Array, variances: Float64Array) -> tuple[float, float]:
    """Mean weighted by variance, outliers beyond two sigma held back (Huber), and its std."""
    total = variances + SYSTEMATIC_STD**2
    mean = weighted_mean(values, 1.0 / total)
    for _ in range(3):
        deviation = np.abs(values - mean) / np.sqrt(total)
        weights = np.minimum(1.0, 2.0 / np.maximum(deviation, 1e-9)) / total
        mean = weighted_mean(values, weights)
    return mean, float(np.hypot(mean_std(values, total), SYSTEMATIC_STD))


def fit_rise(information: Float64Array) -> tuple[float, float]:
    """Rise by (N, 2, 3) information of observations on it and on the sensor's shift of edges; its std.

    Outliers beyond two sigma are held back (Huber), as they stand given the shift.
    """
    each = with_rise_variance(information, SYSTEMATIC_RISE_STD**2)
    own = np.maximum(each[:, 0, 0], 1e-9)
    weights = np.ones(len(each))
    for _ in range(4):
        total = np.einsum("n,nij->ij", weights / FRAMES_PER_SAMPLE, each)
        (rise, shift), covariance = solve_rise_and_shift(total, shift_std=EDGE_SHIFT_STD)
        deviation = (each[:, 0, 2] - each[:, 0, 1] * shift) / own - rise
        weights = np.minimum(1.0, 2.0 / np.maximum(np.abs(deviation) * np.sqrt(own), 1e-9))
    spread = mean_std(deviation, 1.0 / own)
    # What not knowing the shift adds to the variance.
    growth = float(total[0, 0] * covariance[0, 0])
    return float(rise), float(np.hypot(spread * np.sqrt(growth), SYSTEMATIC_RISE_STD))


def mean_std(values: Float64Array, variances: Float64Array) -> float:
    """Standard deviation of a weighted mean of correlated values, from their stated or seen spread."""
    weights = 1.0 / variances
    mean = weighted_mean(values, weights)
    samples = max(len(values) / FRAMES_PER_SAMPLE, 1.0)
    stated = len(values) / float(weights.sum())
    seen = weighted_mean((values - mean) ** 2, weights)
    return float(np.sqrt(max(stated, seen) / samples))


def place_std(values: Float64Array, variances: Float64Array) -> float:
    """Standard deviation of a place in a map that drifted while it was measured.

    Drift does not average out: which moment's place is asked for remains open by all of its spread.
    """
    weights = 1.0 / variances
    mean = weighted_mean(values, weights)
    spread = weighted_mean((values - mean) ** 2, weights)
    noise = len(values) / float(weights.sum()) - POSE_STD**2
    return float(np.hypot(mean_std(values, variances), DRIFT_ALONG * np.sqrt(max(spread - noise, 0.0))))
