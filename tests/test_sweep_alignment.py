"""Planes in cubes, and sweeps that are moved onto them."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.sweep_alignment import CUBE, PlaneMap, cube_keys, cube_middles, evenly
from stairmap.transforms import rotation_from_vector, transform_from_parts, transform_points

NOISE = 0.01
LIDAR = np.array([0.5, 0.2, 0.6])


def room(random: np.random.Generator, num: int = 6000) -> np.ndarray:
    """Points on a floor and two walls, with noise."""
    floor = random.uniform([-1, -2, 0], [4, 2, 0], (num, 3))
    front = random.uniform([4, -2, 0], [4, 2, 2], (num, 3))
    side = random.uniform([-1, 2, 0], [4, 2, 2], (num, 3))
    return np.concatenate([floor, front, side]) + random.normal(0, NOISE, (3 * num, 3))


def moved_by(turn: list[float], shift: list[float]) -> np.ndarray:
    """A motion about where the LiDAR is."""
    motion = transform_from_parts(rotation_from_vector(turn), np.add(LIDAR, shift))
    return motion @ transform_from_parts(np.eye(3), -LIDAR)


@pytest.mark.parametrize(
    ("turn", "shift"),
    [([0.008, 0, 0], [0, 0, 0]), ([0, -0.008, 0.004], [0, 0, 0.015]), ([0, 0, 0.01], [0.02, -0.02, 0])],
    ids=["roll", "pitch and height", "heading and place"],
)
def test_a_sweep_that_its_pose_shook_is_put_back(turn: list[float], shift: list[float]) -> None:
    random = np.random.default_rng(0)
    planes = PlaneMap()
    planes.add(room(random))
    true = room(random)
    shaken = transform_points(moved_by(turn, shift), true)
    before = np.linalg.norm(shaken - true, axis=1)
    after = np.linalg.norm(transform_points(planes.align(shaken, LIDAR), shaken) - true, axis=1)
    assert after.mean() < 0.25 * before.mean()
    assert after.mean() < 0.004


def test_along_a_corridor_only_the_poses_tell() -> None:
    random = np.random.default_rng(1)
    planes = PlaneMap()
    corridor = random.uniform([-6, -1, 0], [6, 1, 0], (16000, 3))
    corridor[::2, 1:] = np.column_stack([np.ones(8000), random.uniform(0, 2, 8000)])
    planes.add(corridor + random.normal(0, NOISE, corridor.shape))
    motion = planes.align(corridor + np.array([0.05, 0.0, 0.02]), LIDAR)
    assert motion[0, 3] == pytest.approx(0.0, abs=0.003)
    assert motion[2, 3] == pytest.approx(-0.02, abs=0.003)


def test_edges_and_lines_are_no_planes() -> None:
    random = np.random.default_rng(2)
    planes = PlaneMap()
    middles = cube_middles(cube_keys(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]])))
    reach = 0.4 * CUBE
    line = random.uniform([-reach, 0, 0], [reach, 0, 0], (200, 3))
    tread = random.uniform([0, -reach, 0], [reach, reach, 0], (200, 3))
    riser = random.uniform([0, -reach, -reach], [0, reach, 0], (200, 3))
    flat = random.uniform([-reach, -reach, 0], [reach, reach, 0], (200, 3))
    for middle, part in zip(middles, (line, np.concatenate([tread, riser]), flat), strict=True):
        planes.add(middle + part + random.normal(0, 0.002, part.shape))
    anchors, normals, is_plane = planes.planes()
    np.testing.assert_allclose(anchors[is_plane], middles[2:], atol=0.03)
    np.testing.assert_allclose(np.abs(normals[is_plane][:, 2]), 1.0, atol=0.01)


def test_points_are_drawn_from_every_laser_and_always_the_same() -> None:
    chosen = evenly(64_000, 1_000)
    assert len(np.unique(chosen % 64)) == 64
    assert np.all(np.diff(chosen) > 0)
    np.testing.assert_array_equal(chosen, evenly(64_000, 1_000))
    np.testing.assert_array_equal(evenly(5, 10), np.arange(5))


def test_points_that_come_in_parts_make_the_same_planes() -> None:
    points = room(np.random.default_rng(3), 500)
    whole, parts = PlaneMap(), PlaneMap()
    whole.add(points)
    for part in np.array_split(points, 7):
        parts.add(part)
    np.testing.assert_array_equal(whole.weights(), parts.weights())
    for one, other in zip(whole.planes()[:1], parts.planes()[:1], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_without_planes_nothing_is_moved() -> None:
    np.testing.assert_array_equal(PlaneMap().align(np.zeros((5, 3)), LIDAR), np.eye(4))


def test_a_cubes_number_gives_its_middle() -> None:
    points = np.array([[-3.01, 0.1, 7.9], [0.0, -0.001, 0.26]])
    middles = cube_middles(cube_keys(points))
    assert np.all(np.abs(points - middles) <= CUBE / 2 + 1e-12)
