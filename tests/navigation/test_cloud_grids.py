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
