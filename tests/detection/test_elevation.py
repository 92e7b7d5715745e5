"""In a side elevation a riser has constant Q and a tread Q = tau / z, however the camera is turned."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import pose_looking
from solid_scenes import FLOOR, frame_of
from stairmap.arrays import Transform, Vector
from stairmap.detection.elevation import (
    STRIP_WIDTH,
    Elevation,
    lateral_positions,
    make_elevation,
    strip_columns,
)
from stairmap.detection.inverse_depth import inverse_depth_from_frame
from stairmap.simulation.triangle_mesh import TriangleMesh, make_wall

HEIGHT = 0.8
ATTITUDES = {
    "straight": {"down": 0.2},
    "rolled": {"down": 0.2, "roll": np.radians(15)},
    "pitched down": {"down": np.radians(40)},
    "pitched up": {"down": np.radians(-10)},
    "45 deg oblique": {"yaw": np.radians(45), "down": 0.2},
    "all at once": {"yaw": np.radians(-45), "down": 0.3, "roll": np.radians(-10)},
}


def elevation_of(solid: TriangleMesh, pose: Transform) -> Elevation:
    """The elevation along the map's +x."""
    image = inverse_depth_from_frame(frame_of([solid], pose), max_depth=6.0)
    up, forward = camera_axes(pose)
    elevation = make_elevation(image, up, forward)
    assert elevation is not None
    return elevation


def camera_axes(pose: Transform) -> tuple[Vector, Vector]:
    return pose[2, :3].copy(), pose[0, :3].copy()


def pose_of(attitude: str) -> Transform:
    return pose_looking((0.0, 0.0, HEIGHT), **ATTITUDES[attitude])


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_a_riser_has_constant_inverse_distance(attitude: str) -> None:
    elevation = elevation_of(make_wall((1.6, -9), (1.6, 9), -4, 6), pose_of(attitude))
    assert elevation.valid.mean() > 0.4
    np.testing.assert_allclose(elevation.inverse_distance[elevation.valid], 1 / 1.6, rtol=0.004)


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_a_tread_has_an_inverse_distance_in_proportion_to_slope(attitude: str) -> None:
    elevation = elevation_of(FLOOR, pose_of(attitude))
    rows, strips = np.nonzero(elevation.valid)
    assert len(rows) > 200
    expected = elevation.slope[rows] / -HEIGHT
    found = elevation.inverse_distance[rows, strips]
    # A row's slope is that of its pixels to half a pixel.
    pixel = 1.0 / elevation.row_density / HEIGHT
    assert np.abs(found - expected).max() < 1.5 * pixel
    assert abs(np.mean(found - expected)) < 0.2 * pixel


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_rows_descend_in_slope_at_their_stated_density(attitude: str) -> None:
    elevation = elevation_of(FLOOR, pose_of(attitude))
    assert (np.diff(elevation.slope) < 0).all()
    span = float(elevation.slope[0] - elevation.slope[-1])
    assert elevation.row_density == pytest.approx(len(elevation.slope) / span, rel=0.02)


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_lateral_positions_are_those_of_the_points_seen(attitude: str) -> None:
    # A wall that begins in the middle of the view: only strips to the left of it see it.
    pose = pose_of(attitude)
    edge = 1.6 * float(np.tan(ATTITUDES[attitude].get("yaw", 0.0)))
    elevation = elevation_of(make_wall((1.6, edge), (1.6, 12), -4, 6), pose)
    rows, strips = np.nonzero(elevation.valid)
    nosings = np.stack([np.full(len(rows), 1.6), 1.6 * elevation.slope[rows], strips], axis=1)
    positions = lateral_positions(elevation, nosings)
    np.testing.assert_allclose(positions[:, :2], nosings[:, :2])
    # Square to the strip, where the wall is 45 degrees oblique, it covers twice as much of it.
    strip = STRIP_WIDTH / 262.5 * 1.6 * 2.1
    assert positions[:, 2].min() == pytest.approx(edge, abs=strip)


def test_a_camera_that_looks_across_the_heading_has_no_elevation() -> None:
    pose = pose_looking((0, 0, HEIGHT), down=0.2)
    image = inverse_depth_from_frame(frame_of([FLOOR], pose), max_depth=6.0)
    up, _ = camera_axes(pose)
    assert make_elevation(image, up, -pose[0, :3]) is None


def test_strips_without_depth_are_not_valid() -> None:
    elevation = elevation_of(make_wall((1.6, 1.5), (1.6, 1.6), -4, 6), pose_of("straight"))
    assert not elevation.valid.any()


def test_strip_columns_cover_the_strips_and_their_margin() -> None:
    strips = np.zeros(20, dtype=bool)
    strips[[5, 9]] = True
    first, last = strip_columns(320, strips, margin=1)
    assert (first, last) == (4 * STRIP_WIDTH, 11 * STRIP_WIDTH)
    strips[[0, 19]] = True
    assert strip_columns(320, strips, margin=1) == (0, 320)


def test_strips_of_a_width_that_they_do_not_divide_are_centred() -> None:
    strips = np.ones(20, dtype=bool)
    first, last = strip_columns(330, strips, margin=0)
    assert (first, last) == (5, 325)
