"""Image folders that cannot be right are refused at opening, in one line that names the place."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from stairmap.errors import CalibrationError, RecordingError, StairmapError
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
