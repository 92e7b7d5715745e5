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
    correct_up,
    estimate_up,
    find_headings,
    find_line_headings,
    level_axes,
)
from stairmap.frame import DepthFrame
from stairmap.geometry import angle_between, normalized
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.simulation.stairs import build_flight
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_prism, make_wall
from stairmap.transforms import rotation_from_vector

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
    assert degrees_between(corrected, up) < 0.1


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
    error = degrees_between(correct_up(surfaces, up, max_correction=LIMIT).up, up)
    assert error < 0.15
    # Taken for inner ones, the windows at nosings and inner corners tilt it more.
    everything = replace(surfaces, is_inner=np.ones_like(surfaces.is_inner))
    assert degrees_between(correct_up(everything, up, max_correction=LIMIT).up, up) > error + 0.1


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


def test_open_stairs_without_risers_show_their_heading_by_their_edges() -> None:
    shape = FlightShape(rise=0.19, run=0.26, width=1.2, num_risers=10, open_risers=True)
    mesh, _ = build_flight(shape, base=np.zeros(3), heading=0.0, random=np.random.default_rng(0))
    pose = pose_looking((-1.2, 0.2, 1.0), yaw=0.2, down=0.05)
    frame = frame_of([joined([mesh, room()])], pose)
    found = find_line_headings(image_of(frame), pose[2, :3], known=[], max_headings=2)
    assert min(abs(heading.angle + 0.2) for heading in found) < np.radians(2.5)


def test_line_headings_leave_out_those_that_are_known() -> None:
    stairs = AnalyticStairs(width=2.0)
    pose = pose_looking((-1.2, 0.2, 0.4), yaw=0.2)
    frame = frame_of([stairs_solid(stairs), room()], pose)
    surfaces = fit_surface_normals(image_of(frame))
    known = find_headings(surfaces, pose[2, :3], max_headings=3)
    others = find_line_headings(image_of(frame), pose[2, :3], known=known, max_headings=2)
    for other in others:
        assert all(abs(other.angle - heading.angle) > np.radians(8) for heading in known)


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
