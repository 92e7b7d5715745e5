"""In a side elevation a riser has constant Q and a tread Q = tau / z, however the camera is turned."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking
from side_profiles import descending_profile, scan
from solid_scenes import FLOOR, frame_of, stairs_solid
from stairmap.arrays import Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.detection.elevation import (
    Elevation,
    make_elevation,
    make_grid,
    sample_grid,
    sharpened,
    strip_columns,
)
from stairmap.detection.inverse_depth import InverseDepthImage, inverse_depth_from_frame
from stairmap.detection.nosing_search import find_corners
from stairmap.geometry import normalized
from stairmap.simulation.triangle_mesh import TriangleMesh, make_wall

MIN_FORWARD = 0.15
STRIP_WIDTH = 16
"""Limits that hold, written again: who changes one changes it here as well."""

HEIGHT = 0.8
ATTITUDES = {
    "straight": {"down": 0.2},
    "rolled": {"down": 0.2, "roll": np.radians(15)},
    "pitched down": {"down": np.radians(40)},
    "pitched up": {"down": np.radians(-10)},
    "45 deg oblique": {"yaw": np.radians(45), "down": 0.2},
    "all at once": {"yaw": np.radians(-45), "down": 0.3, "roll": np.radians(-10)},
    "on its side": {"down": 0.2, "roll": np.radians(90)},
    "upside down": {"down": 0.2, "roll": np.radians(180)},
}
PORTRAIT = PinholeCamera(width=240, height=320, fx=262.5, fy=262.5, cx=119.5, cy=159.5)


def image_of(
    *solids: TriangleMesh, pose: Transform, camera: PinholeCamera = KINECT_CAMERA
) -> InverseDepthImage:
    return inverse_depth_from_frame(frame_of(solids, pose, camera=camera), max_depth=6.0)


def camera_axes(pose: Transform) -> tuple[Vector, Vector]:
    """Up and the map's +x in the camera frame."""
    return pose[2, :3].copy(), pose[0, :3].copy()


def elevation_of(*solids: TriangleMesh, pose: Transform, camera: PinholeCamera = KINECT_CAMERA) -> Elevation:
    """The elevation along the map's +x."""
    elevation = make_elevation(image_of(*solids, pose=pose, camera=camera), *camera_axes(pose))
    assert elevation is not None
    return elevation


def pose_of(attitude: str) -> Transform:
    return pose_looking((0.0, 0.0, HEIGHT), **ATTITUDES[attitude])


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_a_riser_has_constant_inverse_distance(attitude: str) -> None:
    elevation = elevation_of(make_wall((1.6, -9), (1.6, 9), -4, 6), pose=pose_of(attitude))
    q = elevation.inverse_distance
    assert (q > 0).mean() > 0.35
    error = np.abs(1.6 * q[q > 0] - 1)
    # A few cells lie at the border of what is within range.
    assert np.quantile(error, 0.99) < 5e-4
    assert error.max() < 0.007


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_a_tread_has_an_inverse_distance_in_proportion_to_slope(attitude: str) -> None:
    elevation = elevation_of(FLOOR, pose=pose_of(attitude))
    rows, strips = np.nonzero(elevation.inverse_distance)
    assert len(rows) > 200
    expected = elevation.slope[rows] / -HEIGHT
    found = elevation.inverse_distance[rows, strips]
    pixel = elevation.grid.row_size / HEIGHT
    assert np.quantile(np.abs(found - expected), 0.995) < 0.6 * pixel
    assert np.abs(found - expected).max() < 1.5 * pixel
    assert abs(np.mean(found - expected)) < 0.05 * pixel


@pytest.mark.parametrize("attitude", ATTITUDES)
def test_rows_ascend_in_slope_and_columns_descend_in_bearing(attitude: str) -> None:
    grid = elevation_of(FLOOR, pose=pose_of(attitude)).grid
    assert (np.diff(grid.slope) > 0).all()
    assert (np.diff(grid.bearing) < 0).all()
    assert grid.row_size == pytest.approx(np.diff(grid.slope).mean())
    np.testing.assert_allclose(grid.left, np.cross(grid.up, grid.forward), atol=1e-12)


