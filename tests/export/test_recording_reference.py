"""``recording.json``: a run finds its recording again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from small_recordings import write_recording
from stairmap.errors import RecordingError
from stairmap.export.loading import ResultsError
from stairmap.export.recording_reference import (
    RECORDING_FILE,
    RecordingReference,
    load_recording_reference,
)
from stairmap.recordings.bag_options import BagOptions


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "stairs", num_frames=2)


def dump(reference, folder):
    (folder / RECORDING_FILE).write_text(reference.to_json())


def test_recording_is_found_from_another_working_directory(recording, tmp_path, monkeypatch):
    monkeypatch.chdir(recording.parent)
    dump(RecordingReference.from_arguments(recording.relative_to(recording.parent), up=None), tmp_path)
    monkeypatch.chdir(tmp_path)
    opened = load_recording_reference(tmp_path).open()
    assert opened.num_frames == 2


def test_recording_is_opened_with_the_options_of_the_run(recording, tmp_path):
    poses = tmp_path / "slam.tum"
    poses.write_bytes((recording / "groundtruth.txt").read_bytes())
    dump(RecordingReference.from_arguments(recording, trajectory=poses, up="-y"), tmp_path)
    opened = load_recording_reference(tmp_path).open()
    assert not np.allclose(opened.map_from_recorded, np.eye(4))


def test_recording_that_has_moved_is_named_with_the_remedy(recording, tmp_path):
    dump(RecordingReference(path=tmp_path / "gone"), tmp_path)
    with pytest.raises(RecordingError, match=r"not at .*gone any more; pass --recording PATH"):
        load_recording_reference(tmp_path).open()


def test_older_run_folder_has_no_reference(tmp_path):
    assert load_recording_reference(tmp_path) is None


@pytest.mark.parametrize("text", ["{", "[]", '{"path": 3}', '{"path": "a", "options": 5}'])
def test_reference_that_stairmap_did_not_write_is_refused(tmp_path, text):
    (tmp_path / RECORDING_FILE).write_text(text)
    with pytest.raises(ResultsError, match=r"recording\.json"):
        load_recording_reference(tmp_path)


def test_options_of_a_bag_come_back_as_they_were_given(recording, tmp_path, monkeypatch):
    """Those that were not given are left out; a path is absolute and a path again."""
    monkeypatch.chdir(tmp_path)
    bag = BagOptions(depth_topic="/depth", camera_file=Path("camera.json"), map_frame="odom")
    reference = RecordingReference.from_arguments(recording, bag=bag)
    assert reference.options == {
        "depth_topic": "/depth", "camera_file": str(tmp_path.resolve() / "camera.json"), "map_frame": "odom"
    }  # fmt: skip
    dump(reference, tmp_path)
    loaded = load_recording_reference(tmp_path)
    assert loaded == reference
    asked = {}
    monkeypatch.setattr(
        "stairmap.export.recording_reference.open_recording",
        lambda path, **options: asked.update(path=path, **options),
    )
    loaded.open()
    given = replace(bag, camera_file=tmp_path.resolve() / "camera.json")
    assert asked == {
        "path": recording.resolve(), "trajectory": None, "up": None, "pose_format": None, "bag": given
    }  # fmt: skip


def test_a_trajectory_that_is_not_there_any_more_is_left_out(recording, tmp_path):
    poses = tmp_path / "slam.tum"
    poses.write_bytes((recording / "groundtruth.txt").read_bytes())
    reference = RecordingReference.from_arguments(recording, trajectory=poses)
    poses.unlink()
    assert reference.open().num_frames == 2


def test_poses_from_depth_are_those_of_the_run_folder_wherever_it_lies(recording, tmp_path, monkeypatch):
    """A batch writes the folder elsewhere first, and users move it."""
    folder = tmp_path / "made"
    folder.mkdir()
    monkeypatch.chdir(tmp_path)
    dump(RecordingReference.from_arguments(recording, up="-y", with_odometry=True), folder)
    (folder / "trajectory.tum").write_bytes((recording / "groundtruth.txt").read_bytes())
    moved = folder.rename(tmp_path / "moved")
    reference = load_recording_reference(moved)
    assert reference.options == {"trajectory": str(moved / "trajectory.tum")}
    (recording / "groundtruth.txt").rename(tmp_path / "kept.txt")
    try:
        opened = reference.open()
    finally:
        (tmp_path / "kept.txt").rename(recording / "groundtruth.txt")
    assert opened.trajectory is not None and np.allclose(opened.map_from_recorded, np.eye(4))
