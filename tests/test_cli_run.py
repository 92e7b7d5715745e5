"""``stairmap run`` end to end."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from command_line import check_refused, stairmap
from small_recordings import STAIRS, damage_image, write_recording
from stairmap.export.loading import load_detections, load_stairways
from stairmap.transforms import rotation_from_vector


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "stairs")


@pytest.fixture(scope="module")
def floor(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "floor", num_frames=4, has_stairs=False)


def check_dimensions(flight):
    assert flight.rise == pytest.approx(STAIRS.rise, abs=0.01)
    assert flight.run == pytest.approx(STAIRS.run, abs=0.01)


def test_run_writes_the_run_folder_and_prints_its_path_last(recording, tmp_path):
    outcome = stairmap("run", recording, "-o", tmp_path / "out")
    assert outcome.code == 0
    assert outcome.last_line == str(tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "config.yaml",
        "detections.jsonl",
        "history.jsonl",
        "log.txt",
        "recording.json",
        "report.html",
        "stairways.json",
        "stairways.ply",
        "summary.txt",
        "trajectory.tum",
    }
    (stairway,) = load_stairways(tmp_path / "out").stairways
    check_dimensions(stairway.flights[0])
    assert len(list(load_detections(tmp_path / "out"))) == 8


def test_run_prints_a_table_with_units_on_stdout_and_no_progress_bar(recording, tmp_path):
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--no-report")
    assert "rise mm" in outcome.stdout
    assert "8 frames, stair edges seen in" in outcome.stdout
    assert outcome.stderr == ""
    assert not (tmp_path / "out" / "report.html").exists()


def test_json_is_all_of_stdout_and_agrees_with_the_file(recording, tmp_path):
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--no-report", "--json")
    values = json.loads(outcome.stdout)
    saved = json.loads((tmp_path / "out" / "stairways.json").read_text())
    assert values["stairways"] == saved["stairways"]
    assert values["output"] == str(tmp_path / "out")
    assert values["num_frames"] == 8
    assert values["interrupted"] is False
    assert np.array_equal(values["map_from_recorded"], np.eye(4))


def test_same_recording_gives_the_same_files(recording, tmp_path):
    for name in ("first", "second"):
        stairmap("run", recording, "-o", tmp_path / name, "--no-report")
    for path in (tmp_path / "first").iterdir():
        assert path.read_bytes() == (tmp_path / "second" / path.name).read_bytes()


def test_no_stairway_is_no_error_and_says_why(floor, tmp_path):
    outcome = stairmap("run", floor, "-o", tmp_path / "out", "--no-report")
    assert outcome.code == 0
    assert "no stairway was found" in outcome.stdout
    assert "why frames gave no stairway" in outcome.stdout
    assert "min_steps" in outcome.stdout
    assert load_stairways(tmp_path / "out").stairways == ()


def test_too_few_observations_are_a_reason(recording, tmp_path):
    outcome = stairmap(
        "run", recording, "-o", tmp_path / "out", "--no-report", "--set", "modeling.min_observations=50"
    )
    assert "with stair edges made no stairway: it takes 50 observations" in outcome.stdout


def test_results_are_never_overwritten(floor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = [stairmap("run", floor, "--no-report").last_line for _ in range(2)]
    assert folders == ["results/floor_1", "results/floor_2"]
    check_refused(stairmap("run", floor, "-o", "results/floor_1"), "not empty", "never overwritten")


def test_report_method_runs_behind_the_same_command(recording, tmp_path):
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--method", "delmerico2013", "--no-report")
    assert outcome.code == 0
    assert (tmp_path / "out" / "stairways.json").exists()


def test_map_with_y_down_is_turned_and_the_user_is_told(tmp_path):
    y_down = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    recording = write_recording(tmp_path / "slam", recorded_from_map=y_down)
    outcome = stairmap("run", recording, "--up", "-y", "-o", tmp_path / "out", "--no-report", "--json")
    assert "the map was turned so that its -y axis is z" in outcome.stderr
    assert np.allclose(np.array(json.loads(outcome.stdout)["map_from_recorded"])[:3, :3], y_down.T)
    (stairway,) = load_stairways(tmp_path / "out").stairways
    check_dimensions(stairway.flights[0])


def test_tilted_map_is_levelled_by_the_floor(tmp_path):
    tilt = rotation_from_vector([0.6, -0.3, 0.4])
    recording = write_recording(tmp_path / "slam", recorded_from_map=tilt)
    outcome = stairmap("run", recording, "--up=auto", "-o", tmp_path / "out", "--no-report")
    assert "the map was turned by" in outcome.stderr
    assert "the map was turned by" in (tmp_path / "out" / "summary.txt").read_text()
    (stairway,) = load_stairways(tmp_path / "out").stairways
    check_dimensions(stairway.flights[0])


def test_poses_of_another_file_are_used(tmp_path):
    recording = write_recording(tmp_path / "stairs")
    poses = tmp_path / "slam.tum"
    (recording / "groundtruth.txt").rename(poses)
    check_refused(stairmap("run", recording), "--trajectory", "stairmap detect")
    outcome = stairmap("run", recording, "--trajectory", poses, "-o", tmp_path / "out", "--no-report")
    assert outcome.code == 0
    assert len(load_stairways(tmp_path / "out").stairways) == 1


def test_frames_without_a_pose_are_left_out_and_counted(tmp_path):
    recording = write_recording(tmp_path / "stairs")
    poses = recording / "groundtruth.txt"
    poses.write_text("".join(poses.read_text().splitlines(keepends=True)[:-2]))
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--no-report", "--json")
    values = json.loads(outcome.stdout)
    assert (values["num_frames"], values["num_frames_without_pose"]) == (6, 2)
    assert "2 of 8 frames have no pose: 2 after the last pose" in outcome.stderr


def test_damaged_image_is_skipped_counted_and_reported(tmp_path):
    recording = write_recording(tmp_path / "stairs")
    damage_image(recording, 3)
    outcome = stairmap("run", recording, "-o", tmp_path / "out", "--no-report", "--json")
    assert outcome.code == 0
    assert "skipped 1 damaged frame" in outcome.stderr
    assert "000003.png" in outcome.stderr
    assert "000003.png" in (tmp_path / "out" / "summary.txt").read_text()
    values = json.loads(outcome.stdout)
    assert values["num_frames"] == 7
    assert len(values["stairways"]) == 1


def test_recording_without_a_readable_image_leaves_no_folder_behind(tmp_path):
    recording = write_recording(tmp_path / "stairs", num_frames=2)
    for index in range(2):
        damage_image(recording, index)
    check_refused(stairmap("run", recording, "-o", tmp_path / "out"), "none of the 2 images")
    assert not (tmp_path / "out").exists()


def test_missing_package_leaves_the_report_out_and_says_so(floor, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    outcome = stairmap("run", floor, "-o", tmp_path / "out")
    assert outcome.code == 0
    assert "report.html was left out" in outcome.stderr
    assert "stairmap[report]" in outcome.stderr
