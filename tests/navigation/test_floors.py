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


def steps_to(height, base_z=0.0, stairway_id=1, x=0.0):
    """Return a flight that rises by exactly so much, far from the way unless ``x`` says otherwise."""
    num_risers = round(height / 0.17)
    flight = make_flight(base=(x, 50.0, base_z), rise=height / num_risers, num_risers=num_risers)
    return make_stairway(flight, stairway_id=stairway_id)


@pytest.mark.parametrize(("apart", "num_floors"), [(0.58, 3), (0.62, 4)])
def test_ends_are_one_floor_as_long_as_they_lie_within_0_6_m(apart, num_floors):
    stairways = [steps_to(3.0), steps_to(3.0, base_z=3.0 + apart, stairway_id=2)]
    assert len(find_floors(stairways).floors) == num_floors


@pytest.mark.parametrize(("apart", "num_floors"), [(0.42, 3), (0.48, 4)])
def test_a_stairway_of_half_a_metre_keeps_its_ends_apart_so_less_drift_is_borne(apart, num_floors):
    """Nine tenths of its height: 0.45 m."""
    stairways = [steps_to(0.5), steps_to(3.0, base_z=0.5 + apart, stairway_id=2)]
    assert len(find_floors(stairways).floors) == num_floors


def test_the_height_of_a_floor_is_the_median_of_the_ends_on_it():
    stairways = [steps_to(3.0), steps_to(3.1, stairway_id=2), steps_to(3.3, stairway_id=3)]
    assert find_floors(stairways).floors[1].height == pytest.approx(3.1)


@pytest.mark.parametrize(("distance", "is_refused"), [(0.29, True), (0.31, False)])
def test_floors_overlap_up_to_0_3_m(distance, is_refused):
    floors = tuple(Floor(level=level, height=level * distance, is_explored=True) for level in (0, 1))
    if is_refused:
        with pytest.raises(FloorError, match="overlap"):
            FloorStack(floors=floors, levels={})
    else:
        assert FloorStack(floors=floors, levels={}).floor(1).height == distance


@pytest.mark.parametrize(("height", "num_floors"), [(1.85, 2), (1.95, 3)])
def test_a_floor_that_only_the_way_tells_of_lies_a_storey_of_1_9_m_from_all_others(height, num_floors):
    stack = find_floors([steps_to(5.0)], way(0.0, height), camera_height=CAMERA_HEIGHT)
    assert len(stack.floors) == num_floors


@pytest.mark.parametrize("others", [[], [9.0]])
@pytest.mark.parametrize(("num_poses", "num_floors"), [(9, 2), (10, 3)])
def test_a_lift_is_known_by_ten_poses_at_one_height(num_poses, num_floors, others):
    """The heights scatter by 0.14 m, another by far; the floor lies at their median."""
    poses = np.concatenate([np.zeros(12), np.linspace(8.0, 8.14, num_poses), others])
    stack = find_floors([steps_to(3.0)], way(*poses, num=1), camera_height=CAMERA_HEIGHT)
    assert len(stack.floors) == num_floors
    if num_floors == 3:
        assert stack.floors[2].height == pytest.approx(8.07)


def test_heights_that_scatter_too_much_are_no_floor():
    poses = np.concatenate([np.zeros(12), np.linspace(8.0, 10.0, 14)])
    assert len(find_floors([steps_to(3.0)], way(*poses, num=1), camera_height=CAMERA_HEIGHT).floors) == 2


def test_two_lifts_lead_to_two_floors():
    stack = find_floors([steps_to(3.0)], way(0.0, 6.0, -4.0), camera_height=CAMERA_HEIGHT)
    assert [round(floor.height, 2) for floor in stack.floors] == [-4.0, 0.0, 3.0, 6.0]
    assert [floor.level for floor in stack.floors] == [-1, 0, 1, 2]


@pytest.mark.parametrize(("num_poses", "is_explored"), [(2, False), (3, True)])
def test_a_floor_is_explored_from_three_poses_on_it(num_poses, is_explored):
    poses = np.concatenate([np.zeros(12), np.full(num_poses, 3.0)])
    stack = find_floors([steps_to(3.0)], way(*poses, num=1), camera_height=CAMERA_HEIGHT)
    assert stack.floors[1].is_explored is is_explored


@pytest.mark.parametrize(
    ("above", "is_explored"), [(0.28, True), (0.32, False), (-0.28, True), (-0.32, False)]
)
def test_a_pose_is_on_a_floor_within_0_3_m_of_its_height(above, is_explored):
    stack = find_floors([steps_to(3.0)], way(0.0, 3.0 + above), camera_height=CAMERA_HEIGHT)
    assert stack.floors[1].is_explored is is_explored


def test_a_way_of_one_pose_explores_its_floor():
    stack = find_floors([steps_to(3.0)], way(0.0, num=1), camera_height=CAMERA_HEIGHT)
    assert [floor.is_explored for floor in stack.floors] == [True, False]


def test_level_0_is_the_floor_that_the_way_begins_on():
    stack = find_floors([steps_to(3.0)], way(3.0, 0.0), camera_height=CAMERA_HEIGHT)
    assert [floor.level for floor in stack.floors] == [-1, 0]
    assert stack.levels == {1: (-1, 0)}


