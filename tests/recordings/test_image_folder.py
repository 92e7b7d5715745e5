"""Image folders: good ones are read whole, damaged images are skipped and reported."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from stairmap.errors import RecordingError
from stairmap.recordings.image_folder import ImageFolderRecording

MakeRecording = Callable[..., Path]


def _change_camera(folder: Path, change: dict[str, Any]) -> None:
    path = folder / "camera.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))


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


def test_links_within_the_recording_and_to_it_are_followed(
    make_recording: MakeRecording, tmp_path: Path
) -> None:
    folder = make_recording()
    (folder / "depth" / "linked.png").symlink_to("000001.png")
    listed = (folder / "depth.txt").read_text()
    (folder / "depth.txt").write_text(listed.replace("depth/000001.png", "depth/../depth/linked.png"))
    (tmp_path / "link").symlink_to(folder)
    assert len(list(ImageFolderRecording(tmp_path / "link"))) == 4


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
    image = recording._folder / "depth" / "000002.png"
    image.unlink()
    assert len(list(frames)) == 2
    assert [frame.reason for frame in recording.problems.skipped] == [
        f"cannot read {image.resolve()}: No such file or directory"
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
