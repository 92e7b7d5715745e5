"""Floors cut from a map of points."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.navigation.cloud_grids import grids_from_points
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, MapError

FLOORS = FloorStack(
    floors=(
        Floor(level=0, height=0.0, is_explored=False),
        Floor(level=1, height=3.0, is_explored=False),
    ),
    levels={},
)


def level_points(low: tuple[float, float], high: tuple[float, float], z: float) -> np.ndarray:
    x, y = np.meshgrid(np.arange(low[0], high[0], 0.03), np.arange(low[1], high[1], 0.03))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


def test_floor_is_free_and_what_stands_on_it_occupied() -> None:
    box = np.concatenate([level_points((2, 2), (2.5, 2.5), z) for z in (0.3, 0.6)])
    ceiling = level_points((0, 0), (5, 4), 2.5)
    grids = grids_from_points(np.concatenate([level_points((0, 0), (5, 4), 0.01), box, ceiling]), FLOORS)

    assert list(grids) == [0]
    assert grids[0].value_at((1.0, 1.0)) == FREE
    assert grids[0].value_at((2.25, 2.25)) == OCCUPIED
    assert grids[0].value_at((5.2, 2.0)) == UNKNOWN


def test_single_points_above_the_floor_are_no_obstacle() -> None:
    points = np.concatenate([level_points((0, 0), (5, 4), 0.0), [[1.0, 1.0, 0.5], [1.0, 1.0, 0.9]]])

    assert grids_from_points(points, FLOORS)[0].value_at((1.0, 1.0)) == FREE


def test_the_shadow_of_a_tripod_is_floor_and_a_stairwell_is_not() -> None:
    floor = level_points((0, 0), (8, 6), 3.0)
    in_shadow = np.hypot(floor[:, 0] - 2, floor[:, 1] - 3) < 0.8
    in_well = (np.abs(floor[:, 0] - 5) < 0.5) & (np.abs(floor[:, 1] - 3) < 1.6)
    grid = grids_from_points(floor[~in_shadow & ~in_well], FLOORS)[1]

    assert grid.value_at((2.0, 3.0)) == FREE
    assert grid.value_at((5.0, 3.0)) == UNKNOWN


def test_a_map_without_floors_is_refused() -> None:
    with pytest.raises(MapError, match="no point of the map lies on a floor"):
        grids_from_points(level_points((0, 0), (2, 2), 1.5), FLOORS)


def test_a_map_of_a_country_is_refused() -> None:
    points = np.array([[0.0, 0.0, 0.0], [9e4, 9e4, 0.0]])

    with pytest.raises(MapError, match="floor 0 reaches over"):
        grids_from_points(points, FLOORS)


def value_in_hole(width: float, depth: float, *, round_hole: bool = False, wall: float = 0.0) -> int | None:
    """Value in the middle of a hole of a floor; a wall stands around this share of the hole."""
    floor = level_points((0, 0), (8, 8), 0.0)
    offset = np.abs(floor[:, :2] - 4.0) / [width / 2, depth / 2]
    is_hole = np.hypot(*offset.T) < 1 if round_hole else offset.max(axis=1) < 1
    parts = [floor[~is_hole]]
    if wall:
        ring = np.hypot(*(floor[:, :2] - 4.0).T)
        angle = np.arctan2(*(floor[:, :2] - 4.0).T) / (2 * np.pi) + 0.5
        stands = floor[~is_hole & (ring < width / 2 + 0.15) & (angle < wall)]
        parts += [stands + np.array([0.0, 0.0, z]) for z in (0.3, 0.5, 0.7, 0.9)]
    return grids_from_points(np.concatenate(parts), FLOORS)[0].value_at((4.0, 4.0))


@pytest.mark.parametrize(("side", "value"), [(1.9, FREE), (2.15, UNKNOWN)])
def test_a_shadow_is_no_larger_than_4_square_metres(side: float, value: int) -> None:
    assert value_in_hole(side, side) == value


@pytest.mark.parametrize(("length", "value"), [(1.5, FREE), (1.75, UNKNOWN)])
def test_a_shadow_is_no_longer_than_1_6_times_its_width(length: float, value: int) -> None:
    assert value_in_hole(length, 1.0) == value
    assert value_in_hole(1.0, length) == value


@pytest.mark.parametrize(("wall", "value"), [(0.4, FREE), (0.6, UNKNOWN)])
def test_half_of_what_is_around_a_shadow_is_free_floor(wall: float, value: int) -> None:
    assert value_in_hole(1.4, 1.4, round_hole=True, wall=wall) == value


@pytest.mark.parametrize("arm", [0.2, 0.8])
def test_a_shadow_fills_six_tenths_of_its_box(arm: float) -> None:
    """A cross of two bars that are so wide is no shadow where they are narrow."""
    floor = level_points((0, 0), (8, 8), 0.0)
    offset = np.abs(floor[:, :2] - 4.0)
    is_hole = (offset.max(axis=1) < 0.7) & (offset.min(axis=1) < arm / 2 + 0.1)
    value = grids_from_points(floor[~is_hole], FLOORS)[0].value_at((4.0, 4.0))
    assert value == (FREE if arm == 0.8 else UNKNOWN)


@pytest.mark.parametrize(
    ("height", "value"),
    [(0.06, FREE), (-0.06, FREE), (0.10, FREE), (0.12, OCCUPIED), (1.19, OCCUPIED), (1.21, FREE)],
)
def test_what_stands_on_a_floor_from_11_cm_to_the_robots_height_is_an_obstacle(
    height: float, value: int
) -> None:
    thing = level_points((2, 2), (2.5, 2.5), height)
    points = np.concatenate([level_points((0, 0), (5, 4), 0.0), thing, thing, thing])
    assert grids_from_points(points, FLOORS)[0].value_at((2.25, 2.25)) == value


@pytest.mark.parametrize(("height", "is_floor"), [(0.06, True), (-0.06, True), (0.08, False), (-0.08, False)])
def test_floor_is_within_7_cm_of_its_height(height: float, is_floor: bool) -> None:
    points = np.concatenate([level_points((0, 0), (1, 1), 0.0), level_points((3, 0), (4, 1), height)])
    assert (grids_from_points(points, FLOORS)[0].value_at((3.5, 0.5)) == FREE) is is_floor


@pytest.mark.parametrize(("num_points", "value"), [(2, FREE), (3, OCCUPIED)])
def test_three_points_make_an_obstacle(num_points: int, value: int) -> None:
    points = np.concatenate([level_points((0, 0), (5, 4), 0.0), [[1.02, 1.02, 0.5]] * num_points])
    assert grids_from_points(points, FLOORS)[0].value_at((1.02, 1.02)) == value


def test_a_map_ends_six_cells_beyond_its_floor() -> None:
    grid = grids_from_points(level_points((1, 2), (2.01, 3.01), 0.0), FLOORS)[0]
    assert grid.origin == pytest.approx((0.7, 1.7), abs=1e-6)
    assert grid.cells.shape == pytest.approx((32, 32), abs=1)
