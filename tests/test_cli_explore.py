"""``stairmap explore`` from start to end, through the command line."""

from __future__ import annotations

import json

import pytest

from command_line import stairmap
from stairmap.exploration.strategies import VALUE_OF_AREA

pytest.importorskip("embreex")
pytest.importorskip("py_trees")


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """Return the run folder of a mission in a house of two floors, with what was printed."""
    folder = tmp_path_factory.mktemp("explore") / "house"
    outcome = stairmap(
        "explore", "two_floors", "--robot", "spot", "--perfect-odometry", "-o", folder, "--json"
    )
    assert outcome.code == 0, outcome.stderr
    return folder, json.loads(outcome.stdout)


def test_both_floors_are_reached_without_an_accident(house):
    _, printed = house
    assert printed["floors_reached"] == 2
    assert printed["falls"] == printed["collisions"] == 0
    assert printed["stopped"] == "nothing reachable is left"


def test_the_run_folder_holds_the_mission(house):
    folder, printed = house
    saved = json.loads((folder / "exploration.json").read_text())
    assert {key: printed[key] for key in saved} == saved
    names = {path.name for path in folder.iterdir()}
    assert {"stairways.json", "decisions.jsonl", "coverage.csv", "trajectory.tum", "report.html"} <= names
    assert (folder / "recording" / "depth.txt").exists()
    assert len(list((folder / "maps").glob("*.yaml"))) == 2


def test_no_stairs_are_climbed_while_a_frontier_costs_less_than_its_gain_says(house):
    folder, _ = house
    decisions = [json.loads(line) for line in (folder / "decisions.jsonl").read_text().splitlines()]
    climbs = [entry for entry in decisions if entry["event"] == "decision" and entry["chosen"]]
    climbs = [entry for entry in climbs if entry["chosen"]["kind"] == "stairs"]
    assert climbs
    for entry in climbs:
        for task in entry["tasks"]:
            if task["kind"] == "frontier" and task["level"] == entry["level"]:
                assert task["cost"] >= VALUE_OF_AREA * task["gain"]


def test_the_recording_can_be_run_again(house, tmp_path):
    folder, _ = house
    outcome = stairmap("inspect", folder / "recording")
    assert outcome.code == 0


def test_coverage_grows_and_names_every_level(house):
    _, printed = house
    areas = [row[1] for row in printed["coverage"]]
    assert areas[-1] == pytest.approx(printed["area_m2"], abs=0.5)
    assert {level["level"] for level in printed["levels"]} == {row[2] for row in printed["coverage"]}


@pytest.mark.parametrize(
    ("start", "reason"),
    [
        ("3.0,-4.0,0", "no ground"),
        ("4,3.5,1.4", "no ground"),
        ("3.4,0.9,0.1", "wall or an obstacle"),
        ("3.4,0.9,1.0", "no level ground"),
    ],
)
def test_a_start_where_the_robot_cannot_stand_names_a_free_place(start, reason, tmp_path):
    outcome = stairmap("explore", "tower", f"--start={start}", "-o", tmp_path / "run")
    assert outcome.code == 1
    assert reason in outcome.stderr
    assert "the nearest free place is --start " in outcome.stderr


def test_a_start_that_is_no_place_is_wrong_usage(tmp_path):
    assert stairmap("explore", "tower", "--start", "here", "-o", tmp_path / "run").code == 2


def test_a_world_that_is_not_there_is_wrong_usage(tmp_path):
    assert stairmap("explore", "no_such_world", "-o", tmp_path / "run").code == 2


@pytest.mark.nightly
@pytest.mark.parametrize(("scene", "num_floors"), [("tower", 4), ("loop_house", 3), ("two_stairways", 3)])
def test_every_floor_that_passable_stairs_reach_is_reached(scene, num_floors, tmp_path):
    outcome = stairmap(
        "explore", scene, "--perfect-odometry", "--no-report", "-o", tmp_path / "run", "--json"
    )
    printed = json.loads(outcome.stdout)
    assert printed["floors_reached"] == num_floors
    assert printed["falls"] == printed["collisions"] == 0
