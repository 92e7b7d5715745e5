"""Up and headings come from the surfaces of one frame."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking
from solid_scenes import FLOOR, frame_of, room, stairs_solid
from stairmap.arrays import Transform, Vector
from stairmap.detection.inverse_depth import (
    InverseDepthImage,
    SurfaceNormals,
    fit_surface_normals,
    inverse_depth_from_frame,
)
from stairmap.detection.orientation import (
    CorrectedUp,
    correct_up,
    estimate_up,
    find_headings,
    find_up_error,
    level_axes,
)
from stairmap.frame import DepthFrame
from stairmap.geometry import angle_between, normalized
from stairmap.simulation.triangle_mesh import TriangleMesh, make_prism, make_wall
from stairmap.transforms import rotation_from_vector

GIVEN_UP_STD = np.radians(2.0)
MAX_RESIDUAL = 1.5
POSE_UP_STD = np.radians(0.4)
"""Limits that hold, written again: who changes one changes it here as well."""

LIMIT = np.radians(6.0)
CORRIDOR = room(ahead=5.0, aside=1.5)


def image_of(frame: DepthFrame) -> InverseDepthImage:
    return inverse_depth_from_frame(frame, max_depth=6.0)


def surfaces_of(*solids: TriangleMesh, pose: Transform) -> SurfaceNormals:
    return fit_surface_normals(image_of(frame_of(solids, pose)))


def turned(up: Vector, angle_deg: float, azimuth: float) -> Vector:
    """``up`` turned by an angle about a level axis."""
    ahead, left = level_axes(up)
    axis = np.cos(azimuth) * ahead + np.sin(azimuth) * left
    return rotation_from_vector(np.radians(angle_deg) * axis) @ up


def degrees_between(first: Vector, second: Vector) -> float:
    return float(np.degrees(angle_between(first, second)))


@pytest.mark.parametrize("azimuth", np.linspace(0, 2 * np.pi, 6, endpoint=False))
def test_correct_up_recovers_an_error_of_4_degrees_from_floor_and_walls(azimuth: float) -> None:
    pose = pose_looking((0, 0, 0.6), yaw=0.3, down=0.35, roll=0.1)
    up = pose[2, :3]
    corrected = correct_up(
        surfaces_of(CORRIDOR, pose=pose), turned(up, 4.0, azimuth), max_correction=LIMIT
    ).up
    # 0.1 before the given up was weighed by its standard deviation: 4 degrees are two of them.
    assert degrees_between(corrected, up) < 0.15


@pytest.mark.parametrize("error_deg", [0.0, 4.0])
def test_correct_up_comes_within_2_degrees_on_treads_and_risers_alone(error_deg: float) -> None:
    # Windows across a crease lean; the refinement of the lattice, which knows its treads, does the rest.
    stairs = AnalyticStairs(width=3.0)
    pose = pose_looking((-0.8, 0, 1.3), down=0.35)
    up = pose[2, :3]
    surfaces = surfaces_of(stairs_solid(stairs), pose=pose)
    assert (
        degrees_between(correct_up(surfaces, turned(up, error_deg, 1.0), max_correction=LIMIT).up, up) < 2.0
    )


def test_correct_up_leaves_a_right_up_alone() -> None:
    pose = pose_looking((0, 0, 0.6), down=0.3)
    up = pose[2, :3]
    assert (
        degrees_between(correct_up(surfaces_of(CORRIDOR, pose=pose), up, max_correction=LIMIT).up, up) < 0.1
    )


@pytest.mark.parametrize("distance", [0.6, 0.9, 1.3])
def test_treads_that_a_sensor_smoothed_tilt_up_by_little(distance: float) -> None:
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
    pose = pose_looking((-distance, 0.0, 1.4), yaw=0.0, down=np.radians(30))
    frame = frame_of([stairs_solid(stairs), make_wall((2.4, -3), (2.4, 3), 0.0, 4.0)], pose)
    depth = 1 / cv2.GaussianBlur(1 / np.nan_to_num(frame.depth, nan=9.0), (0, 0), 2.5)
    noise = cv2.GaussianBlur(np.random.default_rng(0).standard_normal(depth.shape), (0, 0), 6)
    surfaces = fit_surface_normals(image_of(replace(frame, depth=depth + 0.06 * noise)))
    up = pose[2, :3]
    error = degrees_between(correct_up(surfaces, up, max_correction=LIMIT).ground, up)
    assert error < 0.15
    # Taken for inner ones, the windows at nosings and inner corners tilt it more.
    everything = replace(surfaces, is_inner=np.ones_like(surfaces.is_inner))
    assert degrees_between(correct_up(everything, up, max_correction=LIMIT).ground, up) > error + 0.1


def test_correct_up_makes_no_turn_beyond_its_limit() -> None:
    pose = pose_looking((0, 0, 0.6), down=0.3)
    wrong = turned(pose[2, :3], 9.0, 0.5)
    corrected = correct_up(surfaces_of(CORRIDOR, pose=pose), wrong, max_correction=LIMIT).up
    np.testing.assert_array_equal(corrected, wrong)


def test_correct_up_keeps_what_it_was_given_where_nothing_is_level() -> None:
    pose = pose_looking((0, 0, 1.0))
    given = turned(pose[2, :3], 4.0, 0.2)
    walls = make_wall((2.0, -5), (2.0, 5), -3, 5)
    np.testing.assert_array_equal(
        correct_up(surfaces_of(walls, pose=pose), given, max_correction=LIMIT).up, given
    )


@pytest.mark.parametrize("slope_deg", [4.0, 8.0, 12.0, 20.0])
def test_a_ramp_between_walls_does_not_turn_up_beyond_the_limit(slope_deg: float) -> None:
    top = 6 * np.tan(np.radians(slope_deg))
    ramp = make_prism([(-2, -2 * top / 6), (6, top), (6, -3)], -1.5, 1.5)
    walls = [make_wall((-3, y), (6, y), -2, 6) for y in (-1.5, 1.5)]
    pose = pose_looking((0, 0, 0.6), down=0.1)
    up = pose[2, :3]
    corrected = correct_up(surfaces_of(ramp, *walls, pose=pose), up, max_correction=LIMIT).up
    assert degrees_between(corrected, up) <= 6.0
    if slope_deg > 6.0:
        np.testing.assert_array_equal(corrected, up)


@pytest.mark.parametrize("down_deg", [0.0, 10.0, 30.0])
@pytest.mark.parametrize("roll_deg", [-15.0, 0.0, 15.0])
def test_estimate_up_finds_the_floor_of_a_pitched_and_rolled_camera(down_deg: float, roll_deg: float) -> None:
    pose = pose_looking((0, 0, 0.6), yaw=0.4, down=np.radians(down_deg), roll=np.radians(roll_deg))
    up = estimate_up(surfaces_of(CORRIDOR, pose=pose))
    assert up is not None
    assert degrees_between(up, pose[2, :3]) < 0.3


@pytest.mark.parametrize("roll_deg", [-15.0, 0.0, 15.0])
def test_estimate_up_finds_the_floor_of_a_camera_that_looks_up(roll_deg: float) -> None:
    # A level field of view of 49 degrees, pitched up by 10, shows the floor only in its lowest part.
    pose = pose_looking((0, 0, 0.4), down=np.radians(-10), roll=np.radians(roll_deg))
    up = estimate_up(surfaces_of(CORRIDOR, pose=pose))
    assert up is not None
    assert degrees_between(up, pose[2, :3]) < 0.3


def test_estimate_up_finds_none_on_a_wall() -> None:
    wall = make_wall((2.0, -5), (2.0, 5), -3, 5)
    for yaw in (0.0, 0.6):
        assert estimate_up(surfaces_of(wall, pose=pose_looking((0, 0, 1.0), yaw=yaw))) is None


def test_estimate_up_takes_no_ceiling_for_the_floor() -> None:
    pose = pose_looking((0, 0, -1.5), down=-0.5)
    assert estimate_up(surfaces_of(FLOOR, pose=pose)) is None


@pytest.mark.parametrize("azimuth_deg", [-60.0, -20.0, 0.0, 35.0, 70.0])
def test_find_headings_gives_the_azimuth_of_a_wall(azimuth_deg: float) -> None:
    azimuth = np.radians(azimuth_deg)
    along = np.array([-np.sin(azimuth), np.cos(azimuth)])
    middle = 2.0 * np.array([np.cos(azimuth), np.sin(azimuth)])
    wall = make_wall(middle - 5 * along, middle + 5 * along, -1, 4)
    pose = pose_looking((0, 0, 1.0), down=0.2, roll=0.1)
    headings = find_headings(surfaces_of(FLOOR, wall, pose=pose), pose[2, :3], max_headings=3)
    # The camera's level viewing direction is the map's +x. Windows that the image's border cuts may show as
    # one more heading.
    found = np.degrees([heading.angle for heading in headings])
    assert np.abs(found - azimuth_deg).min() < 0.2
    assert len(found) <= 2


def test_find_headings_gives_both_walls_of_a_corner() -> None:
    corner = [make_wall((3, -5), (3, 2), 0, 3), make_wall((-5, 2), (3, 2), 0, 3)]
    pose = pose_looking((0, 0, 1.0), yaw=np.radians(40))
    headings = find_headings(surfaces_of(FLOOR, *corner, pose=pose), pose[2, :3], max_headings=3)
    found = np.degrees([heading.angle for heading in headings])
    # Windows across the corner may show as a third one.
    for azimuth_deg in (-40.0, 50.0):
        assert np.abs(found - azimuth_deg).min() < 0.3


def test_stairs_stand_at_more_distances_than_a_wall() -> None:
    stairs = AnalyticStairs(width=1.0, num_risers=7)
    turned_wall = make_wall((0.5, 1.0), (3.5, 4.0), 0, 4)
    pose = pose_looking((-1.5, 0.3, 0.8), yaw=0.15, down=0.1)
    surfaces = surfaces_of(FLOOR, stairs_solid(stairs), turned_wall, pose=pose)
    headings = find_headings(surfaces, pose[2, :3], max_headings=3)
    assert headings[0].angle == pytest.approx(-0.15, abs=np.radians(0.5))
    assert headings[0].num_distances >= 5
    assert headings[1].num_distances < headings[0].num_distances


def test_an_empty_floor_has_no_headings() -> None:
    pose = pose_looking((0, 0, 1.0), down=0.9)
    assert find_headings(surfaces_of(FLOOR, pose=pose), pose[2, :3], max_headings=3) == []


@pytest.mark.parametrize("up", [[0, -1, 0], [0.1, -0.9, -0.4], [0, 0, -1], [0.02, -0.1, -0.99]])
def test_level_axes_are_level_and_perpendicular(up: list[float]) -> None:
    unit = normalized(up)
    ahead, left = level_axes(unit)
    axes = np.stack([ahead, left, unit])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    if abs(unit[2]) < 0.95:
        assert ahead[2] > 0
    assert KINECT_CAMERA.rays()[120, 0] @ left > KINECT_CAMERA.rays()[120, -1] @ left


def test_axes_of_an_up_along_the_optical_axis_do_not_vanish() -> None:
    for z in (0.94, 0.96, -0.96, 1.0, -1.0):
        ahead, left = level_axes(normalized([0.0, -np.sqrt(1 - z * z), z]))
        assert np.linalg.norm(ahead) == pytest.approx(1.0)
        assert np.linalg.norm(left) == pytest.approx(1.0)


def sloping_ground(
    slope: float, *, azimuth: float = 0.0, walls: bool = True
) -> tuple[SurfaceNormals, Vector, Vector]:
    """Surfaces of ground that climbs along an azimuth, with upright walls or none; up, and its normal."""
    pose = pose_looking((0.0, 0.0, 0.8), down=0.3)
    climb = slope * np.array([np.cos(azimuth), np.sin(azimuth)])
    corners = np.array([[-9, -9], [9, -9], [9, 9], [-9, 9]], dtype=np.float64)
    vertices = np.column_stack([corners, corners @ climb])
    ground = TriangleMesh(vertices=vertices, triangles=np.array([[0, 1, 2], [0, 2, 3]]))
    sides = [make_wall((3.0, -5), (3.0, 5), -2, 4), make_wall((-5, 1.5), (5, 1.5), -2, 4)] if walls else []
    normal = normalized([-climb[0], -climb[1], 1.0])
    return surfaces_of(ground, *sides, pose=pose), pose[2, :3].copy(), pose[:3, :3].T @ normal


def correct(surfaces: SurfaceNormals, up: Vector, std: float) -> CorrectedUp:
    return correct_up(surfaces, up, max_correction=LIMIT, std=std)


@pytest.mark.parametrize("azimuth", [0.0, 1.0, 2.5, -1.5])
def test_the_grounds_normal_is_told_apart_from_up(azimuth: float) -> None:
    surfaces, up, normal = sloping_ground(0.03, azimuth=azimuth)
    corrected = correct(surfaces, up, POSE_UP_STD)
    assert degrees_between(corrected.ground, normal) < 0.15
    assert degrees_between(corrected.up, up) < 0.35


def test_ground_that_slopes_turns_an_up_of_an_imu_more_than_one_of_a_pose() -> None:
    surfaces, up, _ = sloping_ground(0.03, walls=False)
    turns = [degrees_between(correct(surfaces, up, std).up, up) for std in (POSE_UP_STD, GIVEN_UP_STD)]
    assert turns[0] < 0.6 * turns[1]
    # Whether the ground slopes or up is wrong, nothing tells but how common each is.
    assert 0.8 < turns[1] < np.degrees(np.arctan(0.03)) + 0.1


def test_walls_hold_up_where_the_ground_slopes() -> None:
    given_walls, up, _ = sloping_ground(0.03)
    without, _, _ = sloping_ground(0.03, walls=False)
    turns = [degrees_between(correct(found, up, GIVEN_UP_STD).up, up) for found in (given_walls, without)]
    assert turns[0] < 0.9 * turns[1]


def test_a_wrong_up_over_level_ground_is_turned_all_the_way() -> None:
    surfaces, up, _ = sloping_ground(0.0)
    for azimuth in (0.0, 2.0):
        corrected = correct(surfaces, turned(up, 3.0, azimuth), GIVEN_UP_STD)
        assert degrees_between(corrected.up, up) < 0.25
        assert degrees_between(corrected.ground, up) < 0.1


def test_an_up_that_is_corrected_says_how_sure_it_is() -> None:
    level, up, _ = sloping_ground(0.0)
    sloping, _, _ = sloping_ground(0.03, walls=False)
    sure, unsure = correct(level, up, GIVEN_UP_STD), correct(sloping, up, GIVEN_UP_STD)
    assert sure.std < 0.3 * GIVEN_UP_STD
    assert sure.std < unsure.std < GIVEN_UP_STD
    assert correct(level, up, POSE_UP_STD).std < sure.std
    # Its error is no larger than it says.
    wrong = correct(level, turned(up, 2.0, 1.0), GIVEN_UP_STD)
    assert angle_between(wrong.up, up) < 3 * wrong.std


def test_an_up_that_is_not_corrected_is_as_sure_as_it_was() -> None:
    surfaces, up, _ = sloping_ground(0.0)
    wrong = turned(up, 9.0, 0.5)
    kept = correct(surfaces, wrong, 0.01)
    np.testing.assert_array_equal(kept.up, wrong)
    np.testing.assert_array_equal(kept.ground, wrong)
    assert kept.std == 0.01


@pytest.mark.parametrize(("error_deg", "is_made"), [(5.8, True), (6.2, False)])
def test_a_floor_of_a_fifth_of_the_frame_may_turn_up_by_all_that_is_allowed(
    error_deg: float, is_made: bool
) -> None:
    surfaces, up, _ = sloping_ground(0.0)
    wrong = turned(up, error_deg, 0.4)
    corrected = correct(surfaces, wrong, np.radians(10.0)).up
    assert (degrees_between(corrected, wrong) > 1.0) == is_made


def of_normals(*groups: tuple[Vector, int], seed: int = 0, residual: float = 1e-4) -> SurfaceNormals:
    """So many normals about each direction, each off by a degree."""
    random = np.random.default_rng(seed)
    normals = np.concatenate([axis + random.normal(0, np.radians(0.5), (num, 3)) for axis, num in groups])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    num = len(normals)
    return SurfaceNormals(
        normals=normals.astype(np.float32),
        points=(2.0 * normals).astype(np.float32),
        residual=np.full(num, residual, np.float32),
        is_inner=np.ones(num, bool),
        noise=residual,
    )


DOWNWARD, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(("num_level", "is_made"), [(12, True), (9, False)])
def test_few_level_normals_do_not_turn_up(num_level: int, is_made: bool) -> None:
    # Ten at least, or a fiftieth of all.
    lean = rotation_from_vector([0.01, 0.0, 0.0]) @ DOWNWARD
    surfaces = of_normals((lean, num_level), (AHEAD, 300))
    corrected = correct(surfaces, -DOWNWARD, GIVEN_UP_STD)
    assert (not np.array_equal(corrected.up, -DOWNWARD)) == is_made


@pytest.mark.parametrize(("share", "is_made"), [(0.24, True), (0.16, False)])
def test_a_smaller_floor_turns_up_by_less(share: float, is_made: bool) -> None:
    # By 5.4 of 6 degrees: nine tenths of what a fifth of the frame may.
    lean = rotation_from_vector([0.0, 0.0, np.radians(5.4)]) @ DOWNWARD
    num = round(1000 * share)
    surfaces = of_normals((lean, num), (AHEAD, 1000 - num))
    corrected = correct(surfaces, -DOWNWARD, np.radians(6.0))
    assert (not np.array_equal(corrected.up, -DOWNWARD)) == is_made


def test_planes_that_fit_badly_do_not_tell_up() -> None:
    lean = rotation_from_vector([np.radians(4.0), 0.0, 0.0]) @ DOWNWARD
    surfaces = of_normals((DOWNWARD, 200), (lean, 300), (AHEAD, 100), residual=0.002)
    residual = surfaces.residual.copy()
    for factor, is_used in ((0.95 * MAX_RESIDUAL, True), (1.05 * MAX_RESIDUAL, False)):
        residual[200:500] = factor * 0.002
        corrected = correct(replace(surfaces, residual=residual), -DOWNWARD, GIVEN_UP_STD)
        assert (degrees_between(corrected.ground, -DOWNWARD) > 1.0) == is_used


@pytest.mark.parametrize(("error_deg", "is_told"), [(5.0, False), (7.0, True), (25.0, True)])
def test_an_up_farther_off_than_can_be_corrected_is_told(error_deg: float, is_told: bool) -> None:
    surfaces = of_normals((DOWNWARD, 500), (AHEAD, 300))
    wrong = rotation_from_vector([np.radians(error_deg), 0.0, 0.0]) @ -DOWNWARD
    error = find_up_error(surfaces, wrong, max_correction=LIMIT)
    assert (error is not None) == is_told
    if error is not None:
        assert np.degrees(error) == pytest.approx(error_deg, abs=0.2)


@pytest.mark.parametrize(("num_level", "is_told"), [(240, True), (260, False)])
def test_where_half_as_much_is_level_by_the_given_up_the_floor_slopes(num_level: int, is_told: bool) -> None:
    # A ramp of 500 normals, and what is level by the given up.
    ramp = rotation_from_vector([np.radians(15.0), 0.0, 0.0]) @ DOWNWARD
    surfaces = of_normals((ramp, 500), (DOWNWARD, num_level), (AHEAD, 100))
    assert (find_up_error(surfaces, -DOWNWARD, max_correction=LIMIT) is not None) == is_told


def test_without_a_floor_no_up_is_wrong() -> None:
    assert find_up_error(of_normals((AHEAD, 500)), -DOWNWARD, max_correction=LIMIT) is None


@pytest.mark.parametrize(
    ("num", "lean_deg", "is_found"),
    [(120, 50.0, True), (90, 50.0, False), (40, 20.0, True), (25, 20.0, False)],
)
def test_a_floor_takes_a_tenth_of_the_frame_or_3_percent_where_it_is_nearly_level(
    num: int, lean_deg: float, is_found: bool
) -> None:
    lean = rotation_from_vector([np.radians(lean_deg), 0.0, 0.0]) @ DOWNWARD
    found = estimate_up(of_normals((lean, num), (AHEAD, 1000 - num)))
    assert (found is not None) == is_found
    if found is not None:
        assert degrees_between(found, -lean) < 0.3


def test_headings_are_sorted_by_how_many_distances_stand_across_them() -> None:
    aside = rotation_from_vector([0.0, np.radians(40.0), 0.0]) @ AHEAD
    surfaces = of_normals((AHEAD, 400), (aside, 400), (DOWNWARD, 200))
    # What faces ahead stands at one distance, what faces aside at five.
    points = surfaces.points.copy()
    points[400:800] = np.linspace(1.0, 2.0, 5)[np.arange(400) % 5, None] * surfaces.normals[400:800]
    found = find_headings(replace(surfaces, points=points), -DOWNWARD, max_headings=2)
    assert found[0].num_distances >= 5
    assert found[1].num_distances <= 2
    assert np.degrees(found[0].angle) == pytest.approx(-40.0, abs=0.5)
    assert np.degrees(found[1].angle) == pytest.approx(0.0, abs=0.5)
    assert len(find_headings(replace(surfaces, points=points), -DOWNWARD, max_headings=1)) == 1


@pytest.mark.parametrize(("lean_deg", "is_found"), [(25.0, True), (29.0, False)])
def test_surfaces_that_lean_by_less_than_27_degrees_are_upright(lean_deg: float, is_found: bool) -> None:
    leaning = rotation_from_vector([np.radians(lean_deg), 0.0, 0.0]) @ AHEAD
    found = find_headings(of_normals((leaning, 300)), -DOWNWARD, max_headings=2)
    assert bool(found) == is_found


@pytest.mark.parametrize(("aside_deg", "is_found"), [(78.0, True), (82.0, False)])
def test_headings_across_the_view_are_left_out(aside_deg: float, is_found: bool) -> None:
    for sign in (1.0, -1.0):
        aside = rotation_from_vector([0.0, sign * np.radians(aside_deg), 0.0]) @ AHEAD
        found = find_headings(of_normals((aside, 300)), -DOWNWARD, max_headings=2)
        assert bool(found) == is_found


def weighed_turn(
    turn: float, std: float, num_level: int, *, num_walls: int = 0, lean: float = 0.0
) -> tuple[float, float]:
    """How far up must turn about a level axis, and its standard deviation, rad: Bayes' rule on a grid.

    The ground's normal is turned by ``turn``; walls, which tell the same turn, lean by ``lean``.
    """
    angles = np.radians(np.linspace(-8.0, 8.0, 20001))
    sample = np.radians(1.5) ** 2 * 15.0
    # 85 % of floors are level to 0.15 degrees, the others slope by 1.2 (standard deviations). The turn about
    # the other axis is 0, and tells the same of each.
    ground = np.zeros(len(angles))
    for share, slope in ((0.85, np.radians(0.15)), (0.15, np.radians(1.2))):
        variance = sample / num_level + slope**2
        other = 1.0 / (std**2 + variance)
        ground += share / np.sqrt(variance) * np.sqrt(other) * np.exp(-0.5 * (turn - angles) ** 2 / variance)
    density = ground * np.exp(-0.5 * angles**2 / std**2)
    if num_walls:
        # A degree is common to all walls and risers in view.
        density *= np.exp(-0.5 * (angles - lean) ** 2 / (sample / num_walls + np.radians(1.0) ** 2))
    density /= density.sum()
    mean = float(density @ angles)
    return mean, float(np.sqrt(density @ (angles - mean) ** 2))


@pytest.mark.parametrize("std_deg", [0.4, 1.0, 2.0])
@pytest.mark.parametrize("turn_deg", [0.3, 0.8, 1.5])
def test_level_and_sloping_ground_are_weighed_by_how_common_they_are(turn_deg: float, std_deg: float) -> None:
    turned_ground = rotation_from_vector([0.0, 0.0, np.radians(turn_deg)]) @ DOWNWARD
    surfaces = of_normals((turned_ground, 1500))
    found = correct(surfaces, -DOWNWARD, np.radians(std_deg))
    expected, std = weighed_turn(np.radians(turn_deg), np.radians(std_deg), 1500)
    assert degrees_between(found.up, -DOWNWARD) == pytest.approx(np.degrees(expected), abs=0.03)
    assert np.degrees(std) * 0.6 < np.degrees(found.std) < np.degrees(std) * 1.1


@pytest.mark.parametrize("lean_deg", [0.0, 1.5])
def test_walls_and_risers_of_a_view_are_upright_to_a_degree_together(lean_deg: float) -> None:
    # The ground is turned by 1.5 degrees about the optical axis; walls to the left show that turn of up.
    aside = np.array([1.0, 0.0, 0.0])
    lean = rotation_from_vector([0.0, 0.0, np.radians(lean_deg)])
    ground = rotation_from_vector([0.0, 0.0, np.radians(1.5)]) @ DOWNWARD
    surfaces = of_normals((ground, 1000), (lean @ aside, 1000))
    found = correct(surfaces, -DOWNWARD, GIVEN_UP_STD)
    measured = angle_between(found.ground, -DOWNWARD)
    mean, _ = weighed_turn(measured, GIVEN_UP_STD, 1000, num_walls=1000, lean=np.radians(lean_deg))
    assert degrees_between(found.up, -DOWNWARD) == pytest.approx(np.degrees(mean), abs=0.03)
