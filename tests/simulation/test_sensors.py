"""Sensors behave as their formulas say."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.simulation.kinect_sensors import KinectV1, KinectV2
from stairmap.simulation.render import RayCaster, Rendering
from stairmap.simulation.sensor_effects import find_jumps
from stairmap.simulation.sensors import SENSORS, PhoneLidar, RealSenseD435, Sensor, make_sensor
from stairmap.simulation.triangle_mesh import TriangleMesh, joined

PLANAR = [(0.7, 0.0), (1.5, 0.0), (3.0, 0.0), (2.0, 40.0), (2.0, 65.0), (1.2, 70.0)]
"""Depths in m and angles in deg."""


def make_plane(depth: float, angle_deg: float, half: float = 40.0) -> TriangleMesh:
    """Plane through (0, 0, depth) of the camera frame, turned about the image's vertical axis."""
    angle = np.radians(angle_deg)
    across = half * np.array([np.cos(angle), 0.0, np.sin(angle)])
    up, center = np.array([0.0, half, 0.0]), np.array([0.0, 0.0, depth])
    corners = [center - across - up, center + across - up, center + across + up, center - across + up]
    return TriangleMesh(vertices=np.array(corners), triangles=np.array([[0, 1, 2], [0, 2, 3]]))


def make_step(near: float, far: float) -> TriangleMesh:
    """Plane at ``near`` to the right of the optical axis, another at ``far`` everywhere."""
    right = np.array([[0, -5, near], [5, -5, near], [5, 5, near], [0, 5, near]], dtype=float)
    return joined(
        [TriangleMesh(vertices=right, triangles=np.array([[0, 1, 2], [0, 2, 3]])), make_plane(far, 0.0)]
    )


def render(sensor: Sensor, mesh: TriangleMesh) -> Rendering:
    return RayCaster(mesh).render(sensor.camera, np.eye(4))


def errors_at(sensor: Sensor, depth: float, angle_deg: float) -> tuple[np.ndarray, float, float]:
    """Relative-to-truth errors on a plane where depth and angle are nearly constant, in a band of columns."""
    rendering = render(sensor, make_plane(depth, angle_deg))
    wanted = np.abs(rendering.depth / depth - 1) < 0.02
    wanted &= np.abs(rendering.incidence - np.radians(angle_deg)) < np.radians(3)
    seeds = range(6)
    measured = [sensor.measure(rendering, np.random.default_rng(seed)) for seed in seeds]
    errors = np.concatenate([(image - rendering.depth)[wanted] for image in measured])
    return errors[np.isfinite(errors)], float(np.nanmean(rendering.depth[wanted])), np.radians(angle_deg)


@pytest.mark.parametrize(("depth", "angle_deg"), PLANAR)
def test_kinect_v1_noise_is_that_of_nguyen_with_quantisation_included(depth: float, angle_deg: float) -> None:
    errors, mean_depth, angle = errors_at(make_sensor("kinect_v1"), depth, angle_deg)
    expected = float(KinectV1.axial_std(np.array(mean_depth), np.array(angle)))
    assert errors.std() == pytest.approx(expected, rel=0.06)
    assert abs(errors.mean()) < 0.1 * expected + 1e-4


@pytest.mark.parametrize(("depth", "angle_deg"), PLANAR)
def test_kinect_v2_noise_is_that_of_fankhauser(depth: float, angle_deg: float) -> None:
    errors, mean_depth, angle = errors_at(make_sensor("kinect_v2"), depth, angle_deg)
    expected = float(KinectV2.axial_std(np.array(mean_depth), np.array(angle)))
    assert errors.std() == pytest.approx(expected, rel=0.08)


@pytest.mark.parametrize("depth", [0.7, 1.5, 3.0])
@pytest.mark.parametrize("factor", [0.5, 1.0])
def test_d435_noise_is_constant_in_disparity(depth: float, factor: float) -> None:
    sensor = make_sensor("d435", factor=factor)
    errors, _, _ = errors_at(sensor, depth, 0.0)
    assert errors.std() == pytest.approx(float(RealSenseD435.axial_std(np.array(depth))), rel=0.08)


def test_formulas_give_the_published_values() -> None:
    zero = np.array(0.0)
    assert KinectV1.axial_std(np.array(3.0), zero) == pytest.approx(0.0012 + 0.0019 * 2.6**2)
    assert KinectV1.step(np.array(3.0)) == pytest.approx(2.85e-3 * 9, rel=0.002)
    assert KinectV1.lateral_std(zero) == pytest.approx(0.8)
    steep = np.radians(70.0)
    ratio = steep**2 / (np.pi / 2 - steep) ** 2
    extra = KinectV1.axial_std(np.array(2.0), np.array(steep)) - KinectV1.axial_std(np.array(2.0), zero)
    assert extra == pytest.approx(0.0001 / np.sqrt(2.0) * ratio)
    assert KinectV2.axial_std(np.array(2.0), zero) == pytest.approx(1e-3 * (1.5 - 1.0 + 1.2))
    assert RealSenseD435.axial_std(np.array(2.0)) == pytest.approx(4 * 0.08 / (385 * 0.05))
    assert PhoneLidar.axial_std(np.array(2.0)) == pytest.approx(0.009)


