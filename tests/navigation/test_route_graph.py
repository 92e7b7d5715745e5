"""Nodes and edges over stairs: which end is which, and which way is up."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from stairmap.navigation.floors import find_floors
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.route_graph import make_route_graph
from walkable_stairways import make_flight, make_half_turn, make_stairway

ROBOT = load_robot("spot")


def graph_of(*stairways, grids=None, **changes):
    robot = replace(ROBOT, **changes)
    portals = make_portals(stairways, find_floors(stairways), robot)
    return make_route_graph(portals, robot, {} if grids is None else grids), portals


def open_grid(*, blocked=None):
    """Free floor from (-5, -5) to (10, 10), with an obstacle in some of it."""
    cells = np.zeros((150, 150), dtype=np.int8)
    if blocked is not None:
        cells[blocked] = 100
    return OccupancyGrid(cells=cells, resolution=0.1, origin=(-5.0, -5.0))


def test_what_leads_up_gains_height_and_what_leads_down_loses_it():
    graph, (portal,) = graph_of(make_half_turn(height=3.0))
    for kind, sign, cost in (("stairs_up", 1, portal.cost_up), ("stairs_down", -1, portal.cost_down)):
        edges = [edge for edge in graph.edges if edge.kind == kind]
        assert sum(edge.height for edge in edges) == pytest.approx(sign * 3.0)
        assert sum(edge.cost for edge in edges) == pytest.approx(cost)
        assert all(edge.portal is portal for edge in edges)
        ways = [(edge.start, edge.end) for edge in edges]
        nodes = range(len(portal.way))[::sign]
        assert ways == list(pairwise(nodes))
        assert [edge.is_first for edge in edges] == [True] + [False] * (len(edges) - 1)
        assert [edge.is_last for edge in edges] == [False] * (len(edges) - 1) + [True]
    assert portal.cost_up != portal.cost_down


def test_the_upper_staging_pose_alone_is_on_the_upper_floor():
    graph, (portal,) = graph_of(make_half_turn(height=3.0))
    assert [node.level for node in graph.nodes] == [0] * (len(graph.nodes) - 1) + [1]
    assert [node.end for node in graph.nodes] == ["lower", *[""] * (len(graph.nodes) - 2), "upper"]
    assert [node.heading for node in graph.nodes if node.kind == "staging"] == [
        portal.lower.heading,
        portal.upper.heading,
    ]
    assert all(np.isnan(node.heading) for node in graph.nodes if node.kind != "staging")


@pytest.mark.parametrize("end", ["bottom_seen", "top_seen"])
def test_only_the_staging_pose_at_an_end_that_nobody_saw_is_open(end):
    graph, _ = graph_of(make_stairway(make_flight(**{end: False})))
    open_ends = [node.end for node in graph.nodes if node.is_open]
    assert open_ends == (["lower"] if end == "bottom_seen" else ["upper"])


def two_stairways():
    """Two flights side by side, both up from floor 0; their feet are 4 m apart along y."""
    return [
        make_stairway(make_flight(base=(0.0, y, 0.0), num_risers=17), stairway_id=number)
        for number, y in ((1, 0.0), (2, 4.0))
    ]


def test_two_stairs_of_a_floor_are_joined_straight_and_level():
    graph, portals = graph_of(*two_stairways(), grids={0: open_grid()})
    edges = [edge for edge in graph.edges if edge.kind == "floor"]
    assert len(edges) == 2 and (edges[0].start, edges[0].end) == (edges[1].end, edges[1].start)
    for edge in edges:
        assert (edge.length, edge.height) == (pytest.approx(4.0), 0.0)
        assert edge.cost == pytest.approx(4.0 / ROBOT.floor_speed)
        assert edge.portal is None and not edge.is_first and not edge.is_last
    assert graph.num_stairways == len(portals) == 2
    assert graph.notes == ("floor 1 has no map, so the graph has no edges on it",)


def test_where_a_thing_stands_between_two_stairs_waypoints_lead_around_it():
    # From x = -3 to 3, halfway between both feet, which are at x = -0.6.
    grid = open_grid(blocked=(slice(69, 72), slice(20, 80)))
    graph, _ = graph_of(*two_stairways(), grids={0: grid})
    waypoints = [node for node in graph.nodes if node.kind == "waypoint"]
    assert waypoints
    for node in waypoints:
        assert (node.level, node.position[2], node.stairway_id, node.end) == (0, pytest.approx(0.0), None, "")
    lengths = [edge.length for edge in graph.edges if edge.kind == "floor"]
    assert 6.2 < sum(lengths) / 2 < 8.5
    # Each way is straight as far as it can be: a few nodes, not one a cell.
    assert len(waypoints) <= 6


def test_two_stairs_with_a_wall_between_them_are_not_joined_and_a_note_says_where():
    grid = open_grid(blocked=(slice(69, 72), slice(None)))
    graph, _ = graph_of(*two_stairways(), grids={0: grid})
    assert not [edge for edge in graph.edges if edge.kind == "floor"]
    assert (
        graph.notes[0]
        == "floor 0: no free way was seen between the stairs at (-0.60, 0.00) and (-0.60, 4.00)"
    )
