"""A folder of a run that was killed gets the files that it lacks, and keeps those that it has."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.observation import Detection, Rejection
from stairmap.errors import ResultsError
from stairmap.export.finishing import finish_run_folder
from stairmap.export.history import HISTORY_FILE, history_values
from stairmap.export.loading import load_stairways
from stairmap.export.results import SUMMARY_FILE, SURFACE_FILE, TRAJECTORY_FILE, create_run_folder
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.trajectory import Trajectory

ALL = ("stairways.json", "summary.txt", "stairways.ply")


def killed_run(tmp_path, stairway, detections):
    with create_run_folder(tmp_path / "run", "hall") as folder:
        for stamp_ns, detection in enumerate(detections):
            folder.append_pose(stamp_ns * 10**9, np.eye(4))
            folder.append_detection(detection)
        folder.append_json(HISTORY_FILE, history_values(1, []))
        folder.append_json(HISTORY_FILE, history_values(2, [stairway]))
    return tmp_path / "run"


def nothing_found(*rules):
    rejections = tuple(Rejection(rule=rule, measured=1.0, limit=2.0, unit="m") for rule in rules)
    return Detection(stamp_ns=0, observations=(), rejections=rejections)


def test_a_killed_run_gets_its_last_stairways_summary_and_surface(tmp_path, stairway, detection):
    # A rule counts once in a frame, and not at all where stairs were found all the same.
    frames = [
        detection,
        detection,
        nothing_found("few_steps", "few_steps"),
        nothing_found("few_steps", "wall"),
    ]
    run = killed_run(tmp_path, stairway, [*frames, nothing_found("wall"), nothing_found("wall")])
    finished = finish_run_folder(run)
    assert finished.written == ALL
    results = load_stairways(run)
    assert results.is_finished
    assert [known.id for known in results.stairways] == [stairway.id]
    assert results.num_frames == 6
    text = (run / SUMMARY_FILE).read_text()
    assert "the run was killed after 6 frames" in text
    assert text.startswith("6 frames, stair edges seen in 2\n")
    assert text.index("wall in 3 frames") < text.index("few_steps in 2 frames")
    assert "up in" not in text
    assert (run / SURFACE_FILE).read_bytes().startswith(b"ply")
    assert finish_run_folder(run).written == ()


@pytest.mark.parametrize("name", [SUMMARY_FILE, SURFACE_FILE])
def test_a_file_that_is_there_is_left_alone(tmp_path, stairway, detection, name):
    run = killed_run(tmp_path, stairway, [detection])
    (run / name).write_text("mine")
    assert finish_run_folder(run).written == tuple(other for other in ALL if other != name)
    assert (run / name).read_text() == "mine"


@pytest.mark.parametrize("is_cut", [True, False])
def test_a_way_loses_its_last_line_only_where_that_was_cut_off(tmp_path, stairway, detection, is_cut):
    run = killed_run(tmp_path, stairway, [detection] * 3)
    path = run / TRAJECTORY_FILE
    before = path.read_bytes()
    path.write_bytes(before[:-30] if is_cut else before)
    assert (TRAJECTORY_FILE in finish_run_folder(run).written) is is_cut
    assert len(load_tum_trajectory(path)) == (2 if is_cut else 3)
    assert is_cut or path.read_bytes() == before


def test_a_run_that_came_to_its_end_lacks_nothing_but_what_was_taken_away(tmp_path, stairway):
    folder = create_run_folder(tmp_path / "run", "hall")
    folder.write_stairways([stairway], num_frames=7, frame_id="odom")
    folder.write_trajectory(Trajectory(stamps_ns=[0], map_from_camera=np.eye(4)[None]))
    before = (folder.path / "stairways.json").read_bytes()
    assert finish_run_folder(folder.path).written == ALL[1:]
    assert (folder.path / "stairways.json").read_bytes() == before


def test_a_folder_that_is_of_no_run_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(ResultsError, match="expected the folder of a run"):
            finish_run_folder(path)