def test_kinect_v1_depths_are_whole_disparities() -> None:
    sensor = make_sensor("kinect_v1", factor=0.5)
    depth = sensor.measure(render(sensor, make_plane(2.5, 20.0)), np.random.default_rng(0))
    quanta = 351.3 / depth[np.isfinite(depth)].astype(np.float64)
    assert np.abs(quanta - np.rint(quanta)).max() < 1e-4


def test_d435_noise_is_correlated_over_five_to_ten_pixels() -> None:
    sensor = make_sensor("d435")
    rendering = render(sensor, make_plane(2.0, 0.0))
    error = (sensor.measure(rendering, np.random.default_rng(0)) - rendering.depth)[:, 20:]
    correlation = [np.nanmean(error[:, :-lag] * error[:, lag:]) / np.nanvar(error) for lag in (5, 10)]
    assert correlation[0] > np.exp(-1) > correlation[1]


def test_kinect_v1_jitters_edges_and_not_planes() -> None:
    sensor = make_sensor("kinect_v1")
    rendering = render(sensor, make_step(1.5, 3.0))
    depth = sensor.measure(rendering, np.random.default_rng(0))
    changed = np.isfinite(depth) & (np.abs(depth - rendering.depth) > 0.3)
    columns = np.flatnonzero(changed.any(axis=0))
    assert len(columns) > 1
    assert np.abs(columns - sensor.camera.cx).max() < 6


def test_kinect_v1_has_the_projectors_shadow_on_the_left_of_near_things() -> None:
    sensor = make_sensor("kinect_v1")
    depth = sensor.measure(render(sensor, make_step(1.5, 3.0)), np.random.default_rng(0))
    missing = np.isnan(depth).mean(axis=0)
    width = 585 * 0.075 * (1 / 1.5 - 1 / 3.0)
    assert missing[int(320 - width) + 2 : 317].min() > 0.99
    assert missing[: int(320 - width) - 4].max() < 0.05


def test_kinect_v2_has_flying_pixels_between_the_surfaces() -> None:
    sensor = make_sensor("kinect_v2")
    depth = sensor.measure(render(sensor, make_step(1.5, 3.0)), np.random.default_rng(0))
    flying = (depth > 1.6) & (depth < 2.9)
    assert flying[:, 254:258].any(axis=1).mean() > 0.25
    assert not flying[:, :250].any()


def test_d435_fattens_edges_by_half_a_window_and_has_a_left_band() -> None:
    sensor = make_sensor("d435")
    rendering = render(sensor, make_step(1.5, 3.0))
    depth = sensor.measure(rendering, np.random.default_rng(0))
    first_near = int(np.argmax((depth < 2.0).mean(axis=0) > 0.8))
    exact = int(np.argmax(rendering.depth[240] < 2.0))
    assert first_near in (exact - 3, exact)
    band = np.isnan(depth).all(axis=0)
    assert np.flatnonzero(~band)[0] == pytest.approx(385 * 0.05 / 3.0, abs=1.5)


@pytest.mark.parametrize("name", sorted(SENSORS))
def test_what_is_out_of_range_is_nan(name: str) -> None:
    sensor = make_sensor(name, factor=0.5)
    depth = sensor.measure(render(sensor, make_plane(sensor.max_depth + 1.5, 0.0)), np.random.default_rng(0))
    assert np.isnan(depth).all()
    assert depth.dtype == np.float32


@pytest.mark.parametrize("name", sorted(SENSORS))
def test_equal_seeds_give_equal_bits_and_others_do_not(name: str) -> None:
    sensor = make_sensor(name, factor=0.5)
    rendering = render(sensor, make_step(1.5, 3.0))
    first, again, other = (sensor.measure(rendering, np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert first.tobytes() == again.tobytes()
    assert name == "ideal" or first.tobytes() != other.tobytes()
    assert first.shape == (sensor.camera.height, sensor.camera.width)


def test_grazing_planes_are_dropped_by_the_kinect() -> None:
    sensor = make_sensor("kinect_v1", factor=0.5)
    rendering = render(sensor, make_plane(1.5, 60.0))
    depth = sensor.measure(rendering, np.random.default_rng(0))
    inside = (rendering.depth > 0.6) & (rendering.depth < 4.5)
    assert np.isnan(depth[inside & (rendering.incidence > np.radians(85))]).all()
    assert np.isnan(depth[inside & (rendering.incidence < np.radians(74))]).mean() < 0.01


def test_a_crease_is_no_jump_and_a_step_is_one() -> None:
    sensor = make_sensor("ideal", factor=0.5)
    roof = joined([make_plane(2.0, 50.0), make_plane(2.0, -50.0)])
    assert not find_jumps(render(sensor, roof)).any()
    jumps = find_jumps(render(sensor, make_step(1.5, 3.0)))
    assert np.flatnonzero(jumps.any(axis=0)).tolist() == [159, 160]


def test_an_unknown_sensor_names_the_known_ones() -> None:
    with pytest.raises(ValueError, match="kinect_v1"):
        make_sensor("sonar")
