"""Which frames have a pose, and which way is up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stairmap.errors import StairmapError, TrajectoryError
from stairmap.recordings.image_folder import ImageFolderRecording

MakeRecording = Callable[..., Path]


def _refusal(folder: Path, **options: Any) -> str:
    with pytest.raises(StairmapError) as caught:
        ImageFolderRecording(folder, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_recording_without_poses_can_be_looked_at_but_not_mapped(make_recording: MakeRecording) -> None:
    recording = ImageFolderRecording(make_recording(with_poses=False))
    assert [frame.up for frame in recording] == [None] * 4
    assert recording.trajectory is None
    assert recording.problems.num_frames_without_pose == 4
    with pytest.raises(
        TrajectoryError, match=r"groundtruth.txt or trajectory.txt, found neither; pass --traj"
    ):
        recording.check_poses()


def test_poses_of_another_time_are_told(make_recording: MakeRecording) -> None:
    folder = make_recording()
    (folder / "groundtruth.txt").write_text("7 0 0 0 0 0 0 1\n7.05 0 0 0 0 0 0 1\n")
    recording = ImageFolderRecording(folder)
    assert len(list(recording)) == 4
    with pytest.raises(
        TrajectoryError,
        match=r"4 of 4 frames have no pose: 4 after the last pose; images run from 100.000 to 100.150 s, "
        r"poses from 7.000 to 7.050 s; give poses of the same clock",
    ):
        recording.check_poses()


def test_frames_in_a_gap_are_given_without_a_pose(make_recording: MakeRecording) -> None:
    folder = make_recording(num_frames=8)
    poses = (folder / "groundtruth.txt").read_text().split("\n")
    (folder / "groundtruth.txt").write_text("\n".join([*poses[:3], *poses[6:]]))
    recording = ImageFolderRecording(folder)
    frames = list(recording)
    assert [frame.up is None for frame in frames] == [False, False, True, True, True, False, False, False]
    has_pose = recording.check_poses().has_pose(np.array([frame.stamp_ns for frame in frames]))
    assert has_pose.tolist() == [True, True, False, False, False, True, True, True]
    assert recording.problems.to_lines() == (
        "3 of 8 frames have no pose: 3 between poses more than 0.1 s apart",
    )


def test_another_trajectory_replaces_the_folders_own(make_recording: MakeRecording, tmp_path: Path) -> None:
    folder = make_recording()
    other = tmp_path / "slam.tum"
    other.write_text("100 7 0 0 0 0 0 1\n100.1 7 0 0 0 0 0 1\n")
    trajectory = ImageFolderRecording(folder, trajectory=other).trajectory
    assert trajectory is not None
    assert trajectory.map_from_camera[:, 0, 3].tolist() == [7, 7]
    assert "cannot read" in _refusal(folder, trajectory=tmp_path / "none.tum")


def test_of_two_pose_files_the_one_used_is_named(make_recording: MakeRecording) -> None:
    folder = make_recording()
    (folder / "trajectory.txt").write_text("100 7 0 0 0 0 0 1\n")
    recording = ImageFolderRecording(folder)
    assert recording.problems.notes == (
        "poses are those of groundtruth.txt; for trajectory.txt pass --trajectory",
    )
    (folder / "groundtruth.txt").unlink()
    recording = ImageFolderRecording(folder)
    assert recording.trajectory is not None
    assert recording.trajectory.map_from_camera[0, 0, 3] == 7


@pytest.mark.parametrize("up", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_the_named_axis_of_the_map_becomes_z(make_recording: MakeRecording, up: str) -> None:
    folder = make_recording()
    level = ImageFolderRecording(folder).check_poses()
    recording = ImageFolderRecording(folder, up=up)
    turned = recording.check_poses()
    np.testing.assert_allclose(
        turned.map_from_camera, recording.map_from_recorded @ level.map_from_camera, atol=1e-12
    )
    axis = "xyz".index(up[1])
    sign = 1 if up[0] == "+" else -1
    for frame in recording:
        assert frame.up is not None
        np.testing.assert_allclose(frame.up, sign * level.pose_at(frame.stamp_ns)[axis, :3], atol=1e-12)


def test_auto_leaves_up_to_the_floor(make_recording: MakeRecording) -> None:
    folder = make_recording(up=[0, -1, 0])
    recording = ImageFolderRecording(folder, up="auto")
    assert [frame.up for frame in recording] == [None] * 4
    np.testing.assert_array_equal(recording.map_from_recorded, np.eye(4))


def test_an_axis_of_no_map_is_refused(make_recording: MakeRecording) -> None:
    folder = make_recording(with_poses=False)
    assert "--up +y names an axis of the map, but" in _refusal(folder, up="+y")
    assert "expected --up to be one of" in _refusal(folder, up="y")
    assert len(list(ImageFolderRecording(folder, up="auto"))) == 4


def test_up_of_the_camera_file_serves_frames_without_pose(make_recording: MakeRecording) -> None:
    folder = make_recording(up=[0.0, -4.0, -3.0], with_poses=False)
    for frame in ImageFolderRecording(folder):
        assert frame.up is not None
        np.testing.assert_allclose(frame.up, [0, -0.8, -0.6])


def test_up_of_the_map_that_contradicts_the_camera_is_noted(make_recording: MakeRecording) -> None:
    folder = make_recording(up=[0.0, 0.0, -1.0])
    (note,) = ImageFolderRecording(folder).problems.notes
    assert "differ by 90 degrees at the first pose" in note
