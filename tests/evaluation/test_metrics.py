"""A perfect estimate scores zero; a shifted one scores its shift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from true_drives import make_flight, make_true_flight

from stairmap.evaluation.metrics import MEASURES, find_errors
from stairmap.stairway import Flight, FlightStd, Step
from value_strategies import flights, no_deadline

FLIGHT = make_flight()
TRUE = make_true_flight(FLIGHT)
NO_DRIFT = np.eye(4)[None]


@no_deadline
@given(flights())
def test_a_perfect_estimate_has_no_error(flight: Flight) -> None:
    flight = replace(flight, steps=tuple(Step(nosing=edge, num_observations=1) for edge in flight.edges()))
    result = find_errors(flight, make_true_flight(flight), NO_DRIFT)
    errors = np.array([result.errors[name] for name in MEASURES])
    np.testing.assert_allclose(errors[~np.isnan(errors)], 0, atol=1e-9)
    assert result.lowest_step == 0
    assert result.num_steps_right and result.num_risers_right


def test_a_shifted_estimate_scores_its_shift_in_the_axes_of_the_flight() -> None:
    shift = np.array([0.03, -0.02, 0.011])
    estimate = replace(
        FLIGHT,
        base=FLIGHT.base + FLIGHT.map_from_flight[:3, :3] @ shift,
        rise=FLIGHT.rise + 0.004,
        run=FLIGHT.run - 0.006,
        width=FLIGHT.width - 0.1,
        heading=FLIGHT.heading + 0.02 + 2 * np.pi,
    )
    errors = find_errors(estimate, TRUE, NO_DRIFT).errors
    assert errors["along"] == pytest.approx(0.03)
    assert errors["across"] == pytest.approx(-0.02)
    assert errors["up"] == pytest.approx(0.011)
    assert errors["rise"] == pytest.approx(0.004)
    assert errors["run"] == pytest.approx(-0.006)
    assert errors["width"] == pytest.approx(-0.1)
    assert errors["heading"] == pytest.approx(0.02)
    assert errors["pitch"] == pytest.approx(np.arctan2(0.174, 0.274) - np.arctan2(0.17, 0.28))


def test_an_unbounded_width_is_not_judged_and_neither_is_the_middle() -> None:
    errors = find_errors(replace(FLIGHT, left_bounded=False, width=0.5), TRUE, NO_DRIFT).errors
    assert np.isnan(errors["width"]) and np.isnan(errors["across"])
    assert errors["along"] == pytest.approx(0, abs=1e-9)


def test_a_base_one_step_too_high_is_wrong_when_the_first_step_was_in_view() -> None:
    step = np.array([FLIGHT.run, 0.0, FLIGHT.rise])
    estimate = replace(FLIGHT, base=FLIGHT.base + FLIGHT.map_from_flight[:3, :3] @ step, num_risers=9)
    result = find_errors(estimate, TRUE, NO_DRIFT)
    assert result.lowest_step == 1
    assert result.errors["along"] == pytest.approx(FLIGHT.run)
    assert not result.num_steps_right
    assert result.num_risers_right is False


def test_a_base_on_the_lowest_step_in_view_is_right_when_those_below_were_not() -> None:
    step = 4 * np.array([FLIGHT.run, 0.0, FLIGHT.rise])
    estimate = replace(FLIGHT, base=FLIGHT.base + FLIGHT.map_from_flight[:3, :3] @ step, num_risers=6)
    seen = np.arange(10) >= 4
    result = find_errors(estimate, make_true_flight(FLIGHT, surely_seen=seen, possibly_seen=seen), NO_DRIFT)
    assert result.lowest_step == 4
    np.testing.assert_allclose([result.errors[name] for name in ("along", "across", "up")], 0, atol=1e-9)
    assert result.num_steps_right
    assert result.num_risers_right is None


@pytest.mark.parametrize(("num_risers", "right"), [(5, False), (6, True), (8, True), (9, True), (10, False)])
def test_steps_are_right_between_surely_and_possibly_seen(num_risers: int, right: bool) -> None:
    true = make_true_flight(FLIGHT, surely_seen=np.arange(10) < 6, possibly_seen=np.arange(10) < 8)
    assert find_errors(replace(FLIGHT, num_risers=num_risers), true, NO_DRIFT).num_steps_right == right


@pytest.mark.parametrize(("lowest", "num_risers"), [(-1, 11), (0, 11)])
def test_a_step_that_is_not_there_is_wrong(lowest: int, num_risers: int) -> None:
    step = lowest * np.array([FLIGHT.run, 0.0, FLIGHT.rise])
    base = FLIGHT.base + FLIGHT.map_from_flight[:3, :3] @ step
    result = find_errors(replace(FLIGHT, base=base, num_risers=num_risers), TRUE, NO_DRIFT)
    assert result.lowest_step == lowest
    assert not result.num_steps_right and result.num_risers_right is False


def test_place_forgives_any_weighting_of_the_frames_and_no_more() -> None:
    drifts = np.tile(np.eye(4), (11, 1, 1))
    drifts[:, :3, 3] = np.linspace(0, 0.1, 11)[:, None] * FLIGHT.forward
    left = FLIGHT.map_from_flight[:3, 1]
    late = replace(FLIGHT, base=FLIGHT.base + 0.1 * FLIGHT.forward + 0.02 * left)
    errors = find_errors(late, TRUE, drifts).errors
    assert errors["along"] == pytest.approx(0.05)
    assert errors["across"] == pytest.approx(0.02)
    assert errors["place"] == pytest.approx(0.02)
    unbounded = find_errors(replace(late, right_bounded=False), TRUE, drifts).errors
    assert unbounded["place"] == pytest.approx(0, abs=1e-9)


def test_a_width_with_an_unseen_side_stands_apart() -> None:
    errors = find_errors(replace(FLIGHT, left_bounded=False, width=0.5), TRUE, NO_DRIFT).errors
    assert errors["open_width"] == pytest.approx(0.5 - FLIGHT.width)
    assert np.isnan(find_errors(FLIGHT, TRUE, NO_DRIFT).errors["open_width"])


def test_stated_deviations_are_turned_into_the_axes_of_the_flight() -> None:
    std = FlightStd(
        rise=0.0, run=0.001, width=0.0, pitch=0, heading=np.nan, base=np.array([0.01, 0.02, 0.03])
    )
    sideways = make_flight(heading=np.pi / 2, std=std)
    stds = find_errors(sideways, make_true_flight(sideways), NO_DRIFT).stds
    assert stds["along"] == pytest.approx(0.02)
    assert stds["across"] == pytest.approx(0.01)
    assert stds["up"] == pytest.approx(0.03)
    assert stds["run"] == pytest.approx(0.001)
    assert np.isnan(stds["rise"]) and np.isnan(stds["heading"])
