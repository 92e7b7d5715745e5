"""Rise and edge shift solved together over several frames."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.arrays import Float64Array
from stairmap.modeling.rise_information import solve_rise_and_shift, with_rise_variance


def information_of(distances: Float64Array, *, rise: float, shift: float, std: float) -> Float64Array:
    """What heights read off edges say: height k is k·rise + shift·distance; nosing 0 is marginalised."""
    index = np.arange(len(distances), dtype=np.float64)
    design = np.stack([np.ones(len(index)), index, distances], axis=1)
    value = design @ [0.3, rise, shift]
    joint = np.column_stack([design.T @ design, design.T @ value]) / std**2
    reduced = joint[1:, 1:] - np.outer(joint[1:, 0], joint[0, 1:]) / joint[0, 0]
    return np.asarray(reduced)


def test_frames_from_several_distances_tell_a_shift_from_a_rise() -> None:
    # Along a flight distance grows with the index, which is what makes one frame ambiguous.
    frames = [
        information_of(start + np.array([0.0, 0.31, 0.55, 0.87, 1.12]), rise=0.17, shift=0.012, std=0.003)
        for start in (1.0, 2.0, 3.0)
    ]
    (rise, shift), covariance = solve_rise_and_shift(np.sum(frames, axis=0), shift_std=0.05)
    assert rise == pytest.approx(0.17, abs=0.004)
    assert shift == pytest.approx(0.012, abs=0.01)
    alone = solve_rise_and_shift(frames[0], shift_std=0.05)[1]
    assert covariance[0, 0] < alone[0, 0]


def test_without_edges_the_shift_stays_at_its_prior() -> None:
    information = np.array([[1e6, 0.0, 0.17e6], [0.0, 0.0, 0.0]])
    (rise, shift), covariance = solve_rise_and_shift(information, shift_std=3.0)
    assert (rise, shift) == pytest.approx((0.17, 0.0))
    assert np.sqrt(np.diag(covariance)) == pytest.approx([1e-3, 3.0])


def test_an_error_of_the_rise_adds_to_its_variance_and_keeps_the_estimate() -> None:
    information = np.array([[4e6, 2e3], [2e3, 50.0]])
    estimate = np.array([0.17, 0.4])
    given = np.column_stack([information, information @ estimate])
    weakened = with_rise_variance(given, 0.002**2)
    expected = np.linalg.inv(np.linalg.inv(information) + np.diag([0.002**2, 0.0]))
    assert weakened[:, :2] == pytest.approx(expected)
    assert np.linalg.solve(weakened[:, :2], weakened[:, 2]) == pytest.approx(estimate)


def test_singular_information_is_weakened_without_an_inverse() -> None:
    given = np.array([[[1e6, 0.0, 0.17e6], [0.0, 0.0, 0.0]]])
    weakened = with_rise_variance(given, np.array([0.001**2]))
    assert weakened[0, 0, 0] == pytest.approx(0.5e6)
    assert weakened[0, 0, 2] / weakened[0, 0, 0] == pytest.approx(0.17)
