"""Run folders read back for viewers."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from command_line import stairmap
from small_recordings import STAIRS, write_recording
from stairmap.errors import RecordingError
from stairmap.export.loading import ResultsError, load_stairways
from stairmap.visualization.run_replay import load_run, show_run


class Notebook:
    """Notes what a view is shown."""

    def __init__(self):
        self.frames, self.stairways, self.is_closed = [], [], False

    def show_frame(self, view):
        self.frames.append(view)

    def show_stairways(self, stairways, number, stamp_ns):
        self.stairways.append((number, stamp_ns, stairways))

    def close(self):
        self.is_closed = True


@pytest.fixture
def copied_run(run_folder, tmp_path):
    return shutil.copytree(run_folder, tmp_path / "run")


def test_frames_come_with_depth_pose_and_stair_edges_of_the_staircase(run_folder):
    replay = load_run(run_folder)
    frames = list(replay.frames())
    assert [view.number for view in frames] == list(range(8))
    assert replay.notes == ()
    for view in frames:
        assert view.frame.stamp_ns == view.stamp_ns
        assert np.allclose(view.map_from_camera[:3, 3], replay.positions[view.number])
        heights = view.map_edges()[..., 2]
        assert np.abs(heights / STAIRS.rise - np.round(heights / STAIRS.rise)).max() < 0.2


def test_every_second_frame_keeps_its_number(run_folder):
    assert [view.number for view in load_run(run_folder).frames(every=3)] == [0, 3, 6]


def test_stairways_are_shown_as_they_were_known_and_the_result_last(run_folder):
    replay, notebook = load_run(run_folder), Notebook()
    show_run(replay, [notebook])
    assert notebook.is_closed
    stamps = [stamp_ns for _, stamp_ns, _ in notebook.stairways]
    assert stamps == sorted(stamps)
    assert len(stamps) >= 2
    (saved,) = load_stairways(run_folder).stairways
    assert [stairway.to_dict() for stairway in notebook.stairways[-1][2]] == [saved.to_dict()]
    earlier, result = notebook.stairways[0][2][0], notebook.stairways[-1][2][0]
    assert earlier.num_observations < result.num_observations


def test_recording_that_has_moved_costs_the_depth_alone(copied_run, run_folder, tmp_path):
    (copied_run / "recording.json").write_text('{"path": "/nowhere/stairs", "options": {}}')
    replay = load_run(copied_run)
    assert replay.recording is None
    assert "/nowhere/stairs" in replay.notes[0]
    assert "--recording" in replay.notes[0]
    frames = list(replay.frames(every=2))
    assert [view.number for view in frames] == [0, 2, 4, 6]
    assert all(view.frame is None and len(view.map_edges()) for view in frames)
    found = load_run(copied_run, recording=run_folder.parent / "stairs")
    assert all(view.frame is not None for view in found.frames())


def test_run_folder_of_an_older_version_asks_for_the_recording(copied_run):
    (copied_run / "recording.json").unlink()
    (copied_run / "history.jsonl").unlink()
    replay = load_run(copied_run)
    assert "--recording PATH" in replay.notes[0]
    assert replay.history == ()
    assert len(replay.stairways) == 1


def test_killed_run_shows_the_last_stairways_that_it_knew(copied_run):
    for name in ("stairways.json", "trajectory.tum", "config.yaml", "summary.txt"):
        (copied_run / name).unlink()
    replay = load_run(copied_run)
    assert "the run did not end" in replay.notes[0]
    assert len(replay.stairways) == 1
    assert len(list(replay.frames())) == 8


def test_frames_looked_at_one_by_one_stand_in_a_level_frame_of_their_own(tmp_path):
    recording = write_recording(tmp_path / "stairs", num_frames=2, has_poses=False)
    assert stairmap("detect", recording, "-o", tmp_path / "out", "--no-overlays").code == 0
    replay, notebook = load_run(tmp_path / "out"), Notebook()
    show_run(replay, [notebook])
    assert replay.trajectory is None
    assert len(notebook.frames) == 2
    assert notebook.stairways == []
    assert np.allclose(notebook.frames[0].map_from_camera[:3, 3], 0)


@pytest.mark.parametrize("name", ["", "stairways.json", "detections.jsonl"])
def test_a_file_of_the_folder_stands_for_it(run_folder, name):
    assert load_run(run_folder / name).num_frames == 8


def test_what_is_no_run_folder_is_refused(tmp_path):
    with pytest.raises(ResultsError, match=r"holds neither stairways\.json nor detections\.jsonl"):
        load_run(tmp_path)
    with pytest.raises(ResultsError, match="there is no"):
        load_run(tmp_path / "nowhere")


def test_recording_that_is_named_wrongly_is_refused(run_folder, tmp_path):
    with pytest.raises(RecordingError, match="check --recording"):
        load_run(run_folder, recording=tmp_path / "nowhere")