@pytest.mark.parametrize("attitude", ["straight", "rolled", "on its side", "upside down"])
def test_rows_and_columns_are_as_fine_as_the_image(attitude: str) -> None:
    grid = elevation_of(FLOOR, pose=pose_of(attitude)).grid
    # About the optical axis a pixel is 1 / fx; slope 0.2 down, it is 1 + slope^2 as much.
    middle = np.argmin(np.abs(grid.slope + np.tan(0.2)))
    assert np.diff(grid.slope)[middle] == pytest.approx((1 + np.tan(0.2) ** 2) / 262.5, rel=0.02)
    ahead = np.argmin(np.abs(grid.bearing))
    assert -np.diff(grid.bearing)[ahead] == pytest.approx(1 / 262.5 / np.cos(0.2), rel=0.02)


@pytest.mark.parametrize("turn", [15.0 * k for k in range(24)])
def test_a_rolled_camera_sees_the_same_section(turn: float) -> None:
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=9.0, num_risers=8)
    place = (-1.2, 0.0, 1.0)
    upright, rolled = (
        elevation_of(stairs_solid(stairs), FLOOR, pose=pose_looking(place, down=0.25, roll=np.radians(roll)))
        for roll in (0.0, turn)
    )

    def section(elevation: Elevation, slopes: Vector) -> Vector:
        middle = np.argmin(np.abs(elevation.bearing))
        return np.interp(slopes, elevation.slope, elevation.inverse_distance[:, middle])

    slopes = np.linspace(-0.55, -0.05, 120)
    difference = np.abs(section(upright, slopes) - section(rolled, slopes))
    # Only at nosings, by the place of an edge in its row, they differ.
    assert np.quantile(difference, 0.85) < 0.004
    assert np.median(difference) < 0.0015


def test_a_portrait_image_has_more_rows_than_columns() -> None:
    pose = pose_of("straight")
    portrait, turned = (
        elevation_of(FLOOR, pose=pose_looking((0.0, 0.0, HEIGHT), down=0.2, roll=roll), camera=camera)
        for camera, roll in ((PORTRAIT, 0.0), (KINECT_CAMERA, np.radians(90)))
    )
    landscape = elevation_of(FLOOR, pose=pose)
    assert len(portrait.slope) > 1.2 * len(landscape.slope)
    assert len(portrait.grid.bearing) < 0.8 * len(landscape.grid.bearing)
    # A camera on its side is one in portrait.
    np.testing.assert_allclose(turned.slope, portrait.slope, atol=1e-9)
    np.testing.assert_allclose(turned.grid.bearing, portrait.grid.bearing, atol=1e-9)


@pytest.mark.parametrize("attitude", ["straight", "rolled", "45 deg oblique", "all at once", "upside down"])
def test_bearings_are_those_of_the_points_seen(attitude: str) -> None:
    # A wall that begins in the middle of the view: only strips to the left of it see it.
    pose = pose_of(attitude)
    edge = 1.6 * float(np.tan(ATTITUDES[attitude].get("yaw", 0.0)))
    elevation = elevation_of(make_wall((1.6, edge), (1.6, 12), -4, 6), pose=pose)
    _, strips = np.nonzero(elevation.inverse_distance)
    across = 1.6 * elevation.bearing[strips]
    # Square to the strip, where the wall is 45 degrees oblique, it covers twice as much of it.
    strip = STRIP_WIDTH / 262.5 * 1.6 * 2.1
    assert across.min() == pytest.approx(edge, abs=strip)


def test_a_camera_that_looks_across_or_against_the_heading_has_no_elevation() -> None:
    pose = pose_looking((0, 0, HEIGHT), down=0.2)
    image = image_of(FLOOR, pose=pose)
    up, forward = camera_axes(pose)
    assert make_elevation(image, up, -forward) is None
    assert make_grid(image, up, -forward) is None


@pytest.mark.parametrize("yaw_deg", [55.0, 70.0, -70.0])
def test_rays_far_aside_of_the_heading_are_not_used(yaw_deg: float) -> None:
    pose = pose_looking((0, 0, HEIGHT), yaw=np.radians(yaw_deg), down=0.2)
    grid = make_grid(image_of(FLOOR, pose=pose), *camera_axes(pose))
    assert grid is not None
    # The image's border is 0.61 aside of its axis: rays are at most 1.19 long.
    assert 0.9 / MIN_FORWARD < np.abs(grid.bearing).max() < 1.19 / MIN_FORWARD
    # Where the camera looks to the left of the heading, so do its rays.
    assert (np.sign(grid.bearing) == np.sign(yaw_deg)).all()


