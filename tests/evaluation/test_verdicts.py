"""Verdicts against the truth: right, unknown, wrong, and dangerous."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from true_drives import STD, make_flight, make_stairways, make_true_flight, make_truth

from stairmap.evaluation.judging import judge_stairways
from stairmap.evaluation.summary import summarize
from stairmap.evaluation.tables import format_summary
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.evaluation.verdicts import count_verdicts, judge_verdict, judge_verdicts
from stairmap.navigation.limits import STEP_STD
from stairmap.navigation.robot_profile import RobotProfile, robot_names
from stairmap.stairway import Flight

ROBOT = RobotProfile(
    name="made up", max_continuous_rise=0.18, max_single_rise=0.3, min_run=0.25, max_pitch_deg=None,
    max_slope_deg=None, body_width=0.5, side_clearance=0.05, min_landing_length=None,
)  # fmt: skip


SIGMA = math.hypot(STD.rise, STEP_STD)
"""Deviation of a rise that verdicts use."""


def flight_of(**changes: float | bool) -> Flight:
    """Return a flight with a deviation of 2 mm in rise."""
    return replace(make_flight(), **changes)


def test_a_verdict_that_agrees_with_the_truth_is_right() -> None:
    low, high = flight_of(rise=0.17), flight_of(rise=0.19)
    for estimate, truth in ((low, "passable"), (high, "impassable")):
        verdict = judge_verdict(estimate, estimate, ROBOT)
        assert (verdict.verdict, verdict.truth, verdict.answer) == (truth, truth, "right")
        assert verdict.is_clear and not verdict.is_dangerous


def test_an_impassable_flight_called_passable_is_wrong_and_dangerous() -> None:
    verdict = judge_verdict(flight_of(rise=0.17), flight_of(rise=0.19), ROBOT)
    assert verdict.answer == "wrong" and verdict.is_dangerous
    assert (verdict.distance, verdict.true_distance) == (
        pytest.approx(0.01 / SIGMA),
        pytest.approx(-0.01 / SIGMA),
    )
    assert verdict.measure == "rise"


def test_a_passable_flight_called_impassable_is_wrong_but_not_dangerous() -> None:
    verdict = judge_verdict(flight_of(rise=0.19), flight_of(rise=0.17), ROBOT)
    assert verdict.answer == "wrong" and not verdict.is_dangerous


def test_near_a_limit_unknown_is_no_error() -> None:
    verdict = judge_verdict(flight_of(rise=0.179), flight_of(rise=0.181), ROBOT)
    assert verdict.answer == "unknown" and not verdict.is_clear and not verdict.is_truly_clear


def test_an_open_width_below_the_limit_is_near_whatever_it_measures() -> None:
    truth = flight_of(width=1.2)
    narrow = flight_of(width=0.3, left_bounded=False)
    verdict = judge_verdict(narrow, truth, ROBOT)
    assert verdict.answer == "unknown" and not verdict.is_clear and verdict.is_truly_clear
    wide = judge_verdict(flight_of(width=1.1, left_bounded=False), truth, ROBOT)
    assert wide.answer == "right" and wide.is_clear


def test_a_limit_that_nobody_published_leaves_the_truth_open() -> None:
    silent = replace(ROBOT, body_width=None)
    verdict = judge_verdict(flight_of(), flight_of(), silent)
    assert (verdict.truth, verdict.answer) == ("unknown", "right")
    broken = judge_verdict(flight_of(rise=0.25), flight_of(rise=0.25), silent)
    assert broken.truth == "impassable"


def test_a_ramp_that_is_less_steep_than_the_stairs_leaves_the_truth_open() -> None:
    ramp = replace(ROBOT, min_run=None, max_slope_deg=25.0)
    assert judge_verdict(flight_of(), flight_of(), ramp).truth == "unknown"


def test_a_measure_at_its_limit_keeps_it_in_truth() -> None:
    truth = flight_of(rise=0.18 + 1e-6)
    assert judge_verdict(truth, truth, ROBOT).truth == "passable"


def test_counts_leave_out_what_nobody_can_know() -> None:
    good, bad = flight_of(rise=0.17), flight_of(rise=0.19)
    verdicts = [
        judge_verdict(good, good, ROBOT),
        judge_verdict(good, bad, ROBOT),
        judge_verdict(flight_of(rise=0.179), good, ROBOT),
        judge_verdict(good, good, replace(ROBOT, body_width=None)),
    ]
    counts = count_verdicts(verdicts)
    assert (counts.num, counts.right, counts.unknown, counts.wrong) == (3, 1, 0, 1)
    assert (counts.near_right, counts.near_unknown, counts.near_wrong) == (0, 1, 0)
    assert (counts.truly_clear_right, counts.truly_clear_unknown, counts.truly_clear_wrong) == (1, 1, 1)
    assert (counts.num_dangerous, counts.num_overclaimed) == (1, 0)


def test_every_profile_is_judged_on_every_flight_that_was_found() -> None:
    flight = make_flight()
    assert len(judge_verdicts(flight, flight)) == len(robot_names())
    (found,) = judge_stairways(make_stairways([flight]), make_truth(make_true_flight(flight)), [[0]]).flights
    assert len(found.verdicts) == len(robot_names())
    (missed,) = judge_stairways((), make_truth(make_true_flight(flight)), [[0]]).flights
    assert missed.verdicts == ()


def test_gaussian_errors_leave_99_percent_right_beyond_two_deviations() -> None:
    random = np.random.default_rng(5)
    verdicts = []
    for _ in range(400):
        truth = flight_of(
            rise=random.uniform(0.1, 0.25), run=random.uniform(0.2, 0.35), width=random.uniform(0.5, 2.0)
        )
        estimate = replace(
            truth,
            rise=truth.rise + STD.rise * random.normal(),
            run=truth.run + STD.run * random.normal(),
            width=truth.width + STD.width * random.normal(),
        )
        verdicts += judge_verdicts(estimate, truth)
    counts = count_verdicts(verdicts)
    clear = counts.right + counts.unknown + counts.wrong
    assert clear > 1500 and counts.right >= 0.99 * clear
    assert counts.near_unknown > 50 and counts.near_right == counts.near_wrong == 0


def test_the_summary_and_its_table_tell_the_counts() -> None:
    bad = make_flight(rise=0.19)
    judgement = judge_stairways(make_stairways([make_flight()]), make_truth(make_true_flight(bad)), [[0]])
    spec = TrialSpec(suite="stairs", scene="x", sensor="d435", robot="spot", seed=0)
    result = TrialResult(spec=spec, method="stairmap", num_frames=1, flights=judgement.flights)
    summary = summarize([result])
    assert summary.verdicts.num_dangerous > 0
    assert json.loads(json.dumps(summary.to_dict(), allow_nan=False))["verdicts"]["num_dangerous"] > 0
    assert json.dumps(result.to_dict(), allow_nan=False)
    rows = format_summary({"stairmap": summary}).splitlines()
    (row,) = [row for row in rows if "called passable" in row]
    assert row.split("|")[2].strip() == str(summary.verdicts.num_dangerous)
