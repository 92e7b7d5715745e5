"""Image folders: good ones are read whole, bad ones are refused in one line, damaged images are skipped."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from stairmap.errors import CalibrationError, RecordingError, StairmapError, TrajectoryError
from stairmap.recordings.image_folder import ImageFolderRecording

MakeRecording = Callable[..., Path]


def _change_camera(folder: Path, change: dict[str, Any]) -> None:
    path = folder / "camera.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))


def _change_line(path: Path, line: int, text: str) -> None:
    lines = path.read_text().split("\n")
    lines[line - 1] = text
    path.write_text("\n".join(lines))


def _refusal(folder: Path, **options: Any) -> str:
    with pytest.raises(StairmapError) as caught:
        ImageFolderRecording(folder, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_good_recording_is_read_whole(make_recording: MakeRecording) -> None:
    recording = ImageFolderRecording(make_recording())
    frames = list(recording)
    assert recording.name == "walk"
    assert recording.frame_id == "map"
    assert [frame.stamp_ns for frame in frames] == [100_000_000_000 + 50_000_000 * i for i in range(4)]
    assert frames[3].depth[5, 5] == np.float32(2.003)
    assert np.isnan(frames[3].depth[0, 0])
    np.testing.assert_allclose([frame.up for frame in frames], [[0, -1, 0]] * 4, atol=1e-12)
    assert not recording.problems
    assert recording.problems.num_frames_without_pose == 0
    assert recording.check_poses() is recording.trajectory
    assert [frame.stamp_ns for frame in recording] == [frame.stamp_ns for frame in frames]


def test_tum_names_comments_and_windows_line_ends_are_read(make_recording: MakeRecording) -> None:
    folder = make_recording(num_frames=2)
    (folder / "depth" / "000000.png").rename(folder / "depth" / "1305031102.160407.png")
    (folder / "depth" / "000001.png").rename(folder / "depth" / "1305031102.194330.png")
    (folder / "depth.txt").write_bytes(
        b"# depth maps\r\n# file: 'rgbd.bag'\r\n# timestamp filename\r\n"
        b"1305031102.160407 depth/1305031102.160407.png\r\n1305031102.194330 depth/1305031102.194330.png\r\n"
    )
    (folder / "groundtruth.txt").write_bytes(
        b"# ground truth trajectory\r\n# timestamp tx ty tz qx qy qz qw\r\n"
        b"1305031102.1600 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986\r\n"
        b"1305031102.1758 1.3543 0.6306 1.6360 0.6129 0.5966 -0.3316 -0.3980\r\n"
    )
    _change_camera(folder, {"depth_scale": 5000})
    recording = ImageFolderRecording(folder)
    assert [frame.stamp_ns for frame in recording] == [1305031102160407000, 1305031102194330000]
    assert recording.problems.notes == ("1 of 2 frames have no pose: 1 after the last pose",)
    assert recording.problems.num_frames_without_pose == 1


@pytest.mark.parametrize("name", ["depth.txt", "camera.json"])
def test_a_missing_file_is_named(make_recording: MakeRecording, name: str) -> None:
    folder = make_recording()
    (folder / name).unlink()
    assert str(folder / name) in _refusal(folder)


@pytest.mark.parametrize("name", ["depth.txt", "camera.json", "groundtruth.txt"])
@pytest.mark.parametrize("data", [bytes(range(256)) * 4, b"\x89PNG\r\n\x1a\n\0\0", b"1 \0 2"])
def test_binary_garbage_is_refused(make_recording: MakeRecording, name: str, data: bytes) -> None:
    folder = make_recording()
    (folder / name).write_bytes(data)
    message = _refusal(folder)
    assert name in message
    assert "another kind of file" in message


def test_a_list_without_images_is_refused(make_recording: MakeRecording) -> None:
    folder = make_recording(num_frames=0)
    assert "it lists no image" in _refusal(folder)


def test_images_that_are_not_there_are_counted(make_recording: MakeRecording) -> None:
    folder = make_recording()
    (folder / "depth" / "000001.png").unlink()
    assert _refusal(folder).endswith(
        "depth.txt:3: 'depth/000001.png' is not there; restore it or delete the line"
    )
    (folder / "depth" / "000003.png").unlink()
    assert "depth.txt:3: 'depth/000001.png' is not there (nor are 1 more)" in _refusal(folder)


def test_a_folder_or_a_pipe_is_no_image(make_recording: MakeRecording) -> None:
    folder = make_recording()
    os.mkfifo(folder / "depth" / "pipe.png")
    for name in ("depth", "depth/pipe.png", "x" * 5000):
        _change_line(folder / "depth.txt", 3, f"100.05 {name}")
        assert "depth.txt:3: " in _refusal(folder)


@pytest.mark.parametrize("kind", ["parent", "absolute", "linked file", "linked folder"])
def test_images_outside_the_recording_are_refused(
    make_recording: MakeRecording, tmp_path: Path, kind: str
) -> None:
    folder = make_recording()
    outside = tmp_path / "outside"
    outside.mkdir()
    (folder / "depth" / "000001.png").rename(outside / "000001.png")
    name = {
        "parent": "../outside/000001.png",
        "absolute": str(outside / "000001.png"),
        "linked file": "depth/linked.png",
        "linked folder": "linked/000001.png",
    }[kind]
    (folder / "depth" / "linked.png").symlink_to(outside / "000001.png")
    (folder / "linked").symlink_to(outside)
    _change_line(folder / "depth.txt", 3, f"100.05 {name}")
    message = _refusal(folder)
    assert "depth.txt:3: " in message
    assert "lies outside the recording" in message


def test_links_within_the_recording_and_to_it_are_followed(
    make_recording: MakeRecording, tmp_path: Path
) -> None:
    folder = make_recording()
    (folder / "depth" / "linked.png").symlink_to("000001.png")
    _change_line(folder / "depth.txt", 3, "100.05 depth/../depth/linked.png")
    (tmp_path / "link").symlink_to(folder)
    assert len(list(ImageFolderRecording(tmp_path / "link"))) == 4


@pytest.mark.parametrize(
    ("image", "extension", "message"),
    [
        (np.zeros((24, 32), np.uint8), ".png", "16-bit single-channel PNG, got 8-bit grey"),
        (np.zeros((24, 32, 3), np.uint8), ".png", "got 8-bit RGB; is it a colour image"),
        (np.zeros((24, 32), np.uint8), ".jpg", "got JPEG"),
        (np.zeros((12, 32), np.uint16), ".png", "is 32x12, but the camera file says 32x24"),
    ],
)
def test_another_kind_or_size_of_image_is_refused_at_once(
    make_recording: MakeRecording, image: np.ndarray, extension: str, message: str
) -> None:
    folder = make_recording()
    (folder / "depth" / "000003.png").write_bytes(cv2.imencode(extension, image)[1].tobytes())
    refusal = _refusal(folder)
    assert "depth.txt:5: depth/000003.png" in refusal
    assert message in refusal


def test_a_damaged_image_is_skipped_and_reported(
    make_recording: MakeRecording, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = make_recording(num_frames=6)
    image = folder / "depth" / "000002.png"
    data = image.read_bytes()
    image.write_bytes(data[: len(data) // 2])
    (folder / "depth" / "000003.png").write_bytes(b"")
    (folder / "depth" / "000004.png").write_bytes(data[:60] + b"garbage" + data[67:])
    recording = ImageFolderRecording(folder)
    for _ in range(2):
        assert [frame.stamp_ns for frame in recording] == [100_000_000_000, 100_050_000_000, 100_250_000_000]
        assert [(frame.source, frame.reason) for frame in recording.problems.skipped] == [
            ("depth/000002.png", "the file is cut off"),
            ("depth/000003.png", "the file is empty"),
            ("depth/000004.png", "the image data are corrupt"),
        ]
    assert recording.problems
    assert recording.problems.to_lines(max_skipped=1) == (
        "skipped 3 damaged frames:",
        "  depth/000002.png at 100.100000 s: the file is cut off",
        "  and 2 more",
    )
    assert capfd.readouterr().err == ""


def test_a_file_that_vanishes_while_reading_is_skipped(make_recording: MakeRecording) -> None:
    recording = ImageFolderRecording(make_recording())
    frames = iter(recording)
    next(frames)
    (recording._folder / "depth" / "000002.png").unlink()
    assert len(list(frames)) == 2
    assert [frame.reason for frame in recording.problems.skipped] == [
        "cannot be read: No such file or directory"
    ]


def test_a_recording_of_damaged_images_only_is_an_error(make_recording: MakeRecording) -> None:
    folder = make_recording(num_frames=2)
    for image in (folder / "depth").iterdir():
        image.write_bytes(image.read_bytes()[:50])
    recording = ImageFolderRecording(folder)
    with pytest.raises(
        RecordingError, match=r"none of the 2 images of .* the first: depth/000000.png at 100"
    ):
        list(recording)


def test_an_image_without_any_depth_is_a_frame(make_recording: MakeRecording) -> None:
    folder = make_recording()
    blank = cv2.imencode(".png", np.zeros((24, 32), np.uint16))[1].tobytes()
    (folder / "depth" / "000000.png").write_bytes(blank)
    frames = list(ImageFolderRecording(folder))
    assert len(frames) == 4
    assert np.isnan(frames[0].depth).all()


def test_a_wrong_depth_scale_is_told_at_opening(make_recording: MakeRecording) -> None:
    folder = make_recording()
    _change_camera(folder, {"depth_scale": 1})
    with pytest.raises(CalibrationError, match=r"camera.json: .* got 200\d m .* likely depth_scale is 1000"):
        ImageFolderRecording(folder)


@pytest.mark.parametrize(
    ("name", "line", "text", "message"),
    [
        ("depth.txt", 3, "100.0 depth/000001.png", "depth.txt:3: .*the same as that of line 2"),
        ("depth.txt", 3, "99 depth/000001.png", "depth.txt:3: .*before that of line 2"),
        ("depth.txt", 3, "100.05", "depth.txt:3: expected 2 columns"),
        ("depth.txt", 3, "nan depth/000001.png", "depth.txt:3: expected a stamp"),
        ("groundtruth.txt", 3, "100.05 0 0 0 0 0 0 2", "groundtruth.txt:3: .*unit quaternion"),
        ("groundtruth.txt", 3, "100.0 0 0 0 0 0 0 1", "groundtruth.txt:3: .*the same"),
        ("groundtruth.txt", 3, "100.05 nan 0 0 0 0 0 1", "groundtruth.txt:3: .*finite"),
    ],
)
def test_malformed_lists_are_refused(
    make_recording: MakeRecording, name: str, line: int, text: str, message: str
) -> None:
    folder = make_recording()
    _change_line(folder / name, line, text)
    with pytest.raises(RecordingError, match=message):
        ImageFolderRecording(folder)


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


@pytest.mark.parametrize(
    ("name", "num_frames", "has_poses"),
    [
        ("kinect_v2_test_stairs", 1, False),
        ("no_stairs_kitchen_kinect_v1", 100, True),
        ("no_stairs_lab_floor_realsense", 50, False),
        ("no_stairs_objects_realsense", 5, False),
        ("xtion_two_steps_close", 1, False),
    ],
)
def test_real_recordings_are_read_whole(
    shared_data: Path, name: str, num_frames: int, has_poses: bool
) -> None:
    folder = shared_data / "real" / name
    if not folder.is_dir():
        pytest.skip(f"no real recording at {folder}")
    recording = ImageFolderRecording(folder)
    frames = list(recording)
    assert len(frames) == recording.num_frames == num_frames
    assert (recording.trajectory is not None) == has_poses
    assert not recording.problems
    for frame in frames:
        assert 0.3 < np.nanmedian(frame.depth) < 5
        assert (frame.up is not None) == (has_poses or name == "kinect_v2_test_stairs")
