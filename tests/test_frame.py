from __future__ import annotations

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame

CAMERA = PinholeCamera(width=4, height=3, fx=2.0, fy=2.0, cx=1.5, cy=1.0)


def test_image_of_another_size_than_the_cameras_is_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(4, 3\), its camera says \(3, 4\)"):
        DepthFrame(stamp_ns=0, depth=np.ones((4, 3)), camera=CAMERA)


def test_up_is_scaled_to_unit_length() -> None:
    frame = DepthFrame(stamp_ns=0, depth=np.ones((3, 4)), camera=CAMERA, up=np.array([0.0, -3.0, -4.0]))
    assert frame.up is not None
    np.testing.assert_allclose(frame.up, [0.0, -0.6, -0.8])


@pytest.mark.parametrize("up", [[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0]])
def test_up_without_a_direction_is_refused(up: list[float]) -> None:
    with pytest.raises(ValueError, match="finite length above zero"):
        DepthFrame(stamp_ns=0, depth=np.ones((3, 4)), camera=CAMERA, up=np.array(up))


def test_up_stays_unknown_when_nobody_tells_it() -> None:
    assert DepthFrame(stamp_ns=0, depth=np.ones((3, 4)), camera=CAMERA).up is None


def test_depth_becomes_read_only_float32_while_the_callers_array_stays_writable() -> None:
    depth = np.ones((3, 4), dtype=np.float32)
    frame = DepthFrame(stamp_ns=0, depth=depth, camera=CAMERA)
    assert frame.depth.dtype == np.float32
    with pytest.raises(ValueError, match="read-only"):
        frame.depth[0, 0] = 2.0
    depth[0, 0] = 2.0
    assert DepthFrame(stamp_ns=0, depth=np.ones((3, 4)), camera=CAMERA).depth.dtype == np.float32


def test_points_of_unmeasured_pixels_are_nan() -> None:
    depth = np.full((3, 4), 2.0)
    depth[0, 1] = np.nan
    points = DepthFrame(stamp_ns=0, depth=depth, camera=CAMERA).points()
    assert np.isnan(points[0, 1]).all()
    np.testing.assert_allclose(points[2, 0], [-1.5, 1.0, 2.0])
