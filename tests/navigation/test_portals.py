"""Portals: staging poses that face the stairs, finite costs, obstacles told and kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.navigation.portals import STANDOFF, make_portal, note_obstacles
from stairmap.navigation.robot_profile import load_robot
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
    assert portal.length == pytest.approx(2 * flight + 1.3 + 2 * STANDOFF, abs=0.2)


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
