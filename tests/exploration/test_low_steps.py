"""Lowest steps of stairs in a map, and whether somebody looked at them from the front."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, room_with

from stairmap.exploration.candidates import find_tasks
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.low_steps import find_low_steps
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid

TREAD = np.s_[18:24, 20:44]
"""Rows and columns of a tread 1.2 m wide and 0.3 m deep; up is along the rows."""


def level_with(*, second=None, ground=np.s_[0:18, :]):
    """Return grid and tops of 4 by 4 m with one tread at 1 m, a second where it is given."""
    cells = np.full((80, 80), UNKNOWN, dtype=np.int8)
    cells[ground] = FREE
    tops = np.zeros(cells.shape, dtype=np.float32)
    tops[TREAD] = 0.15
    if second is not None:
        tops[second] = 0.30
    return OccupancyGrid(cells=cells, resolution=0.05, origin=(0.0, 0.0)), tops


def test_one_step_leads_up_away_from_the_ground_before_it():
    (found,) = find_low_steps(*level_with())
    assert found.num_seen == 1
    assert found.heading == pytest.approx(math.pi / 2, abs=0.05)
    assert found.place == pytest.approx((1.6, 1.05), abs=0.08)
    (found,) = find_low_steps(*level_with(ground=np.s_[24:60, :]))
    assert found.heading == pytest.approx(-math.pi / 2, abs=0.05)


def test_of_two_steps_up_is_square_to_them_though_little_was_seen_of_the_second():
    (found,) = find_low_steps(*level_with(second=np.s_[24:30, 20:32]))
    assert found.num_seen == 2
    assert found.heading == pytest.approx(math.pi / 2, abs=0.05)


def test_what_is_as_deep_as_a_bed_is_no_step():
    grid, tops = level_with()
    tops[18:40, 20:44] = 0.15
    assert not find_low_steps(grid, tops)


def looks_of(mesh, *poses):
    """Return the reasons of the looks that a robot wants after frames at poses (x, y, degrees)."""
    known = None
    for x, y, heading in poses:
        robot = robot_in(mesh, x, y, heading)
        if known is None:
            known = ExplorationMap(SPOT, robot.pose)
            level, _ = known.enter_level()
        robot.counters.time_s = 1.0 + len(known.poses)
        for _ in range(2):
            known.localizer = type(known.localizer)(robot.pose, is_perfect=True)
            known.take(robot.look())
    return [task.reason for task in find_tasks(known, level, known.search(level)) if task.kind == "look"]


def test_a_step_that_nobody_faced_is_looked_at_and_a_kerb_that_was_faced_is_none():
    kerb = room_with(([3.0, 1.4, 0.0], [3.3, 2.6, 0.15]))
    aside = ((2.6, 0.6, 60.0), (2.6, 0.6, 150.0))
    assert looks_of(kerb, *aside) == ["may be a lowest step"]
    assert not looks_of(kerb, *aside, (1.3, 2.0, 0.0))


@pytest.mark.parametrize(
    ("pose", "is_faced"),
    [
        ((2.2, 2.0, 0.0), True),
        ((0.6, 2.0, 0.0), False),
        ((3.2, 2.0, 0.0), False),
        ((2.2, 2.0, 40.0), False),
        ((3.0, 0.8, 50.0), False),
    ],
    ids=["from the front", "from 3.4 m", "from 0.7 m", "looking past it", "from 50 degrees aside"],
)
def test_a_place_was_faced_in_the_middle_of_the_view_and_from_before_it(pose, is_faced):
    robot = robot_in(room_with(), *pose)
    known = ExplorationMap(SPOT, robot.pose)
    level, _ = known.enter_level()
    known.take(robot.look())
    assert known.was_faced(level, np.array([4.0 if pose[0] < 3 else 3.9, 2.0]), 0.0) is is_faced
