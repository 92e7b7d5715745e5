"""Verdicts: right beyond two standard deviations, unknown within, never wrong the dangerous way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stairmap.navigation.robot_profile import RobotProfile, load_robot
from stairmap.navigation.traversability import assess
from stairmap.stairway import Landing
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


LONG = replace(ROBOT, min_landing_length=1.0)


def with_landing(length, turn_deg=0.0, std=0.01):
    """Return a stairway of two flights, the second turned, and a landing of known length between them."""
    flight_std = replace(make_std(), base=np.array([std, std, 5.0]))
    lower = make_flight(rise=0.16, run=0.30, std=flight_std)
    upper = make_flight(
        base=(4.0, 0.0, 1.6), heading=math.radians(turn_deg), rise=0.16, run=0.30, std=flight_std
    )
    return make_stairway(
        lower, upper, landings=(Landing(center=[3, 0, 1.6], size=(length, 9.0), heading=0.0),)
    )


def landing_checks(stairway, robot=LONG):
    return [check for check in assess(stairway, robot).checks if check.limit.measure == "landing length"]


@pytest.mark.parametrize(("length", "verdict"), [(1.1, "passable"), (1.01, "unknown"), (0.9, "impassable")])
def test_a_straight_landing_is_as_long_as_its_flights_ends_are_sure(length, verdict):
    """Both ends of it are as uncertain as a base in x and y: 2 x 1 cm x 1.41."""
    stairway = with_landing(length)
    (check,) = landing_checks(stairway)
    assert (check.measured, check.flight_number) == (length, 1)
    assert check.std == pytest.approx(0.02)
    assert assess(stairway, LONG).verdict == verdict


@pytest.mark.parametrize(
    ("turn_deg", "is_measured"), [(28, True), (-28, True), (32, False), (-32, False), (358, True)]
)
def test_a_landing_that_turns_by_less_than_30_deg_was_measured(turn_deg, is_measured):
    (check,) = landing_checks(with_landing(1.5, turn_deg))
    assert math.isnan(check.std) is not is_measured


def test_turns_are_the_difference_of_headings_not_their_sum():
    stairway = with_landing(1.5, 170)
    turned = replace(stairway.flights[0], heading=math.radians(-170))
    (check,) = landing_checks(replace(stairway, flights=(turned, stairway.flights[1])))
    assert math.isfinite(check.std)


def test_a_flight_that_no_landing_follows_needs_none():
    straight = with_landing(0.5)
    assert landing_checks(replace(straight, landings=())) == []
    assert landing_checks(make_stairway(make_flight())) == []


def test_each_landing_is_held_against_the_flights_beside_it():
    flights = tuple(make_flight(base=(4.0 * n, 0.0, 1.7 * n), heading=n * math.pi) for n in (0, 1, 3))
    landings = tuple(Landing(center=[0, 0, n], size=(n, 1.0), heading=0.0) for n in (2, 3))
    first, second = landing_checks(make_stairway(*flights, landings=landings))
    assert (first.flight_number, first.measured, second.flight_number, second.measured) == (1, 2.0, 2, 3.0)
    assert math.isnan(first.std)
    assert math.isfinite(second.std)


def test_a_landing_before_a_flight_of_one_riser_counts():
    stairway = with_landing(0.5)
    single = replace(stairway.flights[0], num_risers=1)
    assert len(landing_checks(replace(stairway, flights=(single, stairway.flights[1])))) == 1


def measures_of(robot):
    return {check.limit.measure for check in assess(make_stairway(), robot).checks}


@pytest.mark.parametrize(
    ("run", "pitch", "slope", "checked", "unchecked"),
    [
        (0.25, 36.0, None, {"run", "pitch"}, set()),
        (0.25, None, None, {"run"}, {"pitch"}),
        (None, 36.0, None, {"pitch"}, {"run"}),
        (None, None, 30.0, {"pitch"}, {"run"}),
        (0.25, None, 30.0, {"run"}, {"pitch"}),
        (None, None, None, {"run", "pitch"}, set()),
    ],
)
def test_of_run_and_pitch_one_published_limit_is_enough(run, pitch, slope, checked, unchecked):
    robot = replace(ROBOT, min_run=run, max_pitch_deg=pitch, max_slope_deg=slope)
    assessment = assess(make_stairway(), robot)
    assert measures_of(robot) == {"rise", "width"} | checked
    assert set(assessment.unchecked) == unchecked


@pytest.mark.parametrize("field", ["max_continuous_rise", "body_width", "side_clearance"])
def test_rise_and_width_must_be_known(field):
    robot = replace(ROBOT, **{field: None})
    assert assess_flight(robot, rise=0.1, run=0.4, width=3.0).verdict == "unknown"


def test_a_landing_length_that_was_never_published_is_left_out():
    assert "landing length" in assess(with_landing(0.5), ROBOT).unchecked


def test_checks_come_flight_by_flight_and_tell_their_numbers():
    assessment = assess(with_landing(1.5), LONG)
    numbers = [check.flight_number for check in assessment.checks]
    assert numbers == [1] * 5 + [2] * 4
    assert assessment.stairway_id == 1
    assert assessment.robot == "test"


def test_an_assessment_is_json_with_every_check():
    assessment = assess(with_landing(1.5), ROBOT)
    values = assessment.to_dict()
    assert values["stairway"] == 1
    assert values["probability"] == list(assessment.probability)
    assert values["unchecked"] == ["landing length"]
    assert values["checks"] == [check.to_dict() for check in assessment.checks]
    assert values["limiting"] == assessment.limiting.to_dict()


def test_a_stairway_without_flights_is_refused():
    with pytest.raises(ValueError, match="stairway 1 has no flights"):
        assess(replace(make_stairway(), flights=()), ROBOT)
