"""CameraInfo of ROS 1 and 2 becomes the camera of the rectified image."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError
from stairmap.recordings.camera_info import camera_from_info, find_camera_info_oddities

K = [500.0, 0, 320.5, 0, 510.0, 240.5, 0, 0, 1]
P = [501.0, 0, 321.5, 0, 0, 511.0, 241.5, 0, 0, 0, 1, 0]


def info(*, upper: bool = False, **changes: object) -> SimpleNamespace:
    fields = {"k": K, "d": [0.0] * 5, "p": [500.0, 0, 320.5, 0, 0, 510.0, 240.5, 0, 0, 0, 1, 0]}
    fields |= {name: value for name, value in changes.items() if name in fields}
    rest = {name: value for name, value in changes.items() if name not in fields}
    named = {name.upper() if upper else name: np.array(value) for name, value in fields.items()}
    size = {"width": 640, "height": 480, "binning_x": 0, "binning_y": 0}
    return SimpleNamespace(**(size | named | rest))


@pytest.mark.parametrize("upper", [False, True], ids=["ros2", "ros1"])
def test_both_spellings_give_the_camera(upper: bool) -> None:
    camera = camera_from_info(info(upper=upper), (640, 480))
    assert camera == PinholeCamera(width=640, height=480, fx=500.0, fy=510.0, cx=320.5, cy=240.5)


def test_projection_matrix_counts_for_it_belongs_to_the_rectified_image() -> None:
    camera = camera_from_info(info(p=P))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (501.0, 511.0, 321.5, 241.5)


def test_unset_projection_matrix_leaves_it_to_the_intrinsics() -> None:
    assert camera_from_info(info(p=[0.0] * 12)).fx == 500.0


def test_uncalibrated_camera_is_refused() -> None:
    with pytest.raises(CalibrationError, match="not calibrated"):
        camera_from_info(info(k=[0.0] * 9, p=[0.0] * 12))


def test_camera_of_another_size_is_refused_with_both_sizes() -> None:
    with pytest.raises(CalibrationError, match="640x480, but the depth images are 320x240"):
        camera_from_info(info(), (320, 240))


def test_normalised_focal_length_is_refused() -> None:
    with pytest.raises(CalibrationError, match="fx must be in pixels"):
        camera_from_info(info(p=[0.8, 0, 0.5, 0, 0, 0.8, 0.5, 0, 0, 0, 1, 0]))


def test_matrix_of_wrong_size_is_refused() -> None:
    with pytest.raises(CalibrationError, match="P must have 12 numbers, got 9"):
        camera_from_info(info(p=K))


def test_binning_and_region_give_the_same_rays() -> None:
    roi = SimpleNamespace(x_offset=40, y_offset=20, width=400, height=200)
    camera = camera_from_info(info(binning_x=2, binning_y=2, roi=roi), (200, 100))
    whole = camera_from_info(info())
    # Pixel (0, 0) of the binned region covers the full image's pixels (40..41, 20..21).
    ray = camera.unproject_pixels(np.array([0.0, 0.0]), np.array(1.0))
    assert ray == pytest.approx(whole.unproject_pixels(np.array([40.5, 20.5]), np.array(1.0)))


def test_distortion_is_noted_and_its_absence_is_not() -> None:
    assert find_camera_info_oddities(info()) == ()
    assert "distortion (up to 0.25)" in find_camera_info_oddities(info(d=[0.1, -0.25, 0.0, 0.0, 0.0]))[0]
    assert find_camera_info_oddities(info(d=[])) == ()
