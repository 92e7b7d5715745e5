"""Heights of floors: which of two is meant, with a case on either side of each limit."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.navigation.floor_heights import (
    FloorError,
    StairEnds,
    estimate_camera_height,
    find_stood_floors,
    may_be_floor_of,
    told_heights,
    with_open_ends,
)
from walkable_stairways import make_flight, make_half_turn, make_stairway


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("beyond", "tolerance", "may_be"),
    [
        (0.99, 0.3, True), (1.0, 0.3, False), (-0.29, 0.3, True), (-0.3, 0.3, False),
        (1.1, 1.2, True), (1.2, 1.2, False),
    ],
)  # fmt: skip
def test_stairs_may_go_on_for_a_metre_to_a_floor_beyond_their_end_but_hardly_before_it(
    side, beyond, tolerance, may_be
):
    assert may_be_floor_of(side * beyond, side, tolerance) is may_be


def ends_of(*stairways):
    return StairEnds.of(stairways)


def test_ends_are_the_foot_and_the_top_of_a_stairway_and_each_is_open_by_itself():
    upper_open = make_stairway(make_flight(num_risers=10, top_seen=False))
    ends = ends_of(upper_open, make_half_turn(height=3.06))
    assert ends.heights == pytest.approx(np.array([[0.0, 1.7], [0.0, 3.06]]))
    assert ends.are_open[0].tolist() == [False, True]
    lower_open = make_stairway(make_flight(num_risers=10, bottom_seen=False))
    assert ends_of(lower_open).are_open.tolist() == [[True, False]]
    assert sorted(ends_of(upper_open).seen.tolist()) == [0.0]


def test_no_stairs_have_no_ends_and_tell_of_no_floor():
    ends = ends_of()
    assert ends.heights.shape == ends.are_open.shape == (0, 2)
    assert told_heights(ends) == []


@pytest.mark.parametrize(("num_risers", "tolerance"), [(2, 0.9 * 0.34), (3, 0.9 * 0.51), (4, 0.6), (18, 0.6)])
def test_the_tolerance_of_one_floor_keeps_the_ends_of_the_lowest_stairway_apart(num_risers, tolerance):
    tall = make_stairway(make_flight(num_risers=18))
    ends = ends_of(tall, make_stairway(make_flight(num_risers=num_risers)))
    assert ends.tolerance == pytest.approx(tolerance)


def test_floors_are_told_by_seen_ends_and_by_open_ones_only_where_there_are_no_others():
    half = make_stairway(make_flight(num_risers=10, top_seen=False))
    assert told_heights(ends_of(half)) == pytest.approx([0.0])
    unseen = make_stairway(make_flight(num_risers=10, bottom_seen=False, top_seen=False))
    assert told_heights(ends_of(unseen)) == pytest.approx([0.0, 1.7])


@pytest.mark.parametrize(
    ("floor", "num_floors"), [(1.7 - 0.59, 2), (1.7 - 0.61, 3), (1.7 + 0.99, 2), (1.7 + 1.01, 3)]
)
def test_an_open_end_is_a_floor_of_its_own_where_no_known_one_may_be_meant(floor, num_floors):
    ends = ends_of(make_stairway(make_flight(num_risers=10, top_seen=False)))
    heights = with_open_ends([0.0, floor], ends)
    assert len(heights) == num_floors
    assert heights == sorted(heights)


@pytest.mark.parametrize(("apart", "num_floors"), [(0.29, 1), (0.31, 2)])
def test_an_open_end_that_overlaps_a_known_floor_on_the_wrong_side_is_none(apart, num_floors):
    # A tolerance of one floor of less than 0.3 m: two low risers.
    ends = StairEnds(heights=np.array([[-1.0, 0.0]]), are_open=np.array([[False, True]]), tolerance=0.2)
    assert len(with_open_ends([-apart], ends)) == num_floors


@pytest.mark.parametrize(
    ("heights", "expected"),
    [([0.9, 1.0, 1.1], 1.0), ([0.14, 0.16], 0.16), ([2.19, 2.21], 2.19), ([3.0 + 1.0], 1.0)],
)
def test_the_camera_is_between_15_cm_and_2_2_m_above_the_next_floor_below(heights, expected):
    assert estimate_camera_height(np.array(heights), [0.0, 3.0]) == pytest.approx(expected)


def test_a_camera_that_was_above_no_floor_must_be_told_its_height():
    for poses, heights in (([2.3], [0.0]), ([-0.5], [0.0]), ([1.0], [])):
        with pytest.raises(FloorError):
            estimate_camera_height(np.array(poses), heights)


def stood(*heights, stairways=(), x=-5.0, num=12):
    """Floors of a robot whose feet were at these heights, away from all stairs."""
    feet = np.repeat(np.array(heights, dtype=float), num)
    places = np.column_stack([np.full(len(feet), x), np.zeros(len(feet)), feet])
    return find_stood_floors(places, stairways, ends_of(*stairways))


@pytest.mark.parametrize(("apart", "num_floors"), [(1.88, 1), (1.92, 2)])
def test_a_lift_leads_to_a_floor_that_is_a_storey_away(apart, num_floors):
    assert len(stood(0.0, apart)) == num_floors
    assert len(stood(0.0, -apart)) == num_floors


def test_a_floor_is_where_feet_were_and_not_where_stairs_end_near_them():
    stairway = make_stairway(make_flight(num_risers=18))
    assert stood(0.1, stairways=[stairway]) == pytest.approx([0.1, 3.06])


@pytest.mark.parametrize(("num", "height"), [(3, 3.2), (2, 3.06)])
def test_three_poses_on_a_floor_move_it_to_where_they_stood(num, height):
    stairway = make_stairway(make_flight(num_risers=18))
    feet = np.array([0.0] * 12 + [3.2] * num)
    places = np.column_stack([np.full(len(feet), -5.0), np.zeros(len(feet)), feet])
    assert find_stood_floors(places, [stairway], ends_of(stairway)) == pytest.approx([0.0, height])


@pytest.mark.parametrize(("y", "is_told"), [(0.85, False), (0.95, True)])
def test_feet_beside_the_steps_stand_on_a_floor_of_their_own(y, is_told):
    """Steps are 1.2 m wide, and 0.3 m beside them count too."""
    stairway = make_stairway(make_flight(num_risers=8, top_seen=False))
    feet = np.array([[-5.0, 0.0, 0.0]] * 12 + [[7 * 0.28, y, 1.2]] * 12)
    heights = find_stood_floors(feet, [stairway], ends_of(stairway))
    assert (pytest.approx(1.2) in heights) is is_told
