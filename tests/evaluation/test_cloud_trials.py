"""Trials without a camera."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command_line import stairmap
from stairmap.errors import StairmapError
from stairmap.evaluation.cloud_suites import make_cloud_specs
from stairmap.evaluation.cloud_trials import run_cloud_trial
from stairmap.evaluation.suites import TrialChoice
from stairmap.evaluation.trials import TrialSpec
from stairmap.simulation.finished_maps import MAP_KINDS


def test_a_finished_map_gives_its_flight_to_millimetres(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = replace(MAP_KINDS["scanner_3mm"], angular_step=float(np.radians(0.4)))
    monkeypatch.setitem(MAP_KINDS, "scanner_3mm", kind)
    spec = TrialSpec(suite="clouds", scene="free_standing", sensor="scanner_3mm", robot="-", seed=0)
    (result,) = run_cloud_trial(spec, ())
    (flight,) = result.flights
    assert flight.must_be_found
    assert flight.errors is not None
    assert abs(flight.errors.errors["rise"]) < 0.003
    assert abs(flight.errors.errors["run"]) < 0.003
    assert flight.errors.num_steps_right
    assert result.false_flights == ()
    assert (result.num_frames, result.num_detections, result.num_false_frames) == (1, 1, 0)


def test_a_drive_with_a_lidar_is_judged_in_the_odometrys_map() -> None:
    spec = TrialSpec(
        suite="sweeps", scene="free_standing", sensor="mid360", robot="spot", seed=0, num_frames=28
    )
    (result,) = run_cloud_trial(spec, ())
    (flight,) = result.flights
    assert flight.must_be_found
    assert flight.errors is not None
    assert abs(flight.errors.errors["rise"]) < 0.006
    assert result.false_flights == ()
    assert result.num_frames >= 3
    assert result.frame_ms > 0


def test_each_scene_is_mapped_in_each_kind_and_driven_by_robots_in_turn() -> None:
    maps = make_cloud_specs("clouds", TrialChoice(is_quick=True))
    assert {spec.sensor for spec in maps} == set(MAP_KINDS)
    assert len({spec.scene for spec in maps}) * len(MAP_KINDS) == len(maps)
    assert not any(spec.scene.startswith("building:") for spec in maps)
    drives = make_cloud_specs("sweeps", TrialChoice())
    assert {spec.sensor for spec in drives} == {"mid360"}
    assert len({spec.robot for spec in drives[:5]}) == 5
    asked = make_cloud_specs(
        "sweeps", TrialChoice(sensor="vlp16", robot="go2", only=("short",), num_drives=2)
    )
    assert [(spec.sensor, spec.robot, spec.seed) for spec in asked] == [
        ("vlp16", "go2", 0),
        ("vlp16", "go2", 1),
    ]


def test_buildings_that_are_not_there_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(StairmapError, match=r"pass --data DIR, or --quick"):
        make_cloud_specs("clouds", TrialChoice(), buildings=tmp_path / "nowhere")


def test_the_command_refuses_sensors_that_a_suite_does_not_have() -> None:
    refused = stairmap("evaluate", "sweeps", "--sensor", "d435")
    assert refused.code == 2
    assert "mid360" in refused.stderr


@pytest.mark.nightly
def test_the_command_prints_the_table() -> None:
    outcome = stairmap(
        "evaluate", "clouds", "--quick", "--only", "b3", "--sensor", "scanner_3mm", "--jobs", "1"
    )
    assert outcome.code == 0, outcome.stderr
    assert "| b3 " in outcome.stdout
    assert "flights found / that had to be" in outcome.stdout
