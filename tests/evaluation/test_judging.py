"""Found, missed, false, duplicate, optional; and drift is not the method's error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from true_drives import make_drifts, make_flight, make_stairways, make_true_flight, make_truth

from stairmap.evaluation.drift import find_drift_spread, move_flight
from stairmap.evaluation.judging import judge_stairways
from stairmap.evaluation.metrics import CALIBRATED
from stairmap.transforms import transform_points

FLIGHT = make_flight()
OTHER = make_flight(base=np.array([-4.0, 2.0, 0.0]), heading=-2.0)


def test_a_perfect_estimate_is_found_without_error() -> None:
    judgement = judge_stairways(make_stairways([FLIGHT]), make_truth(make_true_flight(FLIGHT)), [[0]] * 10)
    (result,) = judgement.flights
    assert result.is_found and not result.is_missed
    assert result.errors is not None
    np.testing.assert_allclose([result.errors.errors[name] for name in CALIBRATED], 0, atol=1e-9)
    assert judgement.false_flights == ()


def test_a_missed_flight_counts_as_missed_only_when_it_had_to_be_found() -> None:
    truth = make_truth(make_true_flight(FLIGHT), make_true_flight(OTHER, stairway_id=2, must_be_found=False))
    judgement = judge_stairways((), truth, [[]] * 10)
    assert [result.is_missed for result in judgement.flights] == [True, False]


def test_duplicates_and_strays_are_false() -> None:
    truth = make_truth(make_true_flight(FLIGHT))
    judgement = judge_stairways(make_stairways([FLIGHT, FLIGHT, OTHER]), truth, [[0]] * 10)
    assert [entry["reason"] for entry in judgement.false_flights] == ["duplicate", "not there"]


def test_a_perfect_estimate_on_drifting_odometry_has_no_error() -> None:
    drifts = make_drifts(10)
    # Observed in frames 4 to 6 only: the drift of the others does not matter.
    seen = move_flight(FLIGHT, drifts[4:7])
    observed: list[list[int | None]] = [[0] if 4 <= frame < 7 else [] for frame in range(10)]
    truth = make_truth(make_true_flight(FLIGHT), drifts=drifts)
    (result,) = judge_stairways(make_stairways([seen]), truth, observed).flights
    assert result.num_observed_frames == 3
    assert result.errors is not None
    np.testing.assert_allclose([result.errors.errors[name] for name in CALIBRATED], 0, atol=1e-9)
    assert result.drift_spread == pytest.approx(find_drift_spread(FLIGHT, drifts[4:7]))
    (unmoved,) = judge_stairways(make_stairways([FLIGHT]), truth, observed).flights
    assert unmoved.errors is not None
    assert abs(unmoved.errors.errors["heading"]) == pytest.approx(np.radians(5) * 5 / 9, rel=1e-3)


def test_a_single_drift_moves_a_flight_as_the_transform_does() -> None:
    drift = make_drifts(5)[-1]
    moved = move_flight(FLIGHT, drift[None])
    np.testing.assert_allclose(moved.base, transform_points(drift, FLIGHT.base), atol=1e-12)
    np.testing.assert_allclose(moved.edges(), transform_points(drift, FLIGHT.edges()), atol=1e-12)
    np.testing.assert_allclose(
        [step.nosing for step in moved.steps], transform_points(drift, FLIGHT.edges()), atol=1e-12
    )


def test_optional_flights_are_neither_blamed_nor_credited() -> None:
    optional = make_true_flight(FLIGHT, is_optional=True, must_be_found=False)
    found = judge_stairways(make_stairways([FLIGHT]), make_truth(optional), [[0]] * 10)
    assert found.false_flights == ()
    missed = judge_stairways((), make_truth(optional), [[]] * 10)
    assert not missed.flights[0].is_missed


def test_a_stairway_of_two_flights_finds_both() -> None:
    stairway = replace(make_stairways([FLIGHT])[0], flights=(FLIGHT, OTHER))
    truth = make_truth(make_true_flight(FLIGHT), make_true_flight(OTHER, flight_index=1))
    judgement = judge_stairways([stairway], truth, [[0]] * 10)
    assert all(result.is_found for result in judgement.flights)
