"""Frontiers with cost and gain, and the choice among tasks."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.exploration.frontiers import REACH, find_frontiers_with_gain
from stairmap.exploration.strategies import VALUE_OF_AREA, choose, is_worthwhile
from stairmap.exploration.tasks import Task
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid


def grid_of(cells):
    return OccupancyGrid(cells=cells, resolution=0.05, origin=(0.0, 0.0))


def coarse_of(cells):
    return OccupancyGrid(cells=cells[::2, ::2], resolution=0.1, origin=(-0.025, -0.025))


def task(kind, cost, gain, **more):
    return Task(kind=kind, level=0, position=[0.0, 0.0], target=[0.0, 0.0], cost=cost, gain=gain, **more)


def half_known():
    cells = np.full((80, 120), UNKNOWN, dtype=np.int8)
    cells[:, :60] = FREE
    return cells


def test_a_frontier_is_reached_from_open_ground_within_sight():
    cells = half_known()
    costs = np.full((40, 60), np.inf)
    costs[:, :26] = np.arange(26)
    found = find_frontiers_with_gain(grid_of(cells), np.zeros(cells.shape, bool), coarse_of(cells), costs)
    assert found
    for frontier in found:
        assert np.linalg.norm(frontier.position - frontier.target) <= REACH + 1e-9
        assert frontier.target[0] == pytest.approx(2.975, abs=0.03)
        assert frontier.gain > 1.0


def test_a_frontier_behind_a_wall_is_none():
    cells = half_known()
    cells[:, 56:58] = OCCUPIED
    costs = np.full((40, 60), np.inf)
    costs[:, :26] = 1.0
    assert not find_frontiers_with_gain(grid_of(cells), np.zeros(cells.shape, bool), coarse_of(cells), costs)


def test_what_was_settled_is_no_frontier():
    cells = half_known()
    costs = np.full((40, 60), 1.0)
    assert not find_frontiers_with_gain(grid_of(cells), np.ones(cells.shape, bool), coarse_of(cells), costs)


def test_stairs_wait_until_no_frontier_is_worthwhile():
    stairs = task("stairs", 50.0, 60.0, link=1)
    near = task("frontier", 20.0, 1.0)
    poor = task("frontier", VALUE_OF_AREA, 0.5)
    assert is_worthwhile(near)
    assert not is_worthwhile(poor)
    assert choose([stairs, near]) is near
    assert choose([stairs, poor]) is stairs
    assert choose([poor]) is poor
    assert choose([]) is None


def test_strategies_to_compare_with():
    stairs = task("stairs", 5.0, 60.0, link=1)
    near, far = task("frontier", 6.0, 1.0), task("frontier", 8.0, 9.0)
    assert choose([near, far]) is far
    assert choose([near, far], strategy="nearest") is near
    assert choose([near, stairs], strategy="nearest") is stairs
    assert choose([near, stairs], strategy="stairs-free") is stairs
    assert choose([near, stairs], strategy="stairs-ignored") is near
    assert choose([stairs], strategy="stairs-ignored") is None


def test_of_equal_gain_the_nearer_comes_first():
    assert choose([task("frontier", 9.0, 2.0), task("frontier", 4.0, 2.0)]).cost == 4.0
