"""camera.json: everything that can be wrong with it is told in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError
from stairmap.recordings.camera_file import CameraFile, dump_camera_file, load_camera, load_camera_file

GOOD = {"width": 640, "height": 480, "fx": 585, "fy": 585.5, "cx": 320, "cy": 240, "depth_scale": 1000.0}


def _write(folder: Path, values: Any) -> Path:
    path = folder / "camera.json"
    path.write_text(values if isinstance(values, str) else json.dumps(values))
    return path


def test_a_good_file_is_read(tmp_path: Path) -> None:
    contents = load_camera_file(_write(tmp_path, GOOD | {"up": [0, -9.81, 0]}))
    assert contents.camera == PinholeCamera(width=640, height=480, fx=585, fy=585.5, cx=320, cy=240)
    assert contents.depth_scale == 1000
    assert contents.up is not None
    np.testing.assert_allclose(contents.up, [0, -1, 0])
    assert contents.notes == ()


def test_the_file_survives_writing(tmp_path: Path) -> None:
    camera = PinholeCamera(width=np.int64(64), height=48, fx=np.float32(50.125), fy=51.3, cx=31.5, cy=0.1)
    path = tmp_path / "camera.json"
    dump_camera_file(path, CameraFile(camera=camera, depth_scale=5000.0, up=np.array([0.0, -0.6, -0.8])))
    contents = load_camera_file(path)
    assert contents.camera == camera
    assert contents.depth_scale == 5000
    assert contents.up is not None
    np.testing.assert_allclose(contents.up, [0, -0.6, -0.8], rtol=0, atol=1e-15)


def test_a_byte_order_mark_and_a_whole_float_do_not_matter(tmp_path: Path) -> None:
    path = tmp_path / "camera.json"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps(GOOD | {"width": 640.0}).encode())
    assert load_camera_file(path).camera.width == 640


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fx": 0}, "fx: should be greater than 0, got 0"),
        ({"fy": -585}, "fy: should be greater than 0, got -585"),
        ({"fx": float("nan")}, "NaN is no number of JSON"),
        ({"cx": float("inf")}, "Infinity is no number of JSON"),
        ({"cy": 10**400}, "cy: should be a"),
        ({"fx": "585"}, "fx: should be a valid number, got '585'"),
        ({"fx": True}, "fx: should be a valid number, got True"),
        ({"fx": None}, "fx: should be a valid number, got None"),
        ({"fx": 0.9}, "fx: should be in pixels, got 0.9"),
        ({"width": 0}, "width: should be greater than 0, got 0"),
        ({"height": -1}, "height: should be greater than 0"),
        ({"width": 640.5}, "width: should be a valid integer, got 640.5"),
        ({"width": float("nan")}, "NaN is no number"),
        ({"depth_scale": 0}, "depth_scale: should be greater than 0, got 0"),
        ({"depth_scale": -1000}, "depth_scale: should be greater than 0"),
        ({"depth_scale": 1e7}, "depth_scale: should be less than or equal to 1000000"),
        ({"depth_scale": "mm"}, "depth_scale: should be a valid number"),
        ({"up": [0, 0, 0]}, "up: a direction needs a finite length above zero"),
        ({"up": [0, 1e9, 0]}, "up.1: should be less than"),
        ({"up": [0, -1]}, "up: list should have at least 3 items"),
        ({"up": "-y"}, "up: should be a valid list"),
        ({"up": [0, "-1", 0]}, "up.1: should be a valid number, got '-1'"),
    ],
)
def test_impossible_values_are_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = _write(tmp_path, GOOD | change)
    with pytest.raises(CalibrationError, match=message) as caught:
        load_camera_file(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["width", "height", "fx", "fy", "cx", "cy"])
def test_a_missing_key_is_named(tmp_path: Path, key: str) -> None:
    values = {name: value for name, value in GOOD.items() if name != key}
    with pytest.raises(CalibrationError, match=f"expected the key '{key}'; it must hold width, height"):
        load_camera_file(_write(tmp_path, values))


def test_a_missing_depth_scale_says_what_is_usual(tmp_path: Path) -> None:
    values = {name: value for name, value in GOOD.items() if name != "depth_scale"}
    with pytest.raises(CalibrationError, match="1000 for images in millimetres, 5000 for TUM"):
        load_camera_file(_write(tmp_path, values))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("depth_scale", "depthScale"),
        ("depth_scale", "depth_scal"),
        ("fx", "f_x"),
        ("width", "widht"),
        ("height", "Height"),
    ],
)
def test_a_misspelt_key_is_found(tmp_path: Path, right: str, wrong: str) -> None:
    values = {(wrong if name == right else name): value for name, value in GOOD.items()}
    with pytest.raises(CalibrationError, match=f"expected the key '{right}', found '{wrong}'; rename it"):
        load_camera_file(_write(tmp_path, values))


def test_a_misspelt_up_is_not_ignored(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="expected the key 'up', found 'Up'"):
        load_camera_file(_write(tmp_path, GOOD | {"Up": [0, -1, 0]}))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gravity": [0, 1, 0]}, "the key 'gravity' is not used"),
        ({"width": 320, "height": 240}, r"principal point \(320, 240\) lies outside the image of 320x240"),
        ({"up": [0, 0.9, 0.4]}, "is it gravity"),
    ],
)
def test_what_looks_strange_is_noted(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    (note,) = load_camera_file(_write(tmp_path, GOOD | change)).notes
    assert re.search(message, note)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"width": 640,\n "height" 480}', r"camera.json:2: expected JSON"),
        ("", r"camera.json:1: expected JSON"),
        ("[" * 100_000, "expected JSON"),
        ('{"fx": ' + "9" * 5000 + "}", "expected JSON|must hold"),
        ("[640, 480]", "expected an object with width, height"),
        ("{}", "expected the key 'width'"),
    ],
)
def test_what_is_no_camera_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CalibrationError, match=message) as caught:
        load_camera_file(_write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_binary_garbage_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "camera.json"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(CalibrationError, match="UTF-8 text"):
        load_camera_file(path)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"expected .*camera.json with the keys width, height"):
        load_camera_file(tmp_path / "camera.json")


def test_the_camera_alone_is_that_of_the_file(tmp_path: Path) -> None:
    path = _write(tmp_path, GOOD)
    assert load_camera(path) == load_camera_file(path).camera
