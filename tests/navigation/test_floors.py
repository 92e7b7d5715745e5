"""Floors: from the ends of stairways and the way of the robot."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.navigation.floors import Floor, FloorError, FloorStack, find_floors
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_half_turn, make_stairway

CAMERA_HEIGHT = 0.6


def way(*heights, num=12):
    """Return a way that stays ``num`` poses at each height of a floor."""
    z = np.repeat(np.array(heights, dtype=float), num) + CAMERA_HEIGHT
    poses = np.tile(np.eye(4), (len(z), 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = np.arange(len(z)) * 0.1, z
    return Trajectory(stamps_ns=np.arange(len(z)), map_from_camera=poses)


def full_flight(base_z=0.0, stairway_id=1, num_risers=18):
    return make_stairway(
        make_flight(base=(0, 0, base_z), rise=3.0 / 18, num_risers=num_risers), stairway_id=stairway_id
    )


def test_a_stairway_joins_two_floors_and_the_upper_one_is_unexplored():
    stack = find_floors([full_flight()], way(0.0))
    assert [(floor.level, floor.is_explored) for floor in stack.floors] == [(0, True), (1, False)]
    assert stack.floors[1].height == pytest.approx(3.0)
    assert stack.levels == {1: (0, 1)}
    assert stack.camera_height == pytest.approx(CAMERA_HEIGHT)


def test_a_stairway_down_leads_below_the_floor_where_the_robot_began():
    stack = find_floors([full_flight(base_z=-3.0)], way(0.0))
    assert [floor.level for floor in stack.floors] == [-1, 0]
    assert stack.levels == {1: (-1, 0)}
    assert stack.floor(0).is_explored
    assert not stack.floor(-1).is_explored


def test_ends_that_drift_apart_are_one_floor():
    stack = find_floors([full_flight(), full_flight(base_z=3.2, stairway_id=2)], way(0.0))
    assert len(stack.floors) == 3
    assert stack.levels == {1: (0, 1), 2: (1, 2)}


def test_flights_with_a_landing_between_them_join_two_floors_not_three():
    stack = find_floors([make_half_turn()], way(0.0))
    assert len(stack.floors) == 2


def test_a_few_steps_still_join_two_floors():
    stack = find_floors([full_flight(num_risers=3)], way(0.0))
    assert stack.levels == {1: (0, 1)}


def test_a_floor_that_only_a_lift_leads_to_is_found_from_the_way():
    stack = find_floors([full_flight()], way(0.0, 6.2))
    assert [round(floor.height, 1) for floor in stack.floors] == [0.0, 3.0, 6.2]
    assert [floor.is_explored for floor in stack.floors] == [True, False, True]


def test_who_rests_on_a_landing_two_metres_up_is_on_no_floor():
    stairway = make_half_turn(height=4.2)
    landing = stairway.landings[0].center
    poses = np.tile(np.eye(4), (60, 1, 1))
    poses[20:40, :3, 3] = landing
    poses[40:, :3, 3] = (0.0, 1.3, 4.2)
    poses[:, 2, 3] += CAMERA_HEIGHT
    trajectory = Trajectory(stamps_ns=np.arange(60), map_from_camera=poses)
    assert [round(floor.height, 1) for floor in find_floors([stairway], trajectory).floors] == [0.0, 4.2]


def test_a_visited_upper_floor_is_explored():
    assert find_floors([full_flight()], way(0.0, 3.0)).floors[1].is_explored


def test_without_a_way_the_lowest_floor_is_level_0_and_all_are_unexplored():
    stack = find_floors([full_flight()])
    assert [floor.level for floor in stack.floors] == [0, 1]
    assert not any(floor.is_explored for floor in stack.floors)


def test_without_a_stairway_the_camera_height_must_be_given():
    with pytest.raises(FloorError, match="give the camera's height above it"):
        find_floors([], way(0.0))
    stack = find_floors([], way(0.0), camera_height=CAMERA_HEIGHT)
    assert [floor.height for floor in stack.floors] == pytest.approx([0.0])


def test_an_empty_run_is_told_in_one_line():
    with pytest.raises(FloorError, match="no stairway and no trajectory"):
        find_floors([])


def test_floors_that_overlap_are_refused():
    floors = (Floor(level=0, height=0.0, is_explored=True), Floor(level=1, height=0.1, is_explored=True))
    with pytest.raises(FloorError, match=r"floors 0 and 1 overlap: they lie at 0.00 m and 0.10 m"):
        FloorStack(floors=floors, levels={})


def test_an_unknown_level_is_told_the_known_ones():
    with pytest.raises(FloorError, match=r"no floor 7; floors are 0 at 0.00 m, 1 at 3.00 m"):
        find_floors([full_flight()]).floor(7)
