"""Cameras look where they are told to."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.simulation.viewpoints import look_along, look_at
from stairmap.transforms import invert_transform, transform_points

CAMERA = PinholeCamera(width=101, height=81, fx=90, fy=90, cx=50, cy=40)


def pixel_of(pose: np.ndarray, point: tuple[float, float, float]) -> np.ndarray:
    return CAMERA.project(transform_points(invert_transform(pose), np.array(point)))


def test_what_is_aimed_at_is_in_the_middle_and_up_is_up() -> None:
    pose = look_at([1.0, -2.0, 0.4], [3.0, 1.0, 1.2])
    np.testing.assert_allclose(pixel_of(pose, (3.0, 1.0, 1.2)), [50, 40], atol=1e-9)
    u, v = pixel_of(pose, (3.0, 1.0, 1.3))
    assert (u, v < 40) == (pytest.approx(50), True)
    np.testing.assert_allclose(pose[:3, 3], [1.0, -2.0, 0.4])


def test_what_lies_to_the_left_is_on_the_left() -> None:
    assert pixel_of(look_along([0, 0, 0], [1, 0, 0]), (2.0, 0.3, 0.0))[0] < 50


def test_a_camera_rolled_clockwise_sees_up_turned_counter_clockwise() -> None:
    pose = look_along([0, 0, 0], [2, 0, 0], roll=np.radians(90))
    np.testing.assert_allclose(pixel_of(pose, (2.0, 0.0, 0.2)), [50 - 9, 40], atol=1e-9)