@pytest.mark.parametrize("down_deg", [60.0, 80.0])
def test_a_camera_that_looks_steeply_down_still_has_an_elevation(down_deg: float) -> None:
    pose = pose_looking((0, 0, HEIGHT), down=np.radians(down_deg))
    elevation = elevation_of(FLOOR, pose=pose)
    rows, strips = np.nonzero(elevation.inverse_distance)
    assert len(rows) > 50
    expected = elevation.slope[rows] / -HEIGHT
    np.testing.assert_allclose(elevation.inverse_distance[rows, strips], expected, rtol=0.02)


@pytest.mark.parametrize("size", [(1, 1), (320, 1), (1, 240), (15, 240), (40, 19)])
def test_images_too_small_for_a_strip_have_no_elevation(size: tuple[int, int]) -> None:
    width, height = size
    camera = PinholeCamera(width=width, height=height, fx=200.0, fy=200.0, cx=width / 2, cy=height / 2)
    q = np.full((height, width), 0.5, np.float32)
    image = InverseDepthImage(inverse_depth=q, valid=q > 0, camera=camera, stride=1)
    assert make_elevation(image, np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])) is None


def test_strips_without_depth_hold_zero() -> None:
    elevation = elevation_of(make_wall((1.6, 1.5), (1.6, 1.6), -4, 6), pose=pose_of("straight"))
    assert not elevation.inverse_distance.any()


UP, FORWARD = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def flat_image(q: np.ndarray, stride: int = 1) -> InverseDepthImage:
    """An image of given inverse depth that looks along its heading."""
    return InverseDepthImage(
        inverse_depth=q.astype(np.float32), valid=q > 0, camera=KINECT_CAMERA, stride=stride
    )


@pytest.mark.parametrize(("num_missing", "is_valid"), [(4, True), (5, False)])
def test_a_cell_of_which_half_is_missing_is_kept(num_missing: int, is_valid: bool) -> None:
    # Every second of sixteen columns is sampled: eight.
    q = np.full((240, 320), 0.5)
    q[:, 32 : 32 + 2 * num_missing] = 0.0
    elevation = make_elevation(flat_image(q), UP, FORWARD)
    assert elevation is not None
    column = elevation.inverse_distance[:, 2]
    assert (column > 0).all() == is_valid
    assert (column > 0).any() == is_valid
    np.testing.assert_allclose(elevation.inverse_distance[:, [0, 1, 3]], 0.5, rtol=1e-5)


@pytest.mark.parametrize(("step", "mean"), [(0.018, 0.509), (0.03, 0.5)])
def test_a_cell_is_the_mean_of_its_values_near_their_median(step: float, mean: float) -> None:
    # Three of eight samples differ: by 3.6 % they are averaged in, by 6 % they are another surface.
    q = np.full((240, 320), 0.5)
    q[:, 32:38] += step
    elevation = make_elevation(flat_image(q), UP, FORWARD)
    assert elevation is not None
    expected = 0.5 + 3 / 8 * step if step < 0.02 else mean
    np.testing.assert_allclose(elevation.inverse_distance[:, 2], expected, atol=1e-4)


def test_between_two_surfaces_nothing_is_interpolated() -> None:
    q = np.full((240, 320), 0.5)
    q[:120] = 0.4
    image = flat_image(q)
    grid = make_grid(image, UP, FORWARD)
    assert grid is not None
    between = np.linspace(grid.slope[100], grid.slope[140], 300)
    sampled = sample_grid(image, grid, between, grid.bearing[::10])
    assert (np.minimum(np.abs(sampled / 0.4 - 1), np.abs(sampled / 0.5 - 1)) < 0.03).all()
    # Within 3 % it is one surface.
    q[:120] = 0.49
    smooth = sample_grid(flat_image(q), grid, between, grid.bearing[::10])
    assert len(np.unique(np.round(smooth, 5))) > 5


def test_rays_beyond_the_image_measure_nothing() -> None:
    image = flat_image(np.full((240, 320), 0.5))
    grid = make_grid(image, UP, FORWARD)
    assert grid is not None
    outside = sample_grid(image, grid, np.array([-0.6, 0.0, 0.6]), np.array([0.0, 0.8]))
    assert outside[1, 0] == pytest.approx(0.5)
    assert (outside[[0, 2]] == 0).all()
    assert outside[1, 1] == 0


