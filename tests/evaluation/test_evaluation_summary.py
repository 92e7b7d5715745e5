"""Sums over trials, and the calibration of stated deviations."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from true_drives import make_flight, make_stairways, make_true_flight, make_truth

from stairmap.evaluation.judging import judge_stairways
from stairmap.evaluation.summary import estimate_statistics, group_results, summarize
from stairmap.evaluation.tables import format_all, format_trials
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.stairway import Flight

SPEC = TrialSpec(suite="table1", scene="b3", sensor="kinect_v1", robot="spot", seed=0, width=320)
FLIGHT = make_flight()


def result_of(estimates: list[Flight], *, sensor: str = "kinect_v1") -> TrialResult:
    judgement = judge_stairways(make_stairways(estimates), make_truth(make_true_flight(FLIGHT)), [[0]] * 10)
    return TrialResult(
        spec=replace(SPEC, sensor=sensor), method="stairmap", num_frames=10, num_detections=8,
        num_observations=8, num_false_frames=1, frame_ms=2.0, mean_frame_ms=3.0, query_ms=1.0,
        flights=judgement.flights, false_flights=judgement.false_flights,
    )  # fmt: skip


CRASHED = TrialResult(spec=replace(SPEC, seed=7), method="stairmap", crash="ValueError: no | such thing")


def test_errors_of_the_stated_deviation_are_calibrated() -> None:
    random = np.random.default_rng(0)
    stds = random.uniform(0.001, 0.02, 20_000)
    statistics = estimate_statistics(list(random.normal(0, stds)), list(stds))
    assert statistics.share_within_1 == pytest.approx(0.6827, abs=0.01)
    assert statistics.share_within_2 == pytest.approx(0.9545, abs=0.005)
    assert statistics.num_with_std == statistics.num == 20_000


def test_statistics_leave_out_what_cannot_be_judged() -> None:
    statistics = estimate_statistics([1.0, np.nan, -3.0], [np.nan, 1.0, 2.0])
    assert (statistics.num, statistics.mean_abs, statistics.worst, statistics.bias) == (2, 2.0, 3.0, -1.0)
    assert (statistics.num_with_std, statistics.share_within_1, statistics.share_within_2) == (1, 0.0, 1.0)
    assert np.isnan(estimate_statistics([], []).mean_abs)


def test_a_summary_counts_found_missed_false_and_crashed() -> None:
    results = [result_of([FLIGHT]), result_of([]), result_of([FLIGHT, FLIGHT]), CRASHED]
    summary = summarize(results)
    assert (summary.num_trials, summary.num_crashed) == (4, 1)
    assert (summary.num_required, summary.num_found, summary.num_missed) == (3, 2, 1)
    assert (summary.num_false, summary.num_duplicates) == (1, 1)
    assert (summary.num_frames, summary.num_false_frames) == (30, 3)
    assert summary.errors["rise"].mean_abs == pytest.approx(0, abs=1e-12)
    assert (summary.num_steps_right, summary.num_steps_judged) == (2, 2)
    assert summary.frame_ms == 2.0


def test_bias_and_worst_keep_sign_and_size() -> None:
    shifts = (0.004, -0.001)
    results = [result_of([replace(FLIGHT, rise=FLIGHT.rise + shift)]) for shift in shifts]
    statistics = summarize(results).errors["rise"]
    assert statistics.bias == pytest.approx(0.0015)
    assert statistics.mean_abs == pytest.approx(0.0025)
    assert statistics.worst == pytest.approx(0.004)


def test_nothing_but_crashes_is_a_summary_too() -> None:
    summary = summarize([CRASHED])
    assert summary.num_crashed == 1
    assert json.loads(json.dumps(summary.to_dict(), allow_nan=False))["frame_ms"] is None


def test_results_are_json_without_nan() -> None:
    data = result_of([replace(FLIGHT, left_bounded=False)]).to_dict()
    assert json.loads(json.dumps(data, allow_nan=False))["flights"][0]["errors"]["errors"]["width"] is None


def test_tables_have_a_row_per_trial_and_say_what_crashed() -> None:
    results = [result_of([FLIGHT]), result_of([], sensor="d435"), CRASHED]
    lines = format_trials(results).splitlines()
    assert len(lines) == 2 + 3
    assert len({line.count("|") for line in lines}) == 1
    assert "crashed: ValueError: no / such thing" in lines[-1]
    text = format_all(results, ["stairmap"])
    assert "1/2" in text
    assert "stairmap, by sensor" in text
    assert "the report" in text


def test_flights_of_one_stairway_are_joined_or_not() -> None:
    other = make_flight(base=FLIGHT.base + np.array([0.0, 8.0, 0.0]))
    truth = make_truth(make_true_flight(FLIGHT), make_true_flight(other, flight_index=1))
    apart = make_stairways([FLIGHT, other])
    joined = (replace(apart[0], flights=(FLIGHT, other)),)
    for stairways, num_right in ((apart, 0), (joined, 1)):
        judgement = judge_stairways(stairways, truth, [[0, 1]] * 10)
        summary = summarize([replace(result_of([FLIGHT]), flights=judgement.flights)])
        assert (summary.num_joined_right, summary.num_joined_judged) == (num_right, 1)
    assert summarize([result_of([FLIGHT])]).num_joined_judged == 0


def test_groups_keep_their_order() -> None:
    results = [result_of([]), result_of([], sensor="d435"), result_of([])]
    groups = group_results(results, lambda result: result.spec.sensor)
    assert {name: len(mine) for name, mine in groups.items()} == {"kinect_v1": 2, "d435": 1}
    assert list(groups) == ["kinect_v1", "d435"]
