"""An end of stairs that nobody saw is never taken for the edge of a floor."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from stairmap.navigation.floors import find_floors
from stairmap.navigation.keepout import ForbiddenGround, make_keepout_mask
from stairmap.navigation.portals import Portal, make_portal
from stairmap.navigation.robot_profile import load_robot
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_stairway

CAMERA_HEIGHT = 0.6


def way(*heights, num=12):
    """Return a way that stays ``num`` poses at each height of a floor."""
    z = np.repeat(np.array(heights, dtype=float), num) + CAMERA_HEIGHT
    poses = np.tile(np.eye(4), (len(z), 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = np.arange(len(z)) * 0.1, z
    return Trajectory(stamps_ns=np.arange(len(z)), map_from_camera=poses)


def full_flight(base_z=0.0, stairway_id=1, num_risers=18, **ends):
    return make_stairway(
        make_flight(base=(0, 0, base_z), rise=3.0 / 18, num_risers=num_risers, **ends),
        stairway_id=stairway_id,
    )


def portal_of(stairway):
    return make_portal(stairway, find_floors([stairway]), load_robot("spot"))


@pytest.mark.parametrize("unseen", [False, None])
def test_a_floor_that_only_an_unseen_end_tells_of_is_open(unseen):
    stack = find_floors([full_flight(top_seen=unseen)], way(0.0))
    assert [floor.is_open for floor in stack.floors] == [False, True]
    assert stack.open_ends == {1: (False, True)}
    below = find_floors([full_flight(base_z=-3.0, bottom_seen=unseen)], way(0.0))
    assert [floor.is_open for floor in below.floors] == [True, False]
    assert below.open_ends == {1: (True, False)}
    assert not find_floors([full_flight()], way(0.0)).floor(1).is_open


def test_an_unseen_end_at_the_height_of_a_floor_that_the_robot_explored_is_closed():
    stack = find_floors([full_flight(top_seen=False)], way(0.0, 3.0))
    assert stack.open_ends == {1: (False, False)}
    assert stack.floor(1).is_explored and not stack.floor(1).is_open
    too_low = find_floors([full_flight(num_risers=16, top_seen=False)], way(0.0, 3.0))
    assert too_low.open_ends == {1: (False, True)}


def test_stairs_whose_last_risers_nobody_saw_lead_to_the_floor_above_them():
    # Another stairway's seen end, 3 m up, is the floor; 15 of 18 risers end at 2.5 m.
    other = full_flight(stairway_id=2)
    stack = find_floors([full_flight(num_risers=15, top_seen=False), other], way(0.0))
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 3.0]
    assert stack.levels == {1: (0, 1), 2: (0, 1)}
    assert stack.open_ends == {1: (False, True), 2: (False, False)}


def test_a_floor_is_never_put_at_an_unseen_end_beside_a_seen_one():
    # The unseen end lies within the tolerance of one floor and must not pull its height.
    lower = full_flight(num_risers=16, top_seen=False)
    stack = find_floors([lower, full_flight(stairway_id=2), full_flight(stairway_id=3)], way(0.0))
    assert stack.floors[1].height == pytest.approx(3.0)


def test_stairs_that_end_unseen_far_below_the_next_floor_have_an_open_floor_of_their_own():
    stack = find_floors([full_flight(num_risers=9, top_seen=False), full_flight(stairway_id=2)], way(0.0))
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 1.5, 3.0]
    assert [floor.is_open for floor in stack.floors] == [False, True, False]
    assert stack.levels == {1: (0, 1), 2: (0, 2)}


def test_stairs_that_begin_unseen_lead_to_the_floor_below_them():
    high = make_stairway(
        make_flight(base=(0, 0, 0.8), rise=3.0 / 18, num_risers=13, bottom_seen=False), stairway_id=1
    )
    stack = find_floors([high, full_flight(stairway_id=2)], way(0.0))
    assert stack.levels[1] == (0, 1)
    assert stack.open_ends[1] == (True, False)


def test_floors_of_stairs_whose_ends_nobody_saw_are_where_they_were_before():
    stack = find_floors([full_flight(bottom_seen=None, top_seen=None)], way(0.0))
    assert [round(floor.height, 2) for floor in stack.floors] == [0.0, 3.0]
    assert stack.levels == {1: (0, 1)}
    assert stack.open_ends == {1: (False, True)}


def test_a_portal_tells_which_of_its_ends_nobody_saw():
    seen = portal_of(make_stairway(make_flight(rise=0.17)))
    assert not seen.is_lower_open and not seen.is_upper_open and not seen.notes
    for name in ("lower", "upper"):
        end = "top_seen" if name == "upper" else "bottom_seen"
        portal = portal_of(make_stairway(make_flight(rise=0.17, **{end: False})))
        assert (portal.is_lower_open, portal.is_upper_open) == (name == "lower", name == "upper")
        (note,) = portal.notes
        assert f"stairway 1: nobody saw its {name} end" in note
        assert portal.to_dict()["open_ends"] == {"lower": name == "lower", "upper": name == "upper"}


def test_an_end_of_a_portal_of_which_nothing_is_said_is_open():
    seen = portal_of(make_stairway(make_flight(rise=0.17)))
    told = {field.name: getattr(seen, field.name) for field in fields(seen)}
    unsaid = {name: value for name, value in told.items() if name not in ("is_lower_open", "is_upper_open")}
    assert Portal(**unsaid).to_dict()["open_ends"] == {"lower": True, "upper": True}
    assert Portal(**told).to_dict()["open_ends"] == {"lower": False, "upper": False}


def test_ground_beyond_an_end_that_nobody_saw_is_forbidden_where_stairs_may_go_on():
    for end, level, sign in (("top_seen", 1, 1), ("bottom_seen", 0, -1)):
        flight = make_flight(base=(4, 2, 0), rise=0.17, num_risers=12, bottom_seen=True, top_seen=True)
        seen = make_stairway(flight)
        unseen = make_stairway(replace(flight, **{end: False}))
        edge = 4.0 + (11 * 0.28 if level else 0.0)
        for stairway, reach in ((seen, 0.30 if level else 0.05), (unseen, 1.50 if level else 1.25)):
            mask = make_keepout_mask(ForbiddenGround(stairways=(stairway,)), find_floors([stairway]), level)
            assert mask.value_at((edge + sign * (reach - 0.04), 2.0)) == 100
            assert mask.value_at((edge + sign * (reach + 0.06), 2.0)) == -1
