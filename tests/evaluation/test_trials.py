"""Small trials from simulation to result."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stairmap.evaluation.convergence import draw_convergences, record_convergence
from stairmap.evaluation.detection_rates import QUICK_GRID, measure_panel
from stairmap.evaluation.frame_cache import recorded_frames
from stairmap.evaluation.rate_plots import draw_rates
from stairmap.evaluation.real import run_real_suite
from stairmap.evaluation.tables import format_real
from stairmap.evaluation.trials import TrialSpec, run_trial
from stairmap.evaluation.truth import NEAR_FRAMES, find_truth
from stairmap.visualization.plots import png_from_figure

SPEC = TrialSpec(
    suite="table1", scene="b3", sensor="kinect_v2", robot="spot", seed=1, width=160, num_frames=16
)
METHODS = ("stairmap", "delmerico2013")


def test_truth_says_what_had_to_be_found_also_with_few_frames() -> None:
    (flight,) = find_truth(SPEC.simulation()).flights
    assert flight.must_be_found
    assert 0 < flight.num_near_frames < NEAR_FRAMES
    assert flight.surely_seen[0]
    assert not np.any(flight.surely_seen & ~flight.possibly_seen)
    away = replace(SPEC, scene="empty_room").simulation()
    assert find_truth(away).flights == ()


def test_nosings_that_crowd_into_a_few_rows_are_not_surely_seen() -> None:
    (flight,) = find_truth(replace(SPEC, scene="descending", width=320, num_frames=20).simulation()).flights
    # From the edge of a stairwell the camera looks along the slope: all are in view, few can be told apart.
    assert flight.possibly_seen.sum() > flight.surely_seen.sum() > 0
    assert flight.surely_seen[-1] and not flight.surely_seen[0]


def test_a_trial_gives_one_result_per_method_and_no_nan() -> None:
    results = run_trial(SPEC, METHODS)
    assert [result.method for result in results] == list(METHODS)
    for result in results:
        assert result.num_frames == 16
        assert result.frame_ms > 0
        assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["spec"]["scene"] == "b3"


def test_a_cache_changes_nothing(tmp_path: Path) -> None:
    simulation = replace(SPEC, num_frames=3).simulation()
    plain = [frame.depth.tobytes() for frame in recorded_frames(simulation)]
    for _ in ("written", "read"):
        cached = [frame.depth.tobytes() for frame in recorded_frames(simulation, tmp_path / "frames")]
        assert cached == plain
    (tmp_path / "frames" / "complete").unlink()
    again = [frame.depth.tobytes() for frame in recorded_frames(simulation, tmp_path / "frames")]
    assert again == plain


def test_convergence_follows_a_flight_and_is_drawn() -> None:
    convergence = record_convergence(SPEC, METHODS)
    assert convergence is not None
    assert set(convergence.samples) == set(METHODS)
    for samples in convergence.samples.values():
        counts = [sample.num_observations for sample in samples]
        assert counts == sorted(counts)
    assert png_from_figure(draw_convergences(convergence)).startswith(b"\x89PNG")
    assert record_convergence(replace(SPEC, scene="empty_room", num_frames=2), METHODS) is None


def test_detection_rates_are_shares_of_views_and_repeat() -> None:
    grid = replace(QUICK_GRID, distances=(1.0, 2.5), angles=(0.0,), num_views=2)
    ((setting, height),) = grid.panels()
    panels = measure_panel(grid, setting, height, METHODS)
    again = measure_panel(grid, setting, height, METHODS)
    assert [panel.to_dict() for panel in panels] == [panel.to_dict() for panel in again]
    for panel in panels:
        assert panel.recall.shape == panel.false_rate.shape == (1, 2)
        assert np.all((panel.recall >= 0) & (panel.recall <= 1))
    assert png_from_figure(draw_rates(panels[:1], grid, rate="recall")).startswith(b"\x89PNG")
    assert png_from_figure(draw_rates(panels[:1], grid, rate="false_rate")).startswith(b"\x89PNG")


def test_real_recordings_are_judged_by_what_was_measured(shared_data: Path) -> None:
    results = run_real_suite(shared_data / "real", METHODS, only=("kinect_v2", "objects"))
    by_name = {(result.recording, result.method): result for result in results}
    assert len(by_name) == 4
    stairs = by_name["kinect_v2_test_stairs", "stairmap"]
    assert stairs.num_frames == 1
    assert stairs.truth == {"rise": 0.104, "run": 0.274, "width": 0.81, "num_steps": 5}
    assert by_name["no_stairs_objects_realsense", "stairmap"].num_stairways is None
    assert "(104)" in format_real(results)


def test_an_unknown_scene_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown scene"):
        run_trial(replace(SPEC, scene="castle"), METHODS)
