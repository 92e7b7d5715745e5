"""Portals: staging poses that face the stairs, finite costs, obstacles told and kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stairmap.drop import Drop
from stairmap.navigation.floors import Floor, FloorStack, find_floors
from stairmap.navigation.landing_corners import find_landing_corners
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.navigation.portals import make_portal, make_portals, note_obstacles
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.standoff import STANDOFF
from stairmap.stairway import Landing
from walkable_stairways import make_flight, make_half_turn, make_stairway

STAIRWAY = make_stairway(make_flight(base=(1, 2, 0), heading=math.pi / 2, rise=0.17, num_risers=10))


def portal_of(stairway=STAIRWAY, robot="spot"):
    return make_portal(stairway, find_floors([stairway]), load_robot(robot))


def test_staging_poses_face_the_stairs_from_the_floor_and_from_the_landing():
    portal = portal_of()
    assert portal.lower.position == pytest.approx([1, 2 - STANDOFF, 0])
    assert portal.lower.heading == pytest.approx(math.pi / 2)
    assert portal.upper.position == pytest.approx([1, 2 + 9 * 0.28 + STANDOFF, 1.7])
    assert portal.upper.heading == pytest.approx(-math.pi / 2)


def test_length_and_height_follow_the_flights_and_the_landing():
    portal = portal_of(make_half_turn())
    assert portal.height == pytest.approx(3.06)
    flight = math.hypot(8 * 0.28, 9 * 0.17)
    assert portal.length == pytest.approx(2 * flight + 1.3 + 2 * 0.6 + 2 * STANDOFF, abs=0.01)


def test_costs_are_high_and_finite_also_for_a_robot_that_cannot_climb():
    for robot in ("spot", "wheeled", "anymal"):
        portal = portal_of(robot=robot)
        assert math.isfinite(portal.cost_up)
        assert portal.cost_up > portal.length / 0.5
        assert portal.cost_down > portal.cost_up


def test_a_portal_carries_the_verdict_of_the_robot():
    assert portal_of(robot="spot").verdict == "passable"
    assert portal_of(robot="wheeled").verdict == "impassable"


@pytest.mark.parametrize(
    ("value", "words"),
    [(OCCUPIED, "inside an obstacle of floor 0"), (UNKNOWN, "on unknown ground of floor 0")],
)
def test_a_portal_that_ends_where_the_robot_cannot_be_is_kept_marked_and_explained(value, words):
    cells = np.full((60, 60), value, dtype=np.int8)
    (note,) = note_obstacles(
        portal_of(), {0: OccupancyGrid(cells=cells, resolution=0.1, origin=(0, 0))}
    ).notes
    assert words in note
    assert "stairway 1: its lower staging pose (1.00, 1.40)" in note


def test_a_portal_outside_of_the_map_is_told():
    grid = OccupancyGrid(cells=np.full((5, 5), FREE, dtype=np.int8), resolution=0.1, origin=(50, 50))
    assert "outside of the map" in note_obstacles(portal_of(), {0: grid}).notes[0]


def test_free_ground_needs_no_note():
    grid = OccupancyGrid(cells=np.full((60, 60), FREE, dtype=np.int8), resolution=0.1, origin=(0, 0))
    assert note_obstacles(portal_of(), {0: grid, 1: grid}).notes == ()


def test_a_portal_is_json():
    values = portal_of().to_dict()
    assert values["levels"] == [0, 1]
    assert values["leads_to_unexplored"] is True


def test_a_cost_is_its_time_and_the_price_of_its_risk():
    """Spot: 0.2 m/s on stairs, 5 s to line up at each of two ends, 10 s a metre up and 15 s a metre down."""
    portal = portal_of()
    length = 2 * STANDOFF + math.hypot(9 * 0.28, 1.7)
    assert portal.length == pytest.approx(length)
    assert portal.cost_up == pytest.approx(length / 0.2 + 10 + 17.0)
    assert portal.cost_down == pytest.approx(length / 0.2 + 10 + 25.5)


def test_the_way_leads_from_one_staging_pose_to_the_other_over_every_flights_ends():
    portal = portal_of(make_half_turn())
    expected = [
        (-STANDOFF, 0, 0), (0, 0, 0), (8 * 0.28, 0, 1.53), (8 * 0.28 + 0.6, 0, 1.53),
        (8 * 0.28 + 0.6, 1.3, 1.53), (8 * 0.28, 1.3, 1.53), (0, 1.3, 3.06), (-STANDOFF, 1.3, 3.06),
    ]  # fmt: skip
    kinds = ("staging", "foot", "top", "corner", "corner", "foot", "top", "staging")
    assert portal.way_kinds == kinds
    assert portal.way == pytest.approx(np.array(expected), abs=1e-9)
    # Three alignments: before each flight and at the end.
    assert portal.cost_up == pytest.approx(portal.length / 0.2 + 15 + 30.6)


@pytest.mark.parametrize("heading", [-math.pi / 2, 0.3, 3.0, -3.0])
def test_the_upper_staging_pose_looks_back_down(heading):
    portal = portal_of(make_stairway(make_flight(heading=heading)))
    assert -math.pi <= portal.upper.heading <= math.pi
    assert math.cos(portal.upper.heading - heading) == pytest.approx(-1)


def test_stairs_between_explored_floors_lead_to_nothing_new():
    for explored, leads_on in (((True, True), False), ((True, False), True), ((False, True), True)):
        floors = tuple(
            Floor(level=level, height=1.7 * level, is_explored=is_explored)
            for level, is_explored in enumerate(explored)
        )
        portal = make_portal(STAIRWAY, FloorStack(floors=floors, levels={1: (0, 1)}), load_robot("spot"))
        assert portal.leads_to_unexplored is leads_on


def test_each_end_is_looked_up_on_the_map_of_its_own_floor_and_in_its_own_place():
    cells = np.full((60, 60), FREE, dtype=np.int8)
    cells[13:15, 9:11] = OCCUPIED  # around (1.0, 1.4): the lower staging pose
    blocked = OccupancyGrid(cells=cells, resolution=0.1, origin=(0, 0))
    free = OccupancyGrid(cells=np.zeros((60, 60), dtype=np.int8), resolution=0.1, origin=(0, 0))
    assert len(note_obstacles(portal_of(), {0: blocked, 1: free}).notes) == 1
    assert note_obstacles(portal_of(), {0: free, 1: blocked}).notes == ()
    again = note_obstacles(note_obstacles(portal_of(), {0: blocked}), {0: blocked})
    assert len(again.notes) == 2


def test_a_portal_is_json_with_all_its_numbers():
    portal = portal_of()
    assert portal.to_dict() == {
        "stairway": 1, "levels": [0, 1], "leads_to_unexplored": True,
        "open_ends": {"lower": False, "upper": False},
        "lower": {"position": [1.0, pytest.approx(2 - STANDOFF), 0.0], "heading": math.pi / 2},
        "upper": portal.upper.to_dict(), "length": portal.length, "height": pytest.approx(1.7),
        "cost_up": portal.cost_up, "cost_down": portal.cost_down, "verdict": "passable", "notes": [],
    }  # fmt: skip


def test_a_robot_of_which_nothing_is_known_gets_a_portal_for_each_stairway_and_no_verdict():
    other = make_stairway(make_flight(base=(9, 9, 0)), stairway_id=4)
    portals = make_portals([STAIRWAY, other], find_floors([STAIRWAY, other]))
    assert [(portal.stairway_id, portal.verdict) for portal in portals] == [(1, "unknown"), (4, "unknown")]


def corners_of(turn, base, landing=None):
    """Corners between a flight along +x that ends at (2.52, 0) and one that begins at a base, turned."""
    return find_landing_corners(make_flight(), make_flight(base=base, heading=turn), landing)


def test_a_quarter_turn_is_one_corner_where_the_middle_lines_meet():
    for side in (1, -1):
        (corner,) = corners_of(side * math.pi / 2, (3.2, side * 0.7, 1.7))
        assert corner == pytest.approx([3.2, 0.0, 1.7])


def test_straight_on_there_is_no_corner():
    assert corners_of(0.0, (3.5, 0.0, 1.7)) == []
    assert corners_of(0.4, (3.5, 0.2, 1.7)) == []


def test_a_half_turn_is_taken_in_the_middle_of_the_landing_or_half_a_width_behind_the_flight():
    landing = Landing(center=[3.3, 0.7, 1.7], size=(1.6, 2.6), heading=0.0)
    for found, depth in (
        (corners_of(math.pi, (2.52, 1.4, 1.7), landing), 0.8),
        (corners_of(math.pi, (2.52, 1.4, 1.7)), 0.6),
    ):
        assert found[0] == pytest.approx([2.52 + depth, 0.0, 1.7])
        assert found[1] == pytest.approx([2.52 + depth, 1.4, 1.7])


def edge_behind_the_top(distance, *, stairway_id=None, falls_back=False, height=1.7, aside=0.0):
    """An edge so far behind the last nosing of ``STAIRWAY``, which leads up along +y."""
    y = 2 + 9 * 0.28 + distance
    ends = [[0.0 + aside, y, height], [2.0 + aside, y, height]]
    return Drop(
        id=1, edge=np.array(ends[::-1] if falls_back else ends), depth=1.0, num_observations=5,
        first_seen_ns=0, last_seen_ns=1, stairway_id=stairway_id,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("distance", "expected", "is_noted"), [(2.0, 0.6, False), (0.8, 0.45, False), (0.5, 0.3, True)]
)
def test_a_staging_pose_keeps_off_an_edge_behind_it(distance, expected, is_noted):
    """On a gallery of 0.8 m a robot was asked to line up 0.2 m before its other edge."""
    assert edge_behind_the_top(1.0).outward == pytest.approx([0.0, 1.0, 0.0])
    floors = find_floors([STAIRWAY])
    portal = make_portal(STAIRWAY, floors, drops=[edge_behind_the_top(distance)])
    assert portal.upper.position[1] - (2 + 9 * 0.28) == pytest.approx(expected)
    assert portal.lower.position == pytest.approx([1, 2 - STANDOFF, 0])
    notes = [note for note in portal.notes if "upper staging pose stands near another edge" in note]
    assert len(notes) == is_noted


@pytest.mark.parametrize(
    "options",
    [{"stairway_id": 1}, {"falls_back": True}, {"height": 0.9}, {"aside": 1.5}],
    ids=["own", "of the well", "of another floor", "beside"],
)
def test_edges_that_are_none_behind_the_stairs_leave_a_staging_pose_where_it_is(options):
    portal = make_portal(STAIRWAY, find_floors([STAIRWAY]), drops=[edge_behind_the_top(0.8, **options)])
    assert portal.upper.position[1] - (2 + 9 * 0.28) == pytest.approx(STANDOFF)
    assert not [note for note in portal.notes if "near another edge" in note]