def test_the_height_of_the_camera_is_its_median_above_the_next_floor_below():
    """Poses on both floors; one that is right at a floor's height belongs to the floor below."""
    stack = find_floors([steps_to(3.0)], way(0.0, 0.1, 0.1, 3.1, 3.2, num=4))
    assert stack.camera_height == pytest.approx(CAMERA_HEIGHT + 0.1)


@pytest.mark.parametrize(
    ("camera_height", "is_told"), [(0.14, False), (0.16, True), (2.15, True), (2.25, False)]
)
def test_a_camera_is_from_0_15_to_2_2_m_above_its_floor(camera_height, is_told):
    trajectory = way(camera_height - CAMERA_HEIGHT)
    if is_told:
        assert find_floors([steps_to(3.0)], trajectory).camera_height == pytest.approx(camera_height)
    else:
        with pytest.raises(FloorError, match="the camera was never above a floor"):
            find_floors([steps_to(3.0)], trajectory)


def test_without_a_way_the_cameras_height_is_what_was_said_or_not_known():
    assert find_floors([steps_to(3.0)], camera_height=0.7).camera_height == 0.7
    assert np.isnan(find_floors([steps_to(3.0)]).camera_height)


def rest_at(place):
    """Return a way of twelve poses on the floor and twelve at a place."""
    poses = np.tile(np.eye(4), (24, 1, 1))
    poses[:, 2, 3] = CAMERA_HEIGHT
    poses[12:, :3, 3] += np.asarray(place, dtype=float)
    return Trajectory(stamps_ns=np.arange(24), map_from_camera=poses)


@pytest.mark.parametrize(
    ("offset", "is_on_stairs"),
    [
        ((1.4, 0.0, 0.0), True), ((1.6, 0.0, 0.0), False), ((0.0, 1.4, 0.0), True), ((0.0, -1.6, 0.0), False),
        ((1.1, 1.1, 0.0), False),
    ],
)  # fmt: skip
def test_who_rests_within_1_5_m_of_the_stairs_is_on_no_floor(offset, is_on_stairs):
    """Beside the top of the lower flight, 2.1 m up: a storey away from both floors."""
    # Upright and narrow: its way is a vertical line, so the offset is the distance.
    upright = make_stairway(
        make_flight(base=(0.0, 0.0, 0.0), rise=0.21, run=1e-3, num_risers=10),
        make_flight(base=(0.0, 0.0, 2.1), rise=0.21, run=1e-3, num_risers=10),
    )
    place = np.array([0.0, 0.0, 2.1]) + offset
    stack = find_floors([upright], rest_at(place), camera_height=CAMERA_HEIGHT)
    assert len(stack.floors) == (2 if is_on_stairs else 3)


@pytest.mark.parametrize(
    ("above", "is_on_landing"), [(0.0, True), (0.25, True), (-0.25, True), (0.35, False), (-0.35, False)]
)
def test_who_rests_anywhere_on_a_landing_within_0_3_m_of_its_height_is_on_no_floor(above, is_on_landing):
    """Its middle is 4 m from either flight."""
    stairway = make_stairway(
        make_flight(base=(0.0, 0.0, 0.0), rise=0.24, run=1e-3, num_risers=10),
        make_flight(base=(8.0, 0.0, 2.4), rise=0.24, run=1e-3, num_risers=10),
    )
    stack = find_floors([stairway], rest_at((4.0, 0.0, 2.4 + above)), camera_height=CAMERA_HEIGHT)
    assert len(stack.floors) == (2 if is_on_landing else 3)


def test_stairs_that_nobody_rests_on_hide_no_floor():
    """Two stairways in either order; the way is on one of them."""
    far = make_flight(base=(30.0, 0.0, 0.0), rise=0.21, run=1e-3, num_risers=20)
    near = make_flight(base=(0.0, 0.0, 0.0), rise=0.21, run=1e-3, num_risers=20)
    for order in ((near, far), (far, near)):
        stairways = [make_stairway(flight, stairway_id=index) for index, flight in enumerate(order)]
        assert len(find_floors(stairways, rest_at((0, 0, 2.1)), camera_height=CAMERA_HEIGHT).floors) == 2


@pytest.mark.parametrize("x", [-4.0, 12.0])
def test_a_landing_ends_at_its_flights(x):
    """Who rests at its height beyond either of them is on a floor."""
    stairway = make_stairway(
        make_flight(base=(0.0, 0.0, 0.0), rise=0.24, run=1e-3, num_risers=10),
        make_flight(base=(8.0, 0.0, 2.4), rise=0.24, run=1e-3, num_risers=10),
    )
    stack = find_floors([stairway], rest_at((x, 0.0, 2.4)), camera_height=CAMERA_HEIGHT)
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 2.4, 4.8]


def test_an_end_of_which_nothing_is_known_is_open() -> None:
    floors = FloorStack(floors=(), levels={})
    assert floors.has_open_end(7, upper=True)
    assert floors.has_open_end(7, upper=False)
