"""The hole that stairs cut into the floor above: its ends, its eye, its sides, and who may go there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.drop import Drop
from stairmap.modeling.drop_stairways import assign_drops
from stairmap.navigation.edge_pieces import pieces_beside
from stairmap.navigation.floors import find_floors
from stairmap.navigation.footprints import EDGE_MARGIN, UNSEEN_SIDE
from stairmap.navigation.keepout import ForbiddenGround, block_stairs, forbidden_ground, make_keepout_mask
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import make_portal
from stairmap.navigation.robot_profile import load_robot
from stairmap.stairway import Landing
from walkable_stairways import make_flight, make_half_turn, make_stairway

LENGTH = 8 * 0.28
"""From the first to the last nosing of each flight of the half turn, m."""


def mask_of(stairway, level, *, robot=None):
    ground = forbidden_ground([stairway], [], None if robot is None else load_robot(robot))
    return make_keepout_mask(ground, find_floors([stairway]), level)


def half_turn_about_an_eye(eye):
    """Two flights of 1.2 m of width, so far apart, m; the landing joins both."""
    rise = 3.06 / 18
    flights = (
        make_flight(rise=rise, num_risers=9),
        make_flight(base=(LENGTH, 1.2 + eye, 9 * rise), heading=np.pi, rise=rise, num_risers=9),
    )
    landing = Landing(center=[LENGTH + 0.6, 0.6 + eye / 2, 9 * rise], size=(1.2, 2.4 + eye), heading=0.0)
    return make_stairway(*flights, landings=(landing,))


def test_the_end_of_the_well_above_the_foot_of_the_stairs_is_an_edge_too():
    """It was free right up to it: beside the upper flight's end, above the first riser of the lower one."""
    mask = mask_of(make_half_turn(), 1)
    for x in (-0.27, -0.1):
        for y in (-0.5, 0.0, 0.5):
            assert mask.value_at((x, y)) == 100
    assert mask.value_at((-0.4, 0.0)) == -1
    assert mask_of(make_half_turn(), 0).value_at((-0.1, 0.0)) == -1


@pytest.mark.parametrize("eye", [0.8, 1.9])
def test_the_open_eye_between_two_flights_is_forbidden_with_the_strip_before_it(eye):
    """Only 0.3 m beside each flight were."""
    stairway = half_turn_about_an_eye(eye)
    mask, middle = mask_of(stairway, 1), 0.6 + eye / 2
    for x in np.arange(-0.27, LENGTH + 0.2, 0.1):
        assert mask.value_at((x, middle)) == 100
    assert mask.value_at((-0.4, middle)) == -1
    # On the floor below one may stand in it.
    assert mask_of(stairway, 0).value_at((1.0, middle)) == -1
    grid = OccupancyGrid(cells=np.zeros((80, 80), dtype=np.int8), resolution=0.1, origin=(-2.0, -2.0))
    for level, value in ((0, 0), (1, 100)):
        blocked = block_stairs(grid, [stairway], find_floors([stairway]), level)
        assert blocked.value_at((1.0, middle)) == value


def test_flights_far_from_each_other_have_a_floor_between_them():
    assert mask_of(half_turn_about_an_eye(2.2), 1).value_at((1.0, 1.7)) == -1


def test_flights_that_turn_by_a_right_angle_have_no_eye():
    rise = 0.17
    second = make_flight(base=(LENGTH + 0.6, 0.6, 9 * rise), heading=np.pi / 2, num_risers=9)
    stairway = make_stairway(make_flight(num_risers=9), second)
    assert mask_of(stairway, 1).value_at((1.0, 1.2)) == -1


@pytest.mark.parametrize("side", [1, -1])
def test_a_well_goes_on_beside_steps_of_which_an_end_was_not_seen(side):
    """A camera that looked past one side of the stairs; the floor beside what it saw was free."""
    seen = make_flight(num_risers=18)
    unseen = replace(seen, **{"left_bounded" if side > 0 else "right_bounded": False})
    mask = mask_of(make_stairway(unseen), 1)
    beside = 0.6 + UNSEEN_SIDE + EDGE_MARGIN
    assert mask.value_at((2.0, side * (beside - 0.04))) == 100
    assert mask.value_at((2.0, side * (beside + 0.06))) == -1
    assert mask.value_at((2.0, -side * (0.6 + EDGE_MARGIN + 0.06))) == -1
    # Wheels stand safely beside stairs that lead up.
    assert mask_of(make_stairway(unseen), 0).value_at((1.0, side * 0.7)) == -1


