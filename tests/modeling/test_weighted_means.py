"""Means of observations that err together, and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.arrays import Float64Array
from stairmap.detection.fit import EDGE_SHIFT_STD
from stairmap.modeling.weighted_means import (
    DRIFT_ALONG,
    FRAMES_PER_SAMPLE,
    POSE_STD,
    SYSTEMATIC_RISE_STD,
    SYSTEMATIC_STD,
    fit_rise,
    mean_std,
    place_std,
    robust_mean,
)


def test_a_mean_is_weighted_by_variance() -> None:
    mean, _ = robust_mean(np.array([0.17, 0.171]), np.array([0.001, 0.002]) ** 2)
    weights = 1.0 / (np.array([0.001, 0.002]) ** 2 + SYSTEMATIC_STD**2)
    assert mean == pytest.approx(np.average([0.17, 0.171], weights=weights), abs=1e-9)


def test_an_outlier_pulls_a_mean_no_harder_than_a_value_two_deviations_off() -> None:
    values, variances = np.full(12, 0.17), np.full(12, 0.002**2)
    means = []
    for outlier in (0.20, 0.30):
        values[0] = outlier
        means.append(robust_mean(values, variances)[0])
    assert means[0] == pytest.approx(means[1], abs=1e-4)
    assert 0.17 < means[0] < 0.1705


def test_a_value_within_two_deviations_pulls_in_full() -> None:
    values, variances = np.full(12, 0.17), np.full(12, 0.002**2)
    values[0] = 0.1735
    assert robust_mean(values, variances)[0] == pytest.approx(values.mean(), abs=1e-9)


def test_six_neighbouring_frames_count_as_one() -> None:
    for num in (1, 3, 6):
        assert mean_std(np.zeros(num), np.full(num, 0.01**2)) == pytest.approx(0.01)
    assert mean_std(np.zeros(24), np.full(24, 0.01**2)) == pytest.approx(0.01 / 2)
    assert FRAMES_PER_SAMPLE == 6.0


def test_the_spread_that_is_seen_counts_where_it_is_larger_than_the_stated_one() -> None:
    values = np.tile([-0.05, 0.05], 12)
    assert mean_std(values, np.full(24, 0.01**2)) == pytest.approx(0.05 / 2)
    assert mean_std(0.1 * values, np.full(24, 0.01**2)) == pytest.approx(0.01 / 2)


def test_no_mean_is_surer_than_what_sensors_err_in_common() -> None:
    _, std = robust_mean(np.full(10_000, 0.17), np.full(10_000, 0.002**2))
    assert SYSTEMATIC_STD < std < 1.05 * SYSTEMATIC_STD


def test_drift_does_not_average_out_of_a_place() -> None:
    drifting = np.linspace(0.0, 1.0, 600)
    variances = np.full(600, 0.01**2 + POSE_STD**2)
    std = place_std(drifting, variances)
    spread = np.sqrt(drifting.var() - 0.01**2)
    assert std == pytest.approx(np.hypot(mean_std(drifting, variances), DRIFT_ALONG * spread), rel=1e-6)
    assert std > 0.11
    steady = place_std(np.zeros(600), variances)
    assert steady == pytest.approx(mean_std(np.zeros(600), variances))


def information(rise: float, std: float, *, per_shift: float = 0.0, shift: float = 0.0) -> Float64Array:
    """One frame that saw ``rise + per_shift * shift`` with a deviation: rise and edge shift together."""
    row = np.array([1.0, per_shift])
    matrix = np.outer(row, row) / std**2
    return np.column_stack([matrix, row * (rise + per_shift * shift) / std**2])


def test_rise_is_the_weighted_mean_of_frames_that_know_nothing_of_a_shift() -> None:
    frames = np.array([information(0.170, 0.001), information(0.171, 0.002)])
    rise, _ = fit_rise(frames)
    weights = 1.0 / (np.array([0.001, 0.002]) ** 2 + SYSTEMATIC_RISE_STD**2)
    assert rise == pytest.approx(np.average([0.170, 0.171], weights=weights), abs=1e-6)


def test_frames_from_different_distances_tell_rise_from_the_shift_of_edges() -> None:
    per_shift = np.linspace(0.001, 0.006, 60)
    frames = np.array([information(0.17, 0.001, per_shift=value, shift=2.0) for value in per_shift])
    rise, std = fit_rise(frames)
    assert rise == pytest.approx(0.17, abs=0.0006)
    seen = frames[:, 0, 2] / frames[:, 0, 0]
    assert seen.mean() - 0.17 > 0.005
    assert abs(rise - 0.17) < 2 * std
    # All frames agree once the shift is known, so none is held back and the rise is sure.
    assert std < 0.0016


def test_a_shift_that_frames_cannot_tell_makes_the_rise_less_sure() -> None:
    sure = fit_rise(np.array([information(0.17, 0.001)] * 12))[1]
    alike = fit_rise(np.array([information(0.17, 0.001, per_shift=0.003)] * 12))[1]
    assert alike > 3 * sure
    assert alike == pytest.approx(0.003 * EDGE_SHIFT_STD, rel=0.1)


def test_one_wrong_frame_moves_the_rise_little() -> None:
    frames = [information(0.17, 0.002)] * 11
    for wrong in (0.20, 0.30):
        assert fit_rise(np.array([*frames, information(wrong, 0.002)]))[0] == pytest.approx(0.17, abs=5e-4)


def test_rise_is_surer_with_more_frames_down_to_what_they_err_in_common() -> None:
    stds = [fit_rise(np.array([information(0.17, 0.004)] * num))[1] for num in (6, 24, 6000)]
    assert stds[0] > 1.8 * stds[1] > stds[2]
    assert SYSTEMATIC_RISE_STD <= stds[2] < 1.1 * SYSTEMATIC_RISE_STD
