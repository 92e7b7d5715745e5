"""``stairmap check`` and ``run --robot``: verdicts from a run folder."""

from __future__ import annotations

import json

import cv2
import pytest

from command_line import check_refused, stairmap
from small_recordings import write_recording
from stairmap.export.results import RunFolder
from walkable_stairways import make_flight, make_stairway


@pytest.fixture
def run_folder(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    low = make_stairway(make_flight(rise=0.15, run=0.30))
    high = make_stairway(make_flight(rise=0.20, run=0.26), stairway_id=2)
    RunFolder(folder).write_stairways([low, high], num_frames=9)
    return folder


def test_a_robot_climbs_one_stairway_and_not_the_other(run_folder):
    values = json.loads(stairmap("check", run_folder, "--robot", "go2", "--json").stdout)
    assert [item["verdict"] for item in values["assessments"]] == ["passable", "impassable"]


def test_the_table_says_what_limits_in_units_people_read(run_folder):
    outcome = stairmap("check", run_folder / "stairways.json", "--robot", "go2")
    assert outcome.code == 0
    assert "200 ± 3 mm" in outcome.stdout
    assert "≤ 160 mm" in outcome.stdout
    assert "-40 mm" in outcome.stdout


def test_without_a_robot_all_that_are_known_are_checked(run_folder):
    assert "ANYmal" in stairmap("check", run_folder).stdout


def test_codes_say_which_rule_is_broken_by_how_much(run_folder):
    text = stairmap("check", run_folder, "--code", "ibc").stdout
    assert "rise (IBC 1011.5.2)" in text
    assert "-22 mm" in text
    assert "Spot" not in text


def test_codes_say_what_they_ask_beyond_what_was_checked(run_folder):
    text = stairmap("check", run_folder, "--code", "osha").stdout
    (line,) = [line for line in text.splitlines() if line.startswith("not checked of osha: ")]
    assert "alike" in line and "headroom" in line


def test_the_picture_is_a_png(run_folder, tmp_path):
    stairmap("check", run_folder, "--robot", "spot", "--code", "ada", "--picture", tmp_path / "v.png")
    assert cv2.imread(str(tmp_path / "v.png")) is not None


def test_list_names_robots_and_codes():
    text = stairmap("check", "--list").stdout
    assert "spot" in text
    assert "uk_k_private" in text


def test_an_empty_run_is_told_in_one_line(tmp_path):
    (tmp_path / "run").mkdir()
    RunFolder(tmp_path / "run").write_stairways([], num_frames=9)
    check_refused(stairmap("check", tmp_path / "run"), "no stairway", "nothing to check")


def test_a_bad_profile_is_told_in_one_line(run_folder, tmp_path):
    (tmp_path / "bad.yaml").write_text("name: bad\nmax_continuous_rise: -1\n")
    check_refused(stairmap("check", run_folder, "--robot", tmp_path / "bad.yaml"), "lacks max_single_rise")


def test_without_a_run_usage_is_explained():
    assert stairmap("check").code == 2


def test_run_tells_whether_the_robot_can_climb(tmp_path):
    recording = write_recording(tmp_path / "stairs")
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--robot", "wheeled", "--no-report")
    assert "impassable" in outcome.stdout
    assert outcome.last_line == str(tmp_path / "out")


def test_run_refuses_an_unknown_robot_before_it_begins(tmp_path):
    recording = write_recording(tmp_path / "stairs")
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--robot", "sport")
    check_refused(outcome, "no robot 'sport'", "spot")
    assert not (tmp_path / "out").exists()