def test_a_robot_that_climbs_has_the_stairs_open_and_not_the_sides_of_their_well():
    """Its mask was empty: a way from the side of the well led over its edge, 3 m deep."""
    stairway = half_turn_about_an_eye(0.8)
    ground = forbidden_ground([stairway], [], load_robot("spot"))
    assert ground == ForbiddenGround(climbed=(stairway,))
    mask = mask_of(stairway, 1, robot="spot")
    for place in ((1.0, -0.75), (1.0, 1.0), (1.0, 2.75), (LENGTH + 1.35, 1.0), (LENGTH + 0.6, -0.8)):
        assert mask.value_at(place) == 100, place
    portal = make_portal(stairway, find_floors([stairway]))
    for start, end in zip(portal.way[:-1], portal.way[1:], strict=True):
        for share in np.linspace(0.0, 1.0, 40):
            place = start + share * (end - start)
            for aside in ((0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25)):
                assert mask.value_at(place[:2] + aside) == -1, place
    assert mask_of(stairway, 0, robot="spot") is None


def test_who_climbs_steps_of_which_an_end_was_not_seen_is_not_fenced_off_there():
    stairway = make_stairway(make_flight(num_risers=18, left_bounded=False))
    mask = mask_of(stairway, 1, robot="spot")
    assert mask.value_at((2.0, 0.75)) == mask.value_at((2.0, 1.1)) == -1
    assert mask.value_at((2.0, -0.75)) == 100


def test_the_edge_of_a_platform_goes_on_beside_the_stairs_that_a_robot_climbs():
    """Stairs of 1.2 m lead down from a dock of 6 m: with their edge, all of the dock's was open."""
    stairway = make_stairway(make_flight(num_risers=6))
    x, z = 5 * 0.28, 6 * 0.17
    drop = Drop(
        id=1, edge=np.array([[x, -3.0, z], [x, 3.0, z]]), depth=1.0, num_observations=5, first_seen_ns=0,
        last_seen_ns=1, stairway_id=1,
    )  # fmt: skip
    (own,) = assign_drops([replace(drop, edge=np.array([[x, -0.6, z], [x, 0.6, z]]))], [stairway])
    spot = load_robot("spot")
    assert forbidden_ground([stairway], [own], spot).drops == ()
    left = forbidden_ground([stairway], [drop], spot).drops
    assert np.array([part.edge[:, 1] for part in left]) == pytest.approx(np.array([[-3.0, -0.9], [0.9, 3.0]]))
    assert all(part.outward @ drop.outward == pytest.approx(1.0) for part in left)
    mask = make_keepout_mask(forbidden_ground([stairway], [drop], spot), find_floors([stairway]), 1)
    for aside in (-2.0, -0.8, 0.8, 2.0):
        assert mask.value_at((x + 0.2, aside)) == 100
    for aside in (-0.5, 0.0, 0.5):
        assert mask.value_at((x + 0.2, aside)) == -1
    assert forbidden_ground([stairway], [drop], None).drops == (drop,)


def sides_of(edge, flight):
    return np.array([piece[:, 1] for piece in pieces_beside(edge, flight)])


def test_an_edge_beside_steps_of_which_an_end_was_not_seen_begins_farther_off():
    edge = np.array([[0.0, -3.0, 0.0], [0.0, 3.0, 0.0]])
    seen, unseen = make_flight(), make_flight(left_bounded=False)
    assert sides_of(edge, seen) == pytest.approx(np.array([[-3.0, -0.9], [0.9, 3.0]]))
    assert sides_of(edge, unseen) == pytest.approx(np.array([[-3.0, -0.9], [1.5, 3.0]]))
    assert pieces_beside(edge * [1, 1 / 3, 1], seen) == ()
    along = np.array([[0.0, 2.0, 0.0], [1.0, 2.0, 0.0]])
    assert np.array_equal(pieces_beside(along, seen)[0], along)
