"""Verdicts: right beyond two standard deviations, unknown within, never wrong the dangerous way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.navigation.traversability import assess
from walkable_stairways import make_flight, make_half_turn, make_stairway, make_std

ROBOT = RobotProfile(
    name="test", max_continuous_rise=0.18, max_single_rise=0.30, min_run=0.25, max_pitch_deg=36.0,
    max_slope_deg=None, body_width=0.5, side_clearance=0.05, min_landing_length=None,
)  # fmt: skip


def assess_flight(robot=ROBOT, **flight):
    return assess(make_stairway(make_flight(**flight)), robot)


def test_a_flight_well_inside_all_limits_is_passable():
    assessment = assess_flight(rise=0.16, run=0.30)
    assert assessment.verdict == "passable"
    assert assessment.probability[0] > 0.999


def test_the_limiting_property_is_the_one_with_the_least_to_spare():
    limiting = assess_flight(rise=0.174, run=0.30).limiting
    assert limiting.limit.measure == "rise"
    assert (limiting.measured, limiting.limit.value) == (0.174, 0.18)
    assert limiting.margin == pytest.approx(0.006)


@pytest.mark.parametrize(
    ("flight", "measure"),
    [
        ({"rise": 0.20}, "rise"),
        ({"run": 0.22, "rise": 0.12}, "run"),
        ({"width": 0.45}, "width"),
        ({"rise": 0.178, "run": 0.2, "std": make_std(pitch=0.001, run=0.03)}, "pitch"),
    ],
)
def test_one_broken_limit_is_enough(flight, measure):
    assessment = assess_flight(**flight)
    assert assessment.verdict == "impassable"
    assert assessment.limiting.limit.measure == measure
    assert assessment.limiting.margin < 0


def test_a_rise_within_two_standard_deviations_of_the_limit_is_unknown():
    for rise in (0.177, 0.18, 0.183):
        assert assess_flight(rise=rise, run=0.30).verdict == "unknown"


def test_a_width_with_an_unseen_end_can_prove_that_a_robot_fits_but_not_that_it_does_not():
    assert assess_flight(width=0.5, left_bounded=False).verdict == "unknown"
    assert assess_flight(width=0.9, left_bounded=False).verdict == "passable"


def test_a_width_that_the_rails_may_have_widened_is_not_trusted_to_the_centimetre():
    assert assess_flight(width=0.68, std=make_std(width=0.005)).verdict == "unknown"


def test_a_measure_without_uncertainty_proves_nothing():
    assert assess_flight(rise=0.10, std=make_std(rise=math.nan)).verdict == "unknown"


def test_an_unpublished_rise_is_never_guessed():
    assessment = assess_flight(load_robot("anymal"), rise=0.10, run=0.40, width=3.0)
    assert assessment.verdict == "unknown"
    assert assessment.limiting.limit.value is None


def test_a_ramps_slope_speaks_for_a_stairway_but_not_against_it():
    go2 = load_robot("go2")
    assert assess_flight(go2, rise=0.15, run=0.28).verdict == "passable"
    assert assess_flight(go2, rise=0.15, run=0.14).verdict == "unknown"
    assert assess_flight(go2, rise=0.15, run=0.28).unchecked == ("run",)


def test_a_17_mm_error_would_flip_the_verdict_for_a_go2_so_uncertainty_makes_it_unknown():
    go2 = load_robot("go2")
    assert assess_flight(go2, rise=0.150, std=make_std(rise=0.017)).verdict == "unknown"
    assert assess_flight(go2, rise=0.177, std=make_std(rise=0.002)).verdict == "impassable"


def test_a_flight_of_one_riser_is_held_against_the_single_step_limit():
    assessment = assess_flight(rise=0.25, num_risers=1)
    assert assessment.verdict == "passable"
    assert {check.limit.measure for check in assessment.checks} == {"single rise", "width"}


def test_every_flight_of_a_stairway_counts():
    high = make_flight(base=(3, 0, 1.7), rise=0.22)
    assessment = assess(make_stairway(make_flight(), high), ROBOT)
    assert assessment.verdict == "impassable"
    assert assessment.limiting.flight_number == 2


def test_the_landing_of_a_turn_was_not_measured_so_a_robot_that_needs_one_gets_unknown():
    stairway = make_half_turn()
    needy = RobotProfile(
        name="long", max_continuous_rise=0.2, max_single_rise=0.3, min_run=0.2, max_pitch_deg=45,
        max_slope_deg=None, body_width=0.5, side_clearance=0, min_landing_length=1.0,
    )  # fmt: skip
    assert assess(stairway, ROBOT).verdict == "passable"
    assert assess(stairway, needy).verdict == "unknown"


def test_wheels_never_climb():
    assert assess_flight(load_robot("wheeled"), rise=0.10, run=0.40).verdict == "impassable"


def test_assessment_is_json():
    values = assess_flight().to_dict()
    assert values["verdict"] == "passable"
    assert values["limiting"]["unit"] in ("m", "rad")


"""20,000 stairways of any dimensions; each is measured with Gaussian errors of the stated size."""


@pytest.fixture(scope="module")
def sample():
    """20,000 stairways of any dimensions; each is measured with Gaussian errors of the stated size."""
    random = np.random.default_rng(6)
    rows = []
    for _ in range(20_000):
        rise, run = random.uniform(0.12, 0.24), random.uniform(0.20, 0.34)
        width = random.uniform(0.45, 1.5)
        rise_std, run_std = random.uniform(0.001, 0.006), random.uniform(0.001, 0.008)
        width_std = random.uniform(0.005, 0.05)
        pitch = math.atan2(rise, run)
        pitch_std = math.hypot(rise_std * math.cos(pitch), run_std * math.sin(pitch)) / math.hypot(rise, run)
        measured = make_flight(
            rise=rise + random.normal(0, rise_std), run=run + random.normal(0, run_std),
            width=max(width + random.normal(0, width_std), 0.05),
            std=make_std(rise=rise_std, run=run_std, width=width_std, pitch=pitch_std),
        )  # fmt: skip
        true_spares = [
            (0.18 - rise) / rise_std, (run - 0.25) / run_std, (width - 0.6) / width_std,
            (math.radians(36) - pitch) / pitch_std,
        ]  # fmt: skip
        assessment = assess(make_stairway(measured), ROBOT)
        measured_spares = [check.margin / check.std for check in assessment.checks]
        rows.append((min(true_spares), min(measured_spares), assessment.verdict))
    return rows


def test_verdicts_beyond_two_sigma_are_right_in_99_percent(sample):
    # Beyond as the robot can know it: its measures are two sigma inside of every limit, or beyond one.
    clear = [(true, verdict) for true, measured, verdict in sample if abs(measured) > 2]
    right = [verdict == ("passable" if true >= 0 else "impassable") for true, verdict in clear]
    assert len(clear) > 15_000
    assert np.mean(right) >= 0.99


def test_no_stairway_beyond_a_limit_by_two_sigma_is_called_passable(sample):
    assert [row for row in sample if row[0] < -2 and row[2] == "passable"] == []


def test_wrong_verdicts_are_rarer_than_the_doubt_they_state(sample):
    passable = [true for true, _, verdict in sample if verdict == "passable"]
    assert np.mean(np.array(passable) < 0) < 0.005


def test_within_two_sigma_the_verdict_is_unknown_not_wrong(sample):
    near = [verdict for _, measured, verdict in sample if abs(measured) < 1.9]
    assert set(near) == {"unknown"}
