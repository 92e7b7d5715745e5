"""Views measure what they show, and images on their side come with the pose of the turned image."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.simulation.kind_scenes import (
    make_ascending_scene,
    make_descending_scene,
    make_sloping_scene,
)
from stairmap.simulation.kinect_sensors import KinectV1
from stairmap.simulation.render import RayCaster
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.viewpoints import look_along, look_at
from stairmap.simulation.views import StepsInView, View, take_view, turned_camera, with_roll

SHAPE = FlightShape(rise=0.17, run=0.29, width=1.2, num_risers=4)


def make_test_view(
    *, sensor: str = "ideal", factor: float = 0.5, is_down: bool = False, x: float = -1.5, z: float = 0.4,
    shape: FlightShape = SHAPE,
) -> View:  # fmt: skip
    """A view straight along the stairs, level when it looks up and 45 deg down when it looks down."""
    make = make_descending_scene if is_down else make_ascending_scene
    direction = [1.0, 0.0, -1.0 if is_down else 0.0]
    return View(
        kind="test", group="", scene=make("test", shape, np.random.default_rng(0)),
        sensor=make_sensor(sensor, factor=factor), map_from_camera=look_along([x, 0.0, z], direction),
        seed=(0,),
    )  # fmt: skip


def steps_of(view: View) -> StepsInView:
    _, seen = take_view(view)
    assert seen is not None
    return seen


def test_risers_cover_as_many_rows_as_their_height_over_their_distance() -> None:
    seen = steps_of(make_test_view())
    distances = 1.5 + 0.29 * np.arange(4)
    # The third tread is above the camera and hides the foot of the fourth riser.
    heights = np.array([0.17, 0.17, 0.17, 0.28 - 0.11 / distances[2] * distances[3]])
    np.testing.assert_allclose(seen.riser_rows, 262.5 * heights / distances, atol=1.0)
    assert seen.tread_rows[0] == pytest.approx(262.5 * 0.23 * (1 / 1.5 - 1 / 1.79), abs=1.0)
    assert seen.tread_rows[2] == 0.0
    assert np.isinf(seen.riser_sigmas).all()


def test_rows_are_those_of_the_working_image_whatever_the_sensors_size() -> None:
    half, full = steps_of(make_test_view()), steps_of(make_test_view(factor=1.0))
    np.testing.assert_allclose(half.riser_rows, full.riser_rows, atol=1.0)
    assert half.tread_rows[0] > 4
    np.testing.assert_allclose(half.tread_rows, full.tread_rows, atol=1.0)


def test_lips_count_as_riser_and_what_is_under_them_not_as_tread() -> None:
    shape = replace(SHAPE, overhang=0.04, lip=0.03)
    plain, lipped = steps_of(make_test_view(z=0.1)), steps_of(make_test_view(z=0.1, shape=shape))
    # Seen from below, the shaded underside takes rows of the riser; the riser stands 40 mm farther back.
    assert 0 < plain.riser_rows[1] - lipped.riser_rows[1] < 3
    np.testing.assert_allclose(lipped.tread_rows, 0.0)


def test_looking_down_treads_show_their_depth_and_risers_nothing() -> None:
    view = make_test_view(is_down=True, x=-0.3, z=0.6)
    seen = steps_of(view)
    np.testing.assert_allclose(seen.riser_rows, 0.0)
    # The top nosing hides a part of the tread below it: a ray over it falls 0.6 m in 0.3 m.
    camera, pose = view.camera, view.map_from_camera
    ends = np.array([[0.17 / 0.6 * 0.3, 0, -0.17], [0.29, 0, -0.17]])
    pixels = camera.project((ends - pose[:3, 3]) @ pose[:3, :3])
    assert seen.tread_rows[2] == pytest.approx(pixels[0, 1] - pixels[1, 1], abs=1.0)


def test_what_is_out_of_range_or_hidden_is_not_seen() -> None:
    far = steps_of(make_test_view(sensor="kinect_v1", x=-4.6))
    assert far.riser_rows[0] > 0 and far.riser_rows[1] > 0
    assert far.riser_rows[3] == 0.0 and far.riser_sigmas[3] == 0.0


def test_sigmas_are_the_rise_in_the_sensors_deviations() -> None:
    seen = steps_of(make_test_view(sensor="kinect_v1", x=-2.0))
    expected = 0.17 / float(KinectV1.axial_std(np.array(2.0), np.array(0.0)))
    assert seen.riser_sigmas[0] == pytest.approx(expected, rel=0.05)
    farther = 0.17 / float(KinectV1.axial_std(np.array(2.29), np.array(0.0)))
    assert seen.riser_sigmas[1] == pytest.approx(farther, rel=0.05)
    assert steps_of(make_test_view(sensor="phone_lidar", x=-2.0)).riser_sigmas[0] == pytest.approx(
        0.17 / 0.009, rel=0.05
    )


def test_stairs_that_slope_sideways_show_as_much_as_level_ones() -> None:
    level = make_test_view()
    scene = make_sloping_scene("test", SHAPE, np.random.default_rng(0), along=0.0, across=0.04)
    sloping, seen = steps_of(replace(level, scene=scene)), steps_of(level)
    np.testing.assert_allclose(sloping.tread_rows[:2], seen.tread_rows[:2], atol=1.0)
    np.testing.assert_allclose(sloping.riser_rows[:3], seen.riser_rows[:3], atol=1.5)


@pytest.mark.parametrize("degrees", [45, 90, 180])
def test_roll_hardly_changes_how_many_rows_a_step_covers(degrees: float) -> None:
    view = make_test_view()
    rolled = steps_of(with_roll(view, np.radians(degrees)))
    np.testing.assert_allclose(rolled.riser_rows, steps_of(view).riser_rows, rtol=0.1, atol=1.5)


def test_a_rolled_view_has_its_up_turned_and_its_axis_kept() -> None:
    view = make_test_view()
    rolled = with_roll(view, np.radians(90))
    np.testing.assert_allclose(rolled.map_from_camera[:3, 2], view.map_from_camera[:3, 2], atol=1e-12)
    np.testing.assert_allclose(rolled.frame(np.ones((240, 320), np.float32)).up, [-1, 0, 0], atol=1e-9)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_turned_image_is_what_a_camera_of_that_format_sees_from_the_same_pose(turns: int) -> None:
    pose = look_at([-1.5, 0.4, 0.6], [0.5, 0.0, 0.4], roll=0.1)
    view = replace(make_test_view(), map_from_camera=pose, quarter_turns=turns)
    depth, _ = take_view(view)
    expected = RayCaster(view.scene.mesh).render(view.camera, pose).depth
    assert depth.shape == ((320, 240) if turns % 2 else (240, 320))
    same = np.isclose(depth, expected, atol=1e-4) | (expected > 10)
    assert same.mean() > 0.999


def test_four_quarter_turns_are_none() -> None:
    camera = make_sensor("kinect_v2").camera
    assert turned_camera(camera, 4) == camera
    off_center = PinholeCamera(width=100, height=50, fx=80, fy=70, cx=20, cy=30)
    assert turned_camera(off_center, 1) == PinholeCamera(width=50, height=100, fx=70, fy=80, cx=30, cy=79)
    assert turned_camera(off_center, 3) == PinholeCamera(width=50, height=100, fx=70, fy=80, cx=19, cy=20)


def test_noise_depends_on_the_seed_alone() -> None:
    view = make_test_view(sensor="d435")
    first, again, other = (take_view(replace(view, seed=(seed,)))[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other, equal_nan=True)


def test_what_is_seen_comes_back_from_json() -> None:
    seen = StepsInView(
        tread_rows=np.array([0.0, 3.25]),
        riser_rows=np.array([7.5, 1.0]),
        riser_sigmas=np.array([np.inf, 2.0]),
    )
    again = StepsInView.from_dict(seen.to_dict())
    for name in ("tread_rows", "riser_rows", "riser_sigmas"):
        np.testing.assert_array_equal(getattr(again, name), getattr(seen, name))