def test_inverse_distance_is_along_the_heading_not_the_optical_axis() -> None:
    # A wall square to the heading, 20 degrees aside of the camera's axis.
    pose = pose_looking((0.0, 0.0, HEIGHT), yaw=np.radians(20))
    image = image_of(make_wall((2.0, -9), (2.0, 9), -4, 6), pose=pose)
    elevation = make_elevation(image, *camera_axes(pose))
    assert elevation is not None
    q = elevation.inverse_distance
    np.testing.assert_allclose(q[q > 0], 0.5, rtol=0.002)
    depth = image.inverse_depth[120]
    assert depth.max() > 1.1 * depth[depth > 0].min()


@pytest.mark.parametrize(("stride", "shift"), [(1, 0.0), (2, 0.25), (4, 0.375)])
def test_a_reduced_image_moved_edges_outward_by_half_a_pixel_less_its_share(
    stride: int, shift: float
) -> None:
    grid = make_grid(flat_image(np.full((240, 320), 0.5), stride), UP, FORWARD)
    assert grid is not None
    assert grid.edge_shift == shift


def test_strip_columns_cover_the_strips_and_their_margin() -> None:
    strips = np.zeros(20, dtype=bool)
    strips[[5, 9]] = True
    first, last = strip_columns(320, strips, margin=1)
    assert (first, last) == (4 * STRIP_WIDTH, 11 * STRIP_WIDTH)
    strips[[0, 19]] = True
    assert strip_columns(320, strips, margin=1) == (0, 320)


def test_strips_of_a_width_that_they_do_not_divide_are_centred() -> None:
    strips = np.ones(20, dtype=bool)
    assert strip_columns(330, strips, margin=0) == (5, 325)
    camera = replace(KINECT_CAMERA, width=330, cx=164.5)
    q = np.full((240, 330), 0.5, np.float32)
    image = InverseDepthImage(inverse_depth=q, valid=q > 0, camera=camera, stride=1)
    elevation = make_elevation(image, UP, FORWARD)
    assert elevation is not None
    assert elevation.inverse_distance.shape[1] == 20
    assert elevation.bearing.sum() == pytest.approx(0.0, abs=1e-9)
    assert elevation.bearing[0] == pytest.approx(elevation.grid.bearing[5:21].mean())
    assert normalized(elevation.grid.left) @ [-1, 0, 0] == pytest.approx(1.0)


def blended(elevation: Elevation, smoothing: float) -> Elevation:
    """The scans as a sensor shows them that blends rows."""
    q = cv2.GaussianBlur(elevation.inverse_distance, (1, 0), sigmaX=1e-9, sigmaY=smoothing)
    return replace(elevation, inverse_distance=q)


def test_sharpened_scans_show_narrow_treads_again() -> None:
    # Treads of 13 to 6 rows, and a sensor that blends 2.2 rows.
    exact = scan(descending_profile(distance=0.9, height=-0.9), top=-0.2, num_rows=150)
    smooth = blended(exact, 2.2)
    sharp = sharpened(smooth, 2.2)
    off = [np.abs(part.inverse_distance - exact.inverse_distance).mean() for part in (smooth, sharp)]
    assert off[1] < 0.7 * off[0]
    found = [len(find_corners(part, noise=1e-4)) for part in (smooth, sharp)]
    assert found[1] > found[0]
    np.testing.assert_array_equal(sharp.slope, smooth.slope)


def test_sharpening_leaves_planes_and_what_is_not_measured_as_they_are() -> None:
    plane = scan([((0.05, -0.8), (9.0, -0.8))], top=-0.2, num_rows=150)
    inner = np.s_[20:-20]
    sharp = sharpened(plane, 2.0).inverse_distance
    np.testing.assert_allclose(sharp[inner], plane.inverse_distance[inner], atol=1e-5)
    q = plane.inverse_distance.copy()
    q[70:75] = 0.0
    holed = sharpened(replace(plane, inverse_distance=q), 2.0).inverse_distance
    assert (holed[70:75] == 0).all()
    # About the hole too little is known.
    np.testing.assert_array_equal(holed[[68, 69, 75, 76]], q[[68, 69, 75, 76]])
