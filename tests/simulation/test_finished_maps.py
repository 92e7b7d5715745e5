"""Finished maps of simulated places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.simulation.finished_maps import (
    EYE_HEIGHT,
    MAP_KINDS,
    MAX_RANGE,
    SAME_STATION,
    FinishedMap,
    MapKind,
)
from stairmap.simulation.scenes import make_scene


@pytest.fixture(scope="module")
def scanned() -> FinishedMap:
    return FinishedMap(make_scene("free_standing", 0), coarse("scanner_3mm"), seed=0)


def coarse(name: str) -> MapKind:
    """A kind of map with few points."""
    return replace(MAP_KINDS[name], angular_step=np.radians(0.7))


def test_a_scanner_stands_on_floors_at_both_ends_of_a_flight(scanned: FinishedMap) -> None:
    (flight,) = scanned.flights
    local = (scanned.stations - flight.base) @ flight.map_from_flight[:3, :3]
    np.testing.assert_allclose(local[0], [-1.6, 0.0, EYE_HEIGHT], atol=1e-6)
    heights = np.round(local[:, 2] - EYE_HEIGHT, 6)
    assert set(heights) <= {0.0, round(flight.rise * flight.num_risers, 6)}
    distances = np.linalg.norm(scanned.stations[:, None] - scanned.stations, axis=2)
    assert distances[~np.eye(len(distances), dtype=bool)].min() > SAME_STATION


def test_points_are_off_the_surfaces_by_the_noise(scanned: FinishedMap) -> None:
    part = next(scanned.parts())
    floor = part.points[np.abs(part.points[:, 2]) < 0.03]
    steep = np.abs(floor[:, :2] - scanned.stations[0][:2]).max(axis=1) < 1.0
    assert floor[steep, 2].std() == pytest.approx(0.003, rel=0.3)
    assert np.linalg.norm(part.points - scanned.stations[0], axis=1).max() < MAX_RANGE + 0.05
    assert part.returns[0].sum() > 1000


def test_the_passes_of_a_slam_map_are_two_maps_that_do_not_fit() -> None:
    slam = FinishedMap(make_scene("free_standing", 0), coarse("slam_15mm"), seed=0)
    parts = slam.parts()
    first, second = next(parts).points, next(parts).points
    low = [points[np.abs(points[:, 2]) < 0.08][:, 2] for points in (first, second)]
    assert low[1].mean() - low[0].mean() == pytest.approx(0.008, abs=0.002)
    moved = slam.drift @ [*slam.stations.mean(axis=0), 1.0]
    np.testing.assert_allclose(moved[:3] - slam.stations.mean(axis=0), [0.015, -0.01, 0.004], atol=1e-4)


def test_equal_seeds_give_equal_maps(scanned: FinishedMap) -> None:
    again = FinishedMap(scanned.scene, scanned.kind, seed=0)
    other = FinishedMap(scanned.scene, scanned.kind, seed=1)
    one, same, different = (next(item.parts()).points for item in (scanned, again, other))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, different)
