"""Looks across frontiers: how near they must be, and what counts as seen afterwards."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import robot_in, stairs

from stairmap.exploration.body import load_body
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.frontiers import frontier_mask
from stairmap.exploration.mission import Mission
from stairmap.exploration.odometry import Planar
from stairmap.exploration.sight import are_in_sight, are_in_view
from stairmap.exploration.simulated_pilot import SimulatedPilot
from stairmap.exploration.tasks import Task
from stairmap.navigation.occupancy import FREE, OCCUPIED, OccupancyGrid

pytest.importorskip("py_trees")


def walled():
    """Return a map of 4 by 4 m with a wall at x = 2 m that ends at y = 2 m."""
    cells = np.full((80, 80), FREE, dtype=np.int8)
    cells[:40, 40] = OCCUPIED
    return OccupancyGrid(cells=cells, resolution=0.05, origin=(0.0, 0.0))


def test_what_is_behind_a_wall_or_beside_the_image_was_not_in_view():
    grid = walled()
    wall = grid.cells == OCCUPIED
    targets = np.array([[3.0, 1.0], [3.0, 2.6], [1.0, 0.2]])
    assert are_in_sight(grid, wall, np.array([1.0, 1.0]), targets).tolist() == [False, False, True]
    assert are_in_sight(grid, wall, np.array([1.0, 3.0]), targets).tolist() == [False, True, True]
    ahead = Planar(x=1.0, y=3.0, z=0.0, heading=0.0)
    assert are_in_view(grid, wall, ahead, math.radians(35), targets).tolist() == [False, True, False]


def has_drop_at(level_map, low, high):
    """Tell whether lower ground was seen between two x, m."""
    grid = level_map.grid()
    x = grid.centers(*np.nonzero(level_map.drops()))[:, 0]
    return bool(((x > low) & (x < high)).any())


def test_a_low_camera_goes_to_the_edge_to_see_the_stairs_that_lead_down():
    from stairmap.exploration.behaviours.look_at_frontier import LookAtFrontier  # noqa: PLC0415

    mesh, _ = stairs(rise=0.136, run=0.348, width=4.0)
    body = load_body("go2")
    # The last nosing is at 3.74 m; from 0.9 m before it the steps lie in the shadow of the edge.
    robot = robot_in(mesh, 4.64, 2.0, 180.0, z=0.816, body=body)
    known = ExplorationMap(body, robot.pose)
    level, _ = known.enter_level()
    mission = Mission(known=known, pilot=SimulatedPilot(robot, known, robot.sensor), clock=lambda: 0.0)
    for _ in range(19):
        known.take(robot.look())
        robot.turn(math.radians(20))
        known.believe(robot.odometry.pose)
    grid = level.map.grid()
    edge = grid.centers(*np.nonzero(frontier_mask(grid, level.map.settled)))
    edge = edge[(edge[:, 0] < 3.85) & (np.abs(edge[:, 1] - 2.0) < 0.5)]
    mission.task = Task(
        kind="frontier", level=0, position=[4.64, 2.0], target=[3.76, 2.0], cost=0.0, gain=1.0, cells=edge
    )
    assert len(edge) > 5
    assert not has_drop_at(level.map, 3.0, 3.7)
    for _ in LookAtFrontier(mission).steps():
        pass
    assert has_drop_at(level.map, 3.0, 3.7)
    assert known.pose.x < 4.4
    assert robot.counters.falls == robot.counters.sensor_stops == 0
