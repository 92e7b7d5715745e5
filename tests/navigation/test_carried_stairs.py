"""Stairs whose ends nobody saw: carried on to their floors, and farther from edges by what is not known."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.drop import Drop
from stairmap.modeling.landings import top_of
from stairmap.navigation.carried_stairs import carry_to_floors
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.footprints import drop_rectangles
from stairmap.navigation.keepout import ForbiddenGround, forbidden_ground, make_keepout_mask
from stairmap.navigation.portals import make_portal
from stairmap.navigation.robot_profile import load_robot
from walkable_stairways import make_flight, make_stairway

RISE, RUN, COUNT = 0.17, 0.28, 12
TOP = (COUNT - 1) * RUN


def floors_at(*heights, open_levels=()):
    """Floors at heights, of which stairway 1 joins the first and the last."""
    floors = tuple(
        Floor(level=level, height=height, is_explored=True, is_open=level in open_levels)
        for level, height in enumerate(heights)
    )
    return FloorStack(floors=floors, levels={1: (0, len(heights) - 1)}, open_ends={1: (False, False)})


def seen_in_part(below=0, above=0):
    """A flight of 12 risers of which nobody saw the first and last ones."""
    flight = make_flight(
        base=(below * RUN, 0.0, below * RISE), rise=RISE, run=RUN, num_risers=COUNT - below - above,
        bottom_seen=not below, top_seen=not above,
    )  # fmt: skip
    return make_stairway(flight)


def drop_at(x, *, z=COUNT * RISE, drop_id=1, stairway_id=None, half=0.5, turn=0.0):
    """A drop that falls towards -x."""
    side = half * np.array([np.sin(turn), -np.cos(turn), 0.0])
    edge = np.array([x, 0.0, z]) + np.array([side, -side])
    return Drop(
        id=drop_id, edge=edge, depth=0.5, num_observations=5, first_seen_ns=0, last_seen_ns=1,
        stairway_id=stairway_id,
    )  # fmt: skip


@pytest.mark.parametrize(("below", "above"), [(0, 1), (0, 3), (2, 0), (1, 2)])
def test_missing_risers_are_added_up_to_the_floors(below, above):
    carried = carry_to_floors(seen_in_part(below, above), floors_at(0.0, COUNT * RISE))
    (flight,) = carried.stairway.flights
    assert flight.num_risers == COUNT
    assert flight.base == pytest.approx([0, 0, 0], abs=1e-9)
    assert top_of(flight) == pytest.approx([TOP, 0, COUNT * RISE])
    assert carried.unknown_below == pytest.approx(RUN if below else 0.0)
    assert carried.unknown_above == pytest.approx(RUN if above else 0.0)


def test_an_end_that_was_seen_stays_where_it_is():
    carried = carry_to_floors(seen_in_part(), floors_at(0.03, COUNT * RISE + 0.2))
    assert carried.stairway.to_dict() == seen_in_part().to_dict()
    assert (carried.unknown_below, carried.unknown_above) == (0.0, 0.0)


def test_towards_a_floor_that_nobody_knows_nothing_is_added_but_room():
    carried = carry_to_floors(seen_in_part(above=2), floors_at(0.0, 10 * RISE, open_levels=(1,)))
    assert carried.stairway.flights[0].num_risers == 10
    assert carried.unknown_above == 1.2


def test_a_staging_pose_of_stairs_whose_top_nobody_saw_keeps_off_the_true_edge():
    """It stood 0.32 m from it: 0.6 m behind the last nosing seen, a riser too low."""
    stack = floors_at(0.0, COUNT * RISE)
    for above in (1, 2):
        portal = make_portal(seen_in_part(above=above), stack)
        assert portal.upper.position[0] - TOP >= 0.6 - 1e-9
        assert portal.upper.position[2] == pytest.approx(COUNT * RISE)
        assert portal.height == pytest.approx(COUNT * RISE)


def test_an_edge_of_the_floor_that_was_seen_tells_where_the_stairs_end():
    """The floor's height alone says two risers; the edge that was seen, three."""
    stack = floors_at(0.0, COUNT * RISE)
    carried = carry_to_floors(seen_in_part(above=2), stack, [drop_at(TOP + RUN, stairway_id=1)])
    assert carried.stairway.flights[0].num_risers == COUNT + 1
    for other in (drop_at(TOP + RUN, stairway_id=2), drop_at(TOP + RUN, z=1.0, stairway_id=1)):
        assert carry_to_floors(seen_in_part(above=2), stack, [other]).stairway.flights[0].num_risers == COUNT


