"""Floors from the robot's own way: where it stood, and by which number a floor is known."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.export.building import load_building
from stairmap.export.results import create_run_folder
from stairmap.navigation.floors import find_floors
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_stairway

CAMERA_HEIGHT = 0.3


def way_over(*places, bounce=0.0):
    """Return a way of 12 poses at each (x, z) of a floor; the camera goes up and down by ``bounce`` m."""
    steps = [(x + 0.02 * number, z) for x, z in places for number in range(12)]
    poses = np.tile(np.eye(4), (len(steps), 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = np.array(steps).T
    poses[:, 2, 3] += CAMERA_HEIGHT + bounce * np.cos(np.arange(len(steps)))
    return Trajectory(stamps_ns=np.arange(len(steps)), map_from_camera=poses)


def stairs_down(missed, *, num_risers=10):
    """Stairs down from z = 0 at x = 0 along +x, of which nobody saw the first risers nor the foot."""
    seen = num_risers - missed
    run, rise = 0.28, 0.17
    base = ((num_risers - 1) * run, 0.0, -num_risers * rise)
    flight = make_flight(
        base=base, heading=np.pi, rise=rise, run=run, num_risers=seen, bottom_seen=False, top_seen=False
    )
    return make_stairway(flight)


@pytest.mark.parametrize("missed", [1, 2])
def test_a_floor_that_the_robot_stood_on_lies_where_it_stood_and_not_at_an_end_that_nobody_saw(missed):
    """It was 0.17 m and 0.34 m too low, and the start of the way was no free ground any more."""
    stack = find_floors(
        [stairs_down(missed)], way_over((-2.0, 0.0), bounce=0.01), camera_height=CAMERA_HEIGHT
    )
    assert stack.floor(0).height == pytest.approx(0.0, abs=0.005)
    assert stack.floor(0).is_explored
    assert stack.levels == {1: (-1, 0)}


def test_a_seen_end_that_lies_off_gives_way_to_where_the_robot_stood():
    stairway = make_stairway(make_flight(base=(0, 0, -1.75), rise=0.17, num_risers=10))
    stack = find_floors([stairway], way_over((4.0, 0.0)), camera_height=CAMERA_HEIGHT)
    assert stack.floor(0).height == pytest.approx(0.0, abs=1e-9)
    assert stack.floor(-1).height == pytest.approx(-1.75)


def test_a_floor_above_stairs_whose_top_nobody_saw_lies_where_the_robot_came_to_stand():
    """Seven of ten risers were seen; 1.70 m up the robot stayed, too low for a storey of its own."""
    stairway = make_stairway(make_flight(num_risers=7, top_seen=False))
    stack = find_floors([stairway], way_over((-2.0, 0.0), (5.0, 10 * 0.17)), camera_height=CAMERA_HEIGHT)
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 1.7]
    assert stack.levels == {1: (0, 1)}
    assert stack.floor(1).is_explored and not stack.floor(1).is_open


def test_an_upper_floor_lies_where_the_robot_stood_and_not_where_stairs_were_seen_to_end():
    stairway = make_stairway(make_flight(num_risers=12))
    stack = find_floors([stairway], way_over((-2.0, 0.0), (6.0, 2.12)), camera_height=CAMERA_HEIGHT)
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 2.12]


def test_poses_on_the_steps_are_on_no_floor():
    stairway = make_stairway(make_flight(num_risers=12))
    climb = [(0.28 * step, 0.17 * (step + 1)) for step in range(11)]
    stack = find_floors([stairway], way_over((-2.0, 0.0), *climb, (5.0, 2.04)), camera_height=CAMERA_HEIGHT)
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 2.04]


def test_one_pose_and_no_stairway_are_a_floor():
    poses = np.eye(4)[None].copy()
    poses[0, 2, 3] = 1.0
    stack = find_floors([], Trajectory(stamps_ns=[0], map_from_camera=poses), camera_height=CAMERA_HEIGHT)
    assert [(floor.level, floor.height, floor.is_explored) for floor in stack.floors] == [(0, 0.7, True)]


def test_a_floor_keeps_its_id_when_one_is_found_below_it_and_one_between():
    low = make_stairway(make_flight(base=(0, 50, 0.0), num_risers=18), stairway_id=1)
    first = find_floors([low], way_over((-2.0, 0.0)), camera_height=CAMERA_HEIGHT)
    assert [(floor.level, floor.id) for floor in first.floors] == [(0, 0), (1, 1)]
    cellar = make_stairway(make_flight(base=(0, 60, -3.06), num_risers=18), stairway_id=2)
    half = make_stairway(make_flight(base=(0, 70, 0.0), num_risers=9), stairway_id=3)
    second = find_floors(
        [low, cellar, half], way_over((-2.0, 0.03)), camera_height=CAMERA_HEIGHT, known=first
    )
    assert [(floor.level, floor.id) for floor in second.floors] == [(-1, 2), (0, 0), (1, 3), (2, 1)]
    third = find_floors([low, cellar, half], way_over((-2.0, 0.0)), camera_height=CAMERA_HEIGHT, known=second)
    assert [floor.id for floor in third.floors] == [2, 0, 3, 1]


def test_a_run_folder_tells_the_cameras_height_and_an_option_overrules_it(tmp_path):
    folder = create_run_folder(tmp_path / "run", "x")
    folder.write_stairways([stairs_down(1)], num_frames=12, camera_height=CAMERA_HEIGHT)
    folder.write_trajectory(way_over((-2.0, 0.0)))
    assert load_building(folder.path).floors.floor(0).height == pytest.approx(0.0, abs=1e-6)
    higher = load_building(folder.path, camera_height=CAMERA_HEIGHT - 0.1)
    assert higher.floors.floor(0).height == pytest.approx(0.1, abs=1e-6)
