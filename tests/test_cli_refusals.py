"""Bad input: one clear line on stderr, the right exit code, nothing on stdout, no traceback, no folder."""

from __future__ import annotations

import json
import shutil

import cv2
import numpy as np
import pytest

from command_line import check_refused, stairmap
from small_recordings import write_recording


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "floor", num_frames=3, has_stairs=False)


@pytest.fixture
def recording(original, tmp_path):
    return shutil.copytree(original, tmp_path / "floor")


def replace_text(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def change_camera(recording, **changes):
    path = recording / "camera.json"
    values = json.loads(path.read_text()) | changes
    path.write_text(json.dumps({key: value for key, value in values.items() if value is not None}))


def list_missing_image(recording):
    replace_text(recording / "depth.txt", "000001.png", "000009.png")


def list_image_outside(recording):
    shutil.copy(recording / "depth/000001.png", recording.parent / "secret.png")
    replace_text(recording / "depth.txt", "depth/000001.png", "../secret.png")


def write_8_bit_image(recording):
    cv2.imwrite(str(recording / "depth/000001.png"), np.full((240, 320), 200, np.uint8))


def write_color_image(recording):
    cv2.imwrite(str(recording / "depth/000001.png"), np.full((240, 320, 3), 200, np.uint16))


def repeat_stamp(recording):
    replace_text(recording / "depth.txt", "0.200000000", "0.100000000")


def turn_stamps_back(recording):
    replace_text(recording / "groundtruth.txt", "0.200000000", "0.050000000")


def spoil_pose(recording, position, text):
    path = recording / "groundtruth.txt"
    lines = path.read_text().splitlines()
    cells = lines[1].split()
    cells[position] = text
    path.write_text("\n".join([lines[0], " ".join(cells), *lines[2:]]) + "\n")


CASES = {
    "image not there": (list_missing_image, ("depth.txt:3", "000009.png", "not there")),
    "image outside the folder": (list_image_outside, ("depth.txt:3", "secret.png")),
    "8-bit image": (write_8_bit_image, ("depth.txt:3", "16")),
    "colour image": (write_color_image, ("depth.txt:3", "channel")),
    "other image size": (lambda folder: change_camera(folder, width=640), ("640x240", "320x240")),
    "zero focal length": (lambda folder: change_camera(folder, fx=0), ("camera.json", "fx")),
    "negative focal length": (lambda folder: change_camera(folder, fy=-262.5), ("camera.json", "fy")),
    "focal length not finite": (
        lambda folder: change_camera(folder, fx=float("inf")),
        ("camera.json", "Infinity"),
    ),
    "no depth scale": (lambda folder: change_camera(folder, depth_scale=None), ("depth_scale", "1000")),
    "depth in another unit": (
        lambda folder: change_camera(folder, depth_scale=1),
        ("likely depth_scale is 1000",),
    ),
    "stamp twice": (repeat_stamp, ("depth.txt:4", "0.100000000", "the same")),
    "stamps that go back": (turn_stamps_back, ("groundtruth.txt:4", "before")),
    "quaternion not of unit length": (lambda folder: spoil_pose(folder, 7, "3.0"), (":2", "quaternion")),
    "pose not a number": (lambda folder: spoil_pose(folder, 1, "nan"), (":2", "nan")),
    "no poses": (lambda folder: (folder / "groundtruth.txt").unlink(), ("--trajectory", "stairmap detect")),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_recording_gets_one_line_and_exit_code_1(name, recording, tmp_path):
    spoil, words = CASES[name]
    spoil(recording)
    check_refused(stairmap("run", recording, "-o", tmp_path / "out"), *words)
    assert not (tmp_path / "out").exists()


def test_missing_folder_is_refused(tmp_path):
    for command in ("run", "detect", "inspect"):
        check_refused(stairmap(command, tmp_path / "nowhere"), "nowhere", "check the path")


def test_file_instead_of_a_recording_is_refused(recording):
    check_refused(stairmap("detect", recording / "depth.txt"), "pass")


def test_missing_trajectory_file_is_refused(recording, tmp_path):
    check_refused(stairmap("run", recording, "--trajectory", tmp_path / "slam.tum"), "slam.tum")


def test_unknown_config_key_names_the_nearest(recording):
    check_refused(
        stairmap("run", recording, "--set", "detection.max_dept=4"), "did you mean detection.max_depth?"
    )
    check_refused(stairmap("config", "--set", "envelope.min_rise=cheese"), "envelope.min_rise", "cheese")


def test_missing_config_file_is_refused(recording, tmp_path):
    check_refused(stairmap("detect", recording, "--config", tmp_path / "none.yaml"), "none.yaml")


def test_output_that_cannot_be_written_is_refused(recording, tmp_path):
    (tmp_path / "file").write_text("")
    for command in ("run", "detect"):
        check_refused(stairmap(command, recording, "-o", tmp_path / "file"), "is a file")
        check_refused(stairmap(command, recording, "-o", tmp_path / "file" / "out"), "cannot write")


def test_floor_that_does_not_tell_up_is_refused(recording, tmp_path):
    for image in (recording / "depth").iterdir():
        cv2.imwrite(str(image), np.full((240, 320), 2000, np.uint16))
    check_refused(
        stairmap("run", recording, "--up=auto", "-o", tmp_path / "out"),
        "of 3 frames 0 show a floor",
        "--up=-y",
    )


def test_wrong_usage_is_exit_code_2(recording):
    for arguments in (
        ("run",),
        ("run", recording, "--method", "magic"),
        ("run", recording, "--up=z"),
        ("run", recording, "--robot-that-flies"),
        ("inspect", recording, "-o", "frame.png"),
        ("simulate", "no_such_scene", "-o", "out"),
        ("simulate", "davis_rear", "-o", "out", "--sensor", "eye"),
        ("fly",),
    ):
        outcome = stairmap(*arguments)
        assert outcome.code == 2
        assert outcome.stdout == ""


def test_debug_shows_where_an_error_came_from(tmp_path):
    outcome = stairmap("run", tmp_path / "nowhere", "--debug")
    assert outcome.code == 1
    assert "Traceback" in outcome.stderr
    assert "RecordingError" in outcome.stderr
