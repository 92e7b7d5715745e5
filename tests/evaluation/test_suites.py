"""Suites share sensors and robots out among their scenes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stairmap.errors import StairmapError
from stairmap.evaluation.suites import SENSOR_SETTINGS, TrialChoice, make_specs
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import SCENE_GROUPS
from stairmap.simulation.sensors import SENSORS


@pytest.mark.parametrize("suite", ["table1", "stairs", "look-alikes", "kind-drives"])
def test_every_scene_sensor_and_robot_occurs(suite: str) -> None:
    specs = make_specs(suite, TrialChoice())
    assert {spec.scene for spec in specs} == set(SCENE_GROUPS[suite])
    assert {(spec.sensor, spec.width) for spec in specs} == set(SENSOR_SETTINGS)
    assert {spec.robot for spec in specs} == set(ROBOTS)
    assert len(set(specs)) == len(specs)


def test_each_suite_keeps_its_place_in_the_deal() -> None:
    for suite, sensor, robot in (
        ("table1", "kinect_v1", "turtlebot"),
        ("stairs", "d435", "spot"),
        ("look-alikes", "phone_lidar", "packbot"),
        ("kind-drives", "kinect_v1", "go2"),
    ):
        first = make_specs(suite, TrialChoice())[0]
        assert (first.sensor, first.robot) == (sensor, robot)


def test_no_suite_has_the_ideal_sensor() -> None:
    assert {sensor for sensor, _ in SENSOR_SETTINGS} == set(SENSORS) - {"ideal"}


def test_a_trial_alone_is_the_same_as_in_its_suite() -> None:
    alone = make_specs("stairs", TrialChoice(only=("half_turn",)))
    assert alone
    assert set(alone) < set(make_specs("stairs", TrialChoice()))


def test_choices_hold_for_every_trial() -> None:
    choice = TrialChoice(sensor="d435", robot="go2", width=160, num_drives=2, seed=5)
    specs = make_specs("table1", choice)
    assert len(specs) == 10
    assert {(spec.sensor, spec.robot, spec.width) for spec in specs} == {("d435", "go2", 160)}
    assert {spec.seed for spec in specs} == {5, 6}


def test_quick_suites_are_small_and_another_seed_deals_anew() -> None:
    quick = make_specs("look-alikes", TrialChoice(is_quick=True))
    assert len(quick) == len(SCENE_GROUPS["look-alikes"])
    assert all(spec.num_frames is not None for spec in quick)
    other = make_specs("look-alikes", TrialChoice(is_quick=True, seed=1))
    assert [spec.sensor for spec in other] != [spec.sensor for spec in quick]


def test_buildings_give_a_scene_for_every_drive(shared_data: Path) -> None:
    specs = make_specs("buildings", TrialChoice(only=("hospital",)), buildings=shared_data / "buildings")
    assert {spec.scene for spec in specs} == {f"building:hospital/{number}" for number in range(1, 7)}


def test_missing_buildings_and_unknown_suites_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StairmapError, match="--data"):
        make_specs("buildings", TrialChoice(), buildings=tmp_path / "none")
    with pytest.raises(ValueError, match="unknown suite"):
        make_specs("castles", TrialChoice())


def test_a_spec_names_its_files_and_refuses_unknown_robots() -> None:
    spec = make_specs("table1", TrialChoice(only=("b3",)))[0]
    assert "/" not in replace(spec, scene="building:hospital/2").folder_name()
    with pytest.raises(ValueError, match="unknown robot"):
        replace(spec, robot="rover").simulation()
