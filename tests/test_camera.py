from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.camera import PinholeCamera
from stairmap.errors import CalibrationError
from value_strategies import no_deadline

CAMERA = PinholeCamera(width=8, height=6, fx=10.0, fy=12.0, cx=3.5, cy=2.5)


def camera_with(**changes: float) -> PinholeCamera:
    values: dict[str, float] = {"width": 8, "height": 6, "fx": 10.0, "fy": 12.0, "cx": 3.5, "cy": 2.5}
    return PinholeCamera(**{**values, **changes})  # type: ignore[arg-type]


def test_point_on_the_axis_falls_on_the_principal_point() -> None:
    np.testing.assert_allclose(CAMERA.project(np.array([0.0, 0.0, 2.0])), [3.5, 2.5])


def test_x_points_right_and_y_down() -> None:
    np.testing.assert_allclose(CAMERA.project(np.array([0.5, 0.25, 1.0])), [8.5, 5.5])


@pytest.mark.parametrize("z", [0.0, -1.0])
def test_point_not_in_front_of_the_camera_has_no_pixel(z: float) -> None:
    assert np.isnan(CAMERA.project(np.array([0.1, 0.1, z]))).all()


@no_deadline
@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(0.01, 20))
def test_pixel_and_depth_survive_the_way_over_the_point(u: float, v: float, depth: float) -> None:
    point = CAMERA.unproject_pixels(np.array([u, v]), np.array(depth))
    assert point[2] == depth
    np.testing.assert_allclose(CAMERA.project(point), [u, v], atol=1e-9)


def test_unprojected_image_holds_the_point_of_each_pixel() -> None:
    depth = np.arange(1, 49, dtype=np.float32).reshape(6, 8)
    depth[2, 3] = np.nan
    points = CAMERA.unproject(depth)
    assert points.shape == (6, 8, 3)
    assert np.isnan(points[2, 3]).all()
    assert np.isnan(points).sum() == 3
    np.testing.assert_allclose(
        points[4, 1], CAMERA.unproject_pixels(np.array([1.0, 4.0]), np.array(float(depth[4, 1])))
    )


def test_rays_reach_unit_depth() -> None:
    rays = CAMERA.rays()
    assert (rays[..., 2] == 1.0).all()
    np.testing.assert_allclose(CAMERA.project(rays)[5, 7], [7.0, 5.0])


@pytest.mark.parametrize("stride", [1, 2, 3, 5])
def test_strided_camera_sees_along_the_rays_of_the_pixels_kept(stride: int) -> None:
    thinned = CAMERA.strided(stride)
    kept = CAMERA.rays()[::stride, ::stride]
    assert (thinned.height, thinned.width) == kept.shape[:2]
    np.testing.assert_allclose(thinned.rays(), kept, atol=1e-12)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_scaled_camera_has_the_same_field_of_view(factor: float) -> None:
    scaled = CAMERA.scaled(factor)
    assert (scaled.width, scaled.height) == (8 * factor, 6 * factor)
    for camera in (CAMERA, scaled):
        corners = np.array([[-0.5, -0.5], [camera.width - 0.5, camera.height - 0.5]])
        rays = camera.unproject_pixels(corners, np.ones(2))
        np.testing.assert_allclose(rays, [[-0.4, -0.25, 1.0], [0.4, 0.25, 1.0]])


@pytest.mark.parametrize("name", ["fx", "fy", "width", "height"])
@pytest.mark.parametrize("value", [0, -3])
def test_sizes_and_focal_lengths_must_be_positive(name: str, value: int) -> None:
    with pytest.raises(CalibrationError, match=f"camera {name} must be positive, got {value}"):
        camera_with(**{name: value})


@pytest.mark.parametrize("name", ["fx", "fy", "cx", "cy"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_intrinsics_must_be_finite(name: str, value: float) -> None:
    with pytest.raises(CalibrationError, match=f"camera {name} must be finite"):
        camera_with(**{name: value})
