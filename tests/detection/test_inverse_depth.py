"""In inverse depth a plane is linear, so that a least-squares fit gives its normal."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stairmap.arrays import DepthImage, Vector
from stairmap.camera import PinholeCamera
from stairmap.detection.inverse_depth import (
    JUMP_STEP,
    InverseDepthImage,
    estimate_smoothings,
    fit_surface_normals,
    inverse_depth_from_frame,
)
from stairmap.detection.orientation import correct_up
from stairmap.frame import DepthFrame
from stairmap.geometry import normalized

MIN_JUMPS = 10
SHARP = 0.5
SMOOTH = 2.0
"""Limits that hold, written again: who changes one changes it here as well."""

SMALL = PinholeCamera(width=320, height=240, fx=262.5, fy=262.5, cx=159.5, cy=119.5)
LARGE = SMALL.scaled(2.0)


def plane_depth(camera: PinholeCamera, normal: Vector, distance: float) -> DepthImage:
    """Depth of the plane normal·X = distance, NaN where it lies behind."""
    along = camera.rays() @ normal
    return np.where(along > 0.02, distance / np.maximum(along, 0.02), np.nan).astype(np.float32)


def frame_of_depth(depth: DepthImage, camera: PinholeCamera) -> DepthFrame:
    return DepthFrame(stamp_ns=0, depth=depth, camera=camera)


def angles_to(normals: np.ndarray, normal: Vector) -> np.ndarray:
    """Angles between (N, 3) float32 normals and the true one, deg."""
    sine = np.linalg.norm(np.cross(normals.astype(np.float64), normal), axis=1)
    return np.degrees(np.arctan2(sine, normals @ normal))


@st.composite
def planes(draw: st.DrawFn) -> tuple[Vector, float]:
    """A plane that fills the image, up to 40 degrees oblique, 0.5 to 1.5 m away."""
    tilt, azimuth = np.radians(draw(st.floats(0, 40))), draw(st.floats(0, 2 * np.pi))
    normal = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    return normal, draw(st.floats(0.5, 1.5))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(planes(), st.sampled_from([SMALL, LARGE]))
def test_normals_of_a_noise_free_plane_are_exact(plane: tuple[Vector, float], camera: PinholeCamera) -> None:
    normal, distance = plane
    image = inverse_depth_from_frame(
        frame_of_depth(plane_depth(camera, normal, distance), camera), max_depth=10
    )
    surfaces = fit_surface_normals(image)
    u, v = (surfaces.points[:, :2] / surfaces.points[:, 2:]).T
    # Windows that the image's border cuts are not exact: see the next test.
    whole = (np.abs(u) < 0.56) & (np.abs(v) < 0.42)
    assert whole.sum() > 4000
    assert angles_to(surfaces.normals[whole], normal).max() < 0.06
    np.testing.assert_allclose(surfaces.points[whole] @ normal, distance, rtol=1e-4)
    assert surfaces.noise < 1e-3 / distance


@settings(max_examples=15, deadline=None, derandomize=True)
@given(planes())
def test_windows_that_the_border_cuts_are_few_and_do_not_turn_up(plane: tuple[Vector, float]) -> None:
    normal, distance = plane
    frame = frame_of_depth(plane_depth(SMALL, normal, distance), SMALL)
    surfaces = fit_surface_normals(inverse_depth_from_frame(frame, max_depth=10))
    assert (angles_to(surfaces.normals, normal) > 0.06).mean() < 0.05
    up = correct_up(surfaces, -normal, max_correction=0.1).up
    assert angles_to(-up[None], normal)[0] < 0.15


@settings(max_examples=10, deadline=None, derandomize=True)
@given(planes(), st.integers(0, 99))
def test_a_fifth_of_the_pixels_missing_turns_normals_at_random_and_not_on_average(
    plane: tuple[Vector, float], seed: int
) -> None:
    normal, distance = plane
    depth = plane_depth(SMALL, normal, distance)
    depth[np.random.default_rng(seed).random(depth.shape) < 0.2] = np.nan
    surfaces = fit_surface_normals(inverse_depth_from_frame(frame_of_depth(depth, SMALL), max_depth=10))
    assert len(surfaces.normals) > 500
    assert np.median(angles_to(surfaces.normals, normal)) < 2.5
    mean = normalized(surfaces.normals.sum(axis=0, dtype=np.float64))
    assert angles_to(mean[None], normal)[0] < 0.2


def test_windows_with_a_third_of_their_pixels_missing_give_no_normals() -> None:
    depth = plane_depth(SMALL, np.array([0.0, 0.0, 1.0]), 2.0)
    depth[np.random.default_rng(3).random(depth.shape) < 0.45] = np.nan
    surfaces = fit_surface_normals(inverse_depth_from_frame(frame_of_depth(depth, SMALL), max_depth=10))
    assert len(surfaces.normals) < 20


def test_no_normal_is_fitted_across_a_jump_of_depth() -> None:
    near, far = np.full((240, 160), 1.0, np.float32), np.full((240, 160), 1.5, np.float32)
    frame = frame_of_depth(np.concatenate([near, far], axis=1), SMALL)
    surfaces = fit_surface_normals(inverse_depth_from_frame(frame, max_depth=10))
    facing = np.array([0.0, 0.0, 1.0])
    assert angles_to(surfaces.normals, facing).max() < 0.1
    assert set(np.round(surfaces.points[:, 2], 4)) <= {1.0, 1.5}


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.5, 3.0), st.floats(1.06, 3.0), st.integers(0, 99))
def test_block_reduction_never_invents_a_point_between_two_surfaces(
    near: float, ratio: float, seed: int
) -> None:
    far = min(near * ratio, 5.9)
    is_near = np.random.default_rng(seed).random((480, 640)) < 0.4
    depth = np.where(is_near, near, far).astype(np.float32)
    image = inverse_depth_from_frame(frame_of_depth(depth, LARGE), max_depth=6)
    assert image.stride == 2
    distance = np.minimum(np.abs(image.inverse_depth - 1 / near), np.abs(image.inverse_depth - 1 / far))
    assert distance.max() < 1e-6


@settings(max_examples=15, deadline=None, derandomize=True)
@given(planes())
def test_a_reduced_plane_is_the_same_plane_seen_by_the_reduced_camera(plane: tuple[Vector, float]) -> None:
    normal, distance = plane
    frame = frame_of_depth(plane_depth(LARGE, normal, distance), LARGE)
    image = inverse_depth_from_frame(frame, max_depth=6)
    assert (image.camera.width, image.camera.height) == (320, 240)
    rows, columns = np.nonzero(image.inverse_depth > 1 / 5.5)
    points = image.camera.rays()[rows, columns] / image.inverse_depth[rows, columns][:, None]
    np.testing.assert_allclose(points @ normal, distance, rtol=2e-5)


def test_what_is_no_depth_within_range_becomes_invalid() -> None:
    depth = np.full((240, 320), 2.0, np.float32)
    depth[0, :6] = [np.nan, np.inf, 0.0, -1.0, 6.5, 1e-5]
    image = inverse_depth_from_frame(frame_of_depth(depth, SMALL), max_depth=6)
    assert not image.valid[0, :6].any()
    assert (image.inverse_depth[~image.valid] == 0).all()
    assert image.valid.sum() == 240 * 320 - 6


def test_noise_is_told_in_proportion_to_what_it_is() -> None:
    random = np.random.default_rng(5)
    plane = plane_depth(SMALL, normalized([0.0, 0.6, 0.8]), 1.0)
    told = []
    for std in (0.002, 0.004):
        noisy = 1.0 / (1.0 / plane + random.normal(0, std, plane.shape))
        image = inverse_depth_from_frame(frame_of_depth(noisy, SMALL), max_depth=10)
        told.append(fit_surface_normals(image).noise / std)
    assert told[0] == pytest.approx(told[1], rel=0.1)
    assert 0.4 < told[0] < 1.1


def test_an_empty_frame_has_no_normals() -> None:
    depth = np.full((240, 320), np.nan, np.float32)
    surfaces = fit_surface_normals(inverse_depth_from_frame(frame_of_depth(depth, SMALL), max_depth=6))
    assert len(surfaces.normals) == len(surfaces.points) == 0
    assert surfaces.noise == 0


def image_of_jump(
    *, smoothing: float = 0.0, near: float = 1.0, far: float = 0.7, columns: int = 160, slant: float = 0.0
) -> InverseDepthImage:
    """Two walls, the nearer one to the left, blended by a Gaussian; its edge leans by columns per row."""
    rows, place = np.mgrid[0:240, 0:320].astype(np.float64)
    edge = columns + slant * (rows - 120)
    q = np.where(place < edge, near, far)
    if smoothing:
        q = cv2.GaussianBlur(q, (0, 0), smoothing, borderType=cv2.BORDER_REPLICATE)
    q = q.astype(np.float32)
    return InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1)


@pytest.mark.parametrize("smoothing", [0.8, 1.2, 2.0])
def test_smoothing_is_told_by_the_steepest_pixel_of_jumps(smoothing: float) -> None:
    (found,) = estimate_smoothings(image_of_jump(smoothing=smoothing))
    assert found == pytest.approx(smoothing, rel=0.1)


@pytest.mark.parametrize("smoothing", [0.0, 0.3])
def test_a_pixels_footprint_is_the_least_that_blends(smoothing: float) -> None:
    assert estimate_smoothings(image_of_jump(smoothing=smoothing)) == (SHARP,)


def test_edges_that_lie_level_tell_smoothing_as_well() -> None:
    image = image_of_jump(smoothing=1.5)
    turned = np.ascontiguousarray(image.inverse_depth.T)
    camera = PinholeCamera(width=240, height=320, fx=262.5, fy=262.5, cx=119.5, cy=159.5)
    level = InverseDepthImage(inverse_depth=turned, valid=turned > 0, camera=camera, stride=1)
    assert estimate_smoothings(level) == pytest.approx(estimate_smoothings(image), rel=0.02)


def test_edges_aslant_do_not_decide() -> None:
    # A sharp upright edge, and one of two columns per row that looks smooth along columns.
    aslant = image_of_jump(smoothing=0.8, slant=0.5)
    assert estimate_smoothings(aslant)[0] < 1.15


@pytest.mark.parametrize(("far", "tells"), [(0.94, True), (0.96, False)])
def test_a_jump_is_a_twentieth_of_inverse_depth_or_more(far: float, tells: bool) -> None:
    found = estimate_smoothings(image_of_jump(smoothing=1.2, far=far))
    assert (len(found) == 1) == tells


def test_a_ramp_wider_than_the_plateaus_tells_nothing() -> None:
    assert estimate_smoothings(image_of_jump(smoothing=3.0)) == (SHARP, SMOOTH)


def test_without_jumps_both_kinds_of_sensor_are_possible() -> None:
    assert estimate_smoothings(image_of_jump(far=1.0)) == (SHARP, SMOOTH)
    # A floor that recedes changes everywhere, and has no plateaus.
    floor = np.repeat(np.linspace(0.1, 1.2, 240, dtype=np.float32)[:, None], 320, axis=1)
    image = InverseDepthImage(inverse_depth=floor, valid=floor > 0, camera=SMALL, stride=1)
    assert estimate_smoothings(image) == (SHARP, SMOOTH)


@pytest.mark.parametrize(("num", "tells"), [(MIN_JUMPS // 2 - 1, False), (MIN_JUMPS // 2 + 1, True)])
def test_ten_jumps_tell_how_a_sensor_smooths(num: int, tells: bool) -> None:
    # Every JUMP_STEP-th row is looked at, and an edge between two pixels counts for both.
    image = image_of_jump()
    q = image.inverse_depth.copy()
    end = JUMP_STEP * (num - 1) + 1
    # Its lower end would be a jump of columns.
    q[end:] = 1.0
    q[end : end + JUMP_STEP - 1] = 0.0
    found = estimate_smoothings(InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1))
    assert (len(found) == 1) == tells


def test_jumps_beside_missing_pixels_tell_nothing() -> None:
    image = image_of_jump()
    q = image.inverse_depth.copy()
    q[:, 161:163] = 0.0
    found = estimate_smoothings(InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1))
    assert found == (SHARP, SMOOTH)


@pytest.mark.parametrize("size", [(1, 1), (1, 240), (320, 1), (12, 12), (13, 13)])
@pytest.mark.parametrize("value", [0.0, 0.5])
def test_images_of_any_size_tell_a_smoothing_and_normals(size: tuple[int, int], value: float) -> None:
    width, height = size
    camera = PinholeCamera(width=width, height=height, fx=200.0, fy=200.0, cx=width / 2, cy=height / 2)
    q = np.full((height, width), value, np.float32)
    image = InverseDepthImage(inverse_depth=q, valid=q > 0, camera=camera, stride=1)
    assert estimate_smoothings(image) == (SHARP, SMOOTH)
    surfaces = fit_surface_normals(image)
    assert len(surfaces.normals) == len(surfaces.points) == len(surfaces.residual) == len(surfaces.is_inner)
    assert np.isfinite(surfaces.noise)
    if min(size) < 2 or value == 0:
        assert len(surfaces.normals) == 0


@pytest.mark.parametrize("width", [360, 361, 720, 721])
def test_images_are_reduced_until_they_are_no_wider_than_360(width: int) -> None:
    camera = PinholeCamera(width=width, height=240, fx=300.0, fy=300.0, cx=width / 2, cy=119.5)
    image = inverse_depth_from_frame(
        frame_of_depth(np.full((240, width), 2.0, np.float32), camera), max_depth=6
    )
    assert image.stride == -(-width // 360)
    assert image.camera.width == width // image.stride
    assert image.camera.fx == pytest.approx(300.0 / image.stride)


def test_pixels_5_percent_behind_the_nearest_of_their_block_are_left_out() -> None:
    depth = np.full((480, 640), 2.0, np.float32)
    # Two of the four pixels of each block lie 4 % or 6 % farther.
    for farther, expected in ((1.04, 0.5 * (0.5 + 0.5 / 1.04)), (1.06, 0.5)):
        mixed = depth.copy()
        mixed[::2] *= farther
        image = inverse_depth_from_frame(frame_of_depth(mixed, LARGE), max_depth=6)
        np.testing.assert_allclose(image.inverse_depth, expected, rtol=1e-5)
    empty = depth.copy()
    empty[::2] = np.nan
    image = inverse_depth_from_frame(frame_of_depth(empty, LARGE), max_depth=6)
    np.testing.assert_allclose(image.inverse_depth, 0.5, rtol=1e-6)


def test_windows_at_a_fold_are_no_inner_ones() -> None:
    # Two planes that meet in a level edge, 40 degrees apart: a concave fold at row 120.
    v = (np.arange(240) - 119.5) / 262.5
    slope = np.tan(np.radians(20.0))
    q = np.repeat((0.6 + 0.6 * slope * np.abs(v))[:, None], 320, axis=1).astype(np.float32)
    image = InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1)
    surfaces = fit_surface_normals(image)
    row = surfaces.points[:, 1] / surfaces.points[:, 2] * 262.5
    near, away = np.abs(row) < 6, (np.abs(row) > 20) & (np.abs(row) < 100)
    assert not surfaces.is_inner[near].any()
    assert surfaces.is_inner[away].mean() > 0.95


@pytest.mark.parametrize(
    ("near", "share", "is_fitted"), [(2.0, 0.03, True), (2.0, 0.14, False), (0.5, 0.14, False)]
)
def test_windows_across_a_jump_of_several_percent_fit_no_plane(
    near: float, share: float, is_fitted: bool
) -> None:
    q = np.full((240, 320), 1.0 / near, np.float32)
    q[:, 160:] *= 1 - share
    image = InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1)
    surfaces = fit_surface_normals(image)
    column = surfaces.points[:, 0] / surfaces.points[:, 2] * 262.5
    assert (np.abs(column) < 3).any() == is_fitted
    assert (np.abs(column) > 20).any()


@pytest.mark.parametrize(("num_sharp", "is_sharp"), [(96, True), (48, False)])
def test_the_upper_quarter_of_jumps_tells_how_a_sensor_smooths(num_sharp: int, is_sharp: bool) -> None:
    # Of 240 rows two fifths or one fifth show the jump as it is, the others see an edge aslant.
    sharp, smooth = image_of_jump(smoothing=1.0), image_of_jump(smoothing=1.6)
    q = smooth.inverse_depth.copy()
    q[:num_sharp] = sharp.inverse_depth[:num_sharp]
    (found,) = estimate_smoothings(InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1))
    (expected,) = estimate_smoothings(sharp if is_sharp else smooth)
    assert found == pytest.approx(expected, rel=0.01)


def test_between_two_jumps_the_quarter_is_found_by_proportion() -> None:
    # Twenty rows, 40 jumps: at place 29.25 of them in ascending order. Each smoothing is seen by two or four.
    q = np.concatenate([image_of_jump(smoothing=s).inverse_depth[:12] for s in np.linspace(2.0, 1.0, 10)])
    found = estimate_smoothings(InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1))[0]
    steps = np.linspace(2.0, 1.0, 10)
    assert steps[8] < found < steps[6]


@pytest.mark.parametrize(("bend_deg", "is_inner"), [(8.0, True), (14.0, False)])
def test_windows_above_and_below_an_inner_one_are_parallel_to_10_degrees(
    bend_deg: float, is_inner: bool
) -> None:
    v = (np.arange(240) - 119.5) / 262.5
    slope = np.tan(np.radians(bend_deg / 2))
    q = np.repeat((0.6 + 0.6 * slope * np.abs(v))[:, None], 320, axis=1).astype(np.float32)
    surfaces = fit_surface_normals(InverseDepthImage(inverse_depth=q, valid=q > 0, camera=SMALL, stride=1))
    row = surfaces.points[:, 1] / surfaces.points[:, 2] * 262.5
    assert surfaces.is_inner[np.abs(row) < 3].all() == is_inner
