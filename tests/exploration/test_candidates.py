"""What counts as a task: stairs beside stairs that are known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, stairs

from stairmap.exploration.candidates import is_on_link, nearest_open, staging_spot
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.odometry import Planar
from stairmap.exploration.other_levels import tasks_there
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner

BESIDE = np.array([4.0, 2.6])
"""Half a metre behind the last nosing, where a flight may begin that turns off the landing."""


def test_stairs_of_another_heading_beside_the_end_of_a_flight_are_looked_at():
    _, stairway = stairs()
    known = ExplorationMap(SPOT, Planar(x=4.1, y=2.0, z=0.9, heading=0.0))
    level, _ = known.enter_level()
    known.stairs.update([stairway], known.levels)
    assert is_on_link(known, level, BESIDE, 0.1)
    assert is_on_link(known, level, BESIDE)
    assert not is_on_link(known, level, BESIDE, math.pi / 2)
    assert not is_on_link(known, level, BESIDE, -math.pi)


def search_of(open_cells):
    """Return a search from (0.55, 2.05) over 7 by 4 m of open ground of 0.1 m."""
    grid = OccupancyGrid(
        cells=np.where(open_cells, FREE, UNKNOWN).astype(np.int8), resolution=0.1, origin=(0.0, 0.0)
    )
    planner = FloorPlanner({0: grid}, (), SPOT.profile)
    return LevelSearch(
        level=0, grid=grid, open_ground=grid, opaque=~open_cells, planner=planner,
        found=planner.search(0, np.array([0.55, 2.05])),
    )  # fmt: skip


def test_stairs_are_entered_from_behind_a_staging_pose_that_cannot_be_reached_but_not_from_aside():
    _, stairway = stairs()
    known = ExplorationMap(SPOT, Planar(x=0.5, y=2.0, z=0.0, heading=0.0))
    known.enter_level()
    known.stairs.update([stairway], known.levels)
    link = known.stairs.links[0]
    pose = link.portal.lower
    everything = np.zeros((40, 70), dtype=bool)
    everything[5:35, 5:19] = True
    place, cost = staging_spot(search_of(everything), link, pose, SPOT.radius)
    assert place == pytest.approx(pose.position[:2], abs=0.08)
    assert cost > 0
    # Something keeps the robot 0.3 m from the pose, which stays an island.
    island = everything.copy()
    island[15:26, 11:18] = False
    island[20, 14] = True
    place, _ = staging_spot(search_of(island), link, pose, SPOT.radius)
    assert place[0] < pose.position[0] - 0.3
    assert abs(place[1] - 2.0) < 0.35
    beside = everything.copy()
    beside[15:26, 6:] = False
    assert staging_spot(search_of(beside), link, pose, SPOT.radius) is None


def test_a_look_is_taken_from_where_nothing_hides_its_target():
    everything = np.ones((40, 70), dtype=bool)
    search = search_of(everything)
    target = np.array([3.45, 2.05])
    place, _ = nearest_open(search, np.array([2.45, 2.05]), 1.5, target)
    assert place == pytest.approx((2.45, 2.05), abs=0.01)
    search.opaque[10:30, 30] = True
    place, _ = nearest_open(search, np.array([2.45, 2.05]), 1.5, target)
    assert place[0] > 3.1 or abs(place[1] - 2.05) > 0.9
    search.opaque[:, 30] = True
    assert nearest_open(search, np.array([2.45, 2.05]), 0.5, target) is None


def test_what_another_level_asks_for_is_kept_until_its_map_or_a_flight_from_it_changes():
    mesh, stairway = stairs()
    robot = robot_in(mesh, 0.8, 2.0)
    known = ExplorationMap(SPOT, robot.pose)
    level, _ = known.enter_level()
    known.take(robot.look())
    place = robot.pose.place[:2]
    first = known.search_elsewhere(level, place)
    tasks = tasks_there(known, level, first)
    assert known.search_elsewhere(level, place) is first
    assert tasks_there(known, level, first) is tasks
    known.stairs.update([stairway], known.levels)
    second = known.search_elsewhere(level, place)
    assert second is not first
    assert tasks_there(known, level, second) is not tasks
    level.map.block(place[None] + 1.0)
    assert known.search_elsewhere(level, place) is not second