@pytest.mark.parametrize("above", [0, 1, 2])
def test_no_mask_is_free_within_0_3_m_before_the_edge_of_stairs(above):
    stack = floors_at(0.0, COUNT * RISE)
    mask = make_keepout_mask(ForbiddenGround(stairways=(seen_in_part(above=above),)), stack, 1)
    for ahead in np.arange(0.0, 0.29, 0.05):
        for aside in (-0.5, 0.0, 0.5):
            assert mask.value_at((TOP + ahead, aside)) == 100
    # Along its sides too, down to the foot.
    for along in np.arange(0.2, TOP, 0.25):
        assert mask.value_at((along, 0.6 + 0.25)) == mask.value_at((along, -0.6 - 0.25)) == 100
        assert mask.value_at((along, 0.6 + 0.40)) in (-1, None)


def test_a_floor_that_the_well_cuts_in_passing_is_forbidden_about_the_whole_well():
    stack = floors_at(0.0, 6 * RISE, COUNT * RISE)
    mask = make_keepout_mask(ForbiddenGround(stairways=(seen_in_part(),)), stack, 1)
    for place in ((-0.25, 0.0), (1.0, 0.0), (TOP + 0.25, 0.0), (1.0, 0.85), (1.0, -0.85)):
        assert mask.value_at(place) == 100
    assert mask.value_at((-0.4, 0.0)) == mask.value_at((TOP + 0.4, 0.0)) == -1


def test_ground_from_0_3_m_before_a_drop_is_forbidden_on_its_floor_alone():
    stack = floors_at(0.0, COUNT * RISE)
    drop = drop_at(9.0, turn=0.5)
    mask = make_keepout_mask(ForbiddenGround(drops=(drop,)), stack, 1)
    for beside in (-0.45, 0.0, 0.45):
        along = drop.edge[1] - drop.edge[0]
        place = drop.center + beside * along
        for before, value in ((0.0, 100), (0.3, 100), (0.42, -1)):
            assert mask.value_at(place - before * drop.outward) == value
    # An edge was seen to its ends, but may go on.
    assert mask.value_at(drop.edge[0] + 0.25 * (drop.edge[0] - drop.edge[1]) / drop.length) == 100
    assert drop_rectangles([drop], stack, 0) == ()
    assert make_keepout_mask(ForbiddenGround(drops=(drop,)), stack, 0) is None


def test_an_edge_that_a_ramp_leads_to_is_forbidden_on_the_floor_that_is_nearest():
    """A robot went up a ramp to a dock 0.9 m up: no floor of its own, and its edge was in no mask."""
    dock, stack = drop_at(9.0, z=0.9), floors_at(0.0, COUNT * RISE)
    mask = make_keepout_mask(ForbiddenGround(drops=(dock,)), stack, 0)
    assert mask.value_at((9.0 + 0.3, 0.0)) == 100
    assert drop_rectangles([dock], stack, 1) == ()


def test_the_edge_of_stairs_that_a_robot_climbs_is_open_to_it_and_no_other_edge_is():
    stairway = seen_in_part()
    own, dock = drop_at(TOP, stairway_id=1), drop_at(9.0, drop_id=2)
    for robot in (None, load_robot("wheeled")):
        ground = forbidden_ground([stairway], [own, dock], robot)
        assert (ground.stairways, ground.drops, ground.climbed) == ((stairway,), (own, dock), ())
    ground = forbidden_ground([stairway], [own, dock], load_robot("spot"))
    assert (ground.stairways, ground.drops, ground.climbed) == ((), (dock,), (stairway,))
