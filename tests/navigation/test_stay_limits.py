"""Which heights are floors: where a robot stayed, and what stairs say of them, with a case on either side."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.navigation.floor_heights import may_be_floor_of
from stairmap.navigation.floors import FloorStack, find_floors
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_half_turn, make_stairway

CAMERA_HEIGHT = 0.6
AWAY = (-9.0, 4.0)


def way(*stays: tuple[float, float, float, int]) -> Trajectory:
    """A way of so many poses at each place of the feet, m."""
    places = np.concatenate([np.tile([x, y, z], (num, 1)) for x, y, z, num in stays])
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, 3] = places + np.array([0.0, 0.0, CAMERA_HEIGHT])
    return Trajectory(stamps_ns=np.arange(len(places)), map_from_camera=poses)


def stack_of(stairways: list[Stairway], *stays: tuple[float, float, float, int]) -> FloorStack:
    return find_floors(stairways, way((*AWAY, 0.0, 12), *stays), camera_height=CAMERA_HEIGHT)


def heights(stack: FloorStack) -> list[float]:
    return [round(floor.height, 2) for floor in stack.floors]


@pytest.mark.parametrize(("num", "expected"), [(9, [0.0]), (10, [0.0, 4.0])])
def test_ten_poses_at_a_height_make_a_floor(num: int, expected: list[float]) -> None:
    assert heights(stack_of([], (*AWAY, 4.0, num))) == expected


@pytest.mark.parametrize(("apart", "expected"), [(0.14, [0.0, 4.0]), (0.32, [0.0])])
def test_poses_of_a_stay_lie_within_15_cm(apart: float, expected: list[float]) -> None:
    low, high = 4.0 - apart / 2, 4.0 + apart / 2
    found = heights(stack_of([], (*AWAY, low, 5), (*AWAY, high, 6)))
    assert len(found) == len(expected)


def test_a_stay_is_at_the_height_of_most_of_its_poses() -> None:
    assert heights(stack_of([], (*AWAY, 4.0, 9), (*AWAY, 4.1, 3), (*AWAY, 7.0, 11))) == [0.0, 4.0, 7.0]


@pytest.mark.parametrize(
    ("aside", "is_floor"),
    [(0.0, False), (0.85, False), (1.45, False), (1.55, True), (-1.45, False), (-1.55, True)],
)
def test_who_stays_within_1_5_m_of_stairs_halfway_up_is_on_no_floor(aside: float, is_floor: bool) -> None:
    # On the twelfth of 24 steps, a storey of 1.9 m from both ends, or beside it.
    stairway = make_stairway(make_flight(num_risers=24, rise=0.17))
    found = heights(stack_of([stairway], (11 * 0.28, aside, 12 * 0.17, 12)))
    assert found == ([0.0, 2.04, 4.08] if is_floor else [0.0, 4.08])


def test_the_end_of_each_flight_counts_for_its_own_side() -> None:
    # Two flights: the lower one's foot and the upper one's top are the ends.
    stairway = make_half_turn(height=3.06)
    assert heights(stack_of([stairway])) == [0.0, 3.06]
    lower, upper = stairway.flights
    open_top = make_stairway(
        lower, make_flight(base=tuple(upper.base), heading=np.pi, rise=0.17, num_risers=9, top_seen=False),
        landings=stairway.landings,
    )  # fmt: skip
    stack = stack_of([open_top])
    assert [floor.is_open for floor in stack.floors] == [False, True]
    open_foot = make_stairway(
        make_flight(rise=0.17, num_risers=9, bottom_seen=False), upper, landings=stairway.landings
    )
    stack = find_floors([open_foot], way((*AWAY, 3.06, 12)), camera_height=CAMERA_HEIGHT)
    assert [floor.is_open for floor in stack.floors] == [True, False]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("beyond", "tolerance", "may_be"),
    [(0.0, 0.3, True), (-0.29, 0.3, True), (-0.31, 0.3, False), (0.5, 0.6, True), (0.59, 0.6, True)],
)
def test_stairs_lead_on_from_an_end_that_nobody_saw_not_back(
    side: int, beyond: float, tolerance: float, may_be: bool
) -> None:
    assert may_be_floor_of(side * beyond, side, tolerance) == may_be


@pytest.mark.parametrize(("off", "is_explored"), [(0.28, True), (-0.28, True), (0.32, False)])
def test_a_floor_at_the_end_of_stairs_is_where_the_robot_stood(off: float, is_explored: bool) -> None:
    stairway = make_stairway(make_flight(num_risers=18, rise=0.17))
    stack = stack_of([stairway], (*AWAY, 3.06 + off, 5))
    assert stack.floors[1].is_explored == is_explored
    assert stack.floors[1].height == pytest.approx(3.06 + off if is_explored else 3.06)
