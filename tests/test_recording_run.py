"""A recording becomes a run folder, from Python as from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import stairmap.session
from small_recordings import write_recording
from stairmap.config import Config
from stairmap.export.building import load_building
from stairmap.export.loading import load_detections
from stairmap.export.results import create_run_folder
from stairmap.map_levelling import find_level_map
from stairmap.recording_run import RecordingRun
from stairmap.recordings.base import Recording
from stairmap.recordings.frame_iterators import placed_frames
from stairmap.recordings.open import open_recording
from stairmap.session import MapSession
from stairmap.trajectory import Trajectory


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return open_recording(write_recording(tmp_path_factory.mktemp("recordings") / "stairs"))


def new_run(recording: Recording) -> RecordingRun:
    return RecordingRun(recording, find_level_map(recording), config=Config())


def test_a_run_folder_holds_what_a_session_finds(recording: Recording, tmp_path: Path) -> None:
    run = new_run(recording)
    counts: list[int] = []
    with create_run_folder(tmp_path / "run", recording.name) as folder:
        run.process_frames(folder, on_frame=counts.append)
        outcome = run.outcome()
        run.write_results(folder, outcome)
    session = MapSession()
    for frame, map_from_camera in placed_frames(recording):
        session.add(frame, map_from_camera)
    expected = [stairway.to_dict() for stairway in session.stairways()]
    assert len(expected) == 1
    assert [stairway.to_dict() for stairway in outcome.stairways] == expected
    (written,) = json.loads((tmp_path / "run/stairways.json").read_text())["stairways"]
    assert written == json.loads(json.dumps(expected[0]))
    assert (outcome.num_frames, outcome.num_without_pose, outcome.was_stopped) == (8, 0, False)
    assert len(list(load_detections(tmp_path / "run"))) == 8
    assert len(counts) == 8
    assert counts[-1] == 1


def test_a_run_that_is_stopped_says_so(recording: Recording) -> None:
    run = new_run(recording)
    answers = iter([False, False, False, True])
    run.process_frames(should_stop=lambda: next(answers))
    outcome = run.outcome()
    assert outcome.was_stopped
    assert outcome.num_frames == 3
    assert outcome.problems == ("the run was interrupted after 3 frames",)


def test_a_full_map_ends_a_run_and_keeps_its_results(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stairmap.session, "MAX_OBSERVATIONS", 6)
    run = new_run(recording)
    run.process_frames()
    outcome = run.outcome()
    assert len(outcome.stairways) == 1
    assert outcome.stairways[0].num_observations == 6
    assert "the run ended early: the map holds 6 observations" in outcome.problems[-1]


def test_frames_without_a_pose_are_counted_and_not_looked_at(recording: Recording) -> None:
    level_map = find_level_map(recording)
    trajectory = level_map.trajectory
    few = Trajectory(stamps_ns=trajectory.stamps_ns[2:5], map_from_camera=trajectory.map_from_camera[2:5])
    assert [frame.stamp_ns for frame, _ in placed_frames(recording, few)] == few.stamps_ns.tolist()
    for (_, pose), expected in zip(placed_frames(recording, few), few.map_from_camera, strict=True):
        np.testing.assert_array_equal(pose, expected)


def test_what_a_run_tells_of_a_building(run_folder: Path) -> None:
    building = load_building(run_folder)
    (stairway,) = building.stairways
    assert [floor.level for floor in building.floors.floors] == [0, 1]
    assert building.floors.floors[1].height == pytest.approx(
        building.floors.floors[0].height + stairway.flights[0].rise * stairway.flights[0].num_risers, abs=0.05
    )
    assert building.trajectory is not None
    assert len(building.trajectory) == 8
    assert building.frame_id == json.loads((run_folder / "stairways.json").read_text())["frame_id"]
    assert load_building(run_folder / "stairways.json").trajectory is not None
