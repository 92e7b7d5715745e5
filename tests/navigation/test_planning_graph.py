"""Cells and stairs as a graph: which cells a robot can be on, what a step costs, which stairs lead on."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.occupancy import OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.navigation.planning_graph import SNAP, make_planning_graph, nearest_node
from stairmap.navigation.portals import ANY_ROBOT, make_portal
from stairmap.navigation.robot_profile import load_robot
from walkable_stairways import make_flight, make_stairway

SPOT = load_robot("spot")
FLOORS = FloorStack(
    floors=tuple(Floor(level=level, height=1.7 * level, is_explored=True) for level in (0, 1)),
    levels={1: (0, 1), 2: (0, 1)},
)


def grid_of(rows=30, columns=40, resolution=0.2, origin=(0.0, 0.0)):
    return OccupancyGrid(cells=np.zeros((rows, columns), dtype=np.int8), resolution=resolution, origin=origin)


def with_cells(grid, **changes):
    """Return a grid with cells changed: ``r3c4=OCCUPIED``."""
    cells = grid.cells.copy()
    for place, value in changes.items():
        row, column = place.removeprefix("r").split("c")
        cells[int(row), int(column)] = value
    return replace(grid, cells=cells)


def graph_of(grids, portals=(), robot=SPOT, **options):
    options.setdefault("allow_unknown", False)
    return make_planning_graph(grids, portals, robot, **options)


def portal_at(x, y, stairway_id=1, robot=SPOT, **flight):
    return make_portal(
        make_stairway(make_flight(base=(x, y, 0.0), **flight), stairway_id=stairway_id), FLOORS, robot
    )


def numbers_by_cell(places):
    """Return every cell's own number, 0 ... N - 1, -1 elsewhere, for a grid of 30 by 40 cells."""
    numbers = np.full((30, 40), -1)
    for number, (row, column) in enumerate(places):
        numbers[row, column] = number
    return numbers


def test_every_free_cell_is_a_node_that_knows_its_place():
    graph = graph_of({0: with_cells(grid_of(), r0c0=UNKNOWN), 1: grid_of(rows=5, columns=6)})
    assert len(graph.places) == 30 * 40 - 1 + 30
    assert graph.nodes[0][0, 0] == -1
    for level, row, column in ((0, 0, 1), (0, 29, 39), (1, 0, 0), (1, 4, 5)):
        assert tuple(graph.places[graph.nodes[level][row, column]]) == (level, row, column)


def test_a_step_to_any_of_eight_neighbours_costs_its_length_at_the_robots_speed():
    graph = graph_of({0: grid_of()})
    numbers, costs = graph.nodes[0], graph.edges.toarray()
    assert SPOT.floor_speed == 0.5
    for rows in (-1, 0, 1):
        for columns in (-1, 0, 1):
            length = math.hypot(rows, columns)
            cost = costs[numbers[5, 5], numbers[5 + rows, 5 + columns]]
            assert cost == pytest.approx(length * 0.2 / 0.5)
    assert np.count_nonzero(costs[numbers[5, 5]]) == 8
    assert np.count_nonzero(costs[numbers[0, 0]]) == 3


def test_a_robot_keeps_half_its_width_from_obstacles_but_not_from_unknown_ground():
    """Spot with its clearance is 0.6 m wide: centres of cells are farther than 0.3 m from an obstacle's."""
    grid = with_cells(grid_of(resolution=0.1), r10c10=OCCUPIED, r10c30=UNKNOWN)
    numbers = graph_of({0: grid}).nodes[0]
    assert numbers[10, 13] == -1
    assert numbers[10, 14] >= 0
    assert numbers[13, 10] == -1
    assert numbers[14, 10] >= 0
    assert numbers[12, 12] == -1
    assert numbers[13, 12] >= 0
    assert numbers[10, 30] == -1
    assert numbers[10, 31] >= 0


def test_a_robot_of_unknown_width_keeps_a_quarter_of_a_metre():
    grid = with_cells(grid_of(resolution=0.1), r10c10=OCCUPIED)
    numbers = graph_of({0: grid}, robot=ANY_ROBOT).nodes[0]
    assert numbers[10, 12] == -1
    assert numbers[10, 13] >= 0


def test_a_map_without_any_obstacle_is_open_where_it_is_free():
    numbers = graph_of({0: with_cells(grid_of(), r3c4=UNKNOWN)}).nodes[0]
    assert np.argwhere(numbers < 0).tolist() == [[3, 4]]


@pytest.mark.parametrize("shift", [(2, 0), (-2, 0), (0, 2), (0, -2), (1, 2), (-2, -1)])
def test_a_point_stands_for_the_nearest_free_cell_on_any_side(shift):
    """Two cells of 0.2 m away, and a farther one on each side."""
    near = (15 + shift[0], 20 + shift[1])
    far = [(15 - 3, 20), (15 + 3, 20), (15, 20 - 3), (15, 20 + 3)]
    numbers = numbers_by_cell([*far, near])
    assert nearest_node(grid_of(), numbers, (20.5 * 0.2, 15.5 * 0.2)) == 4


def test_a_point_stands_for_the_cell_that_is_nearest_to_itself_not_to_its_own_cell():
    numbers = numbers_by_cell([(15, 18), (15, 22)])
    assert nearest_node(grid_of(), numbers, (20.6 * 0.2, 15.5 * 0.2, 1.7)) == 1
    assert nearest_node(grid_of(), numbers, (20.4 * 0.2, 15.5 * 0.2, 1.7)) == 0


@pytest.mark.parametrize("direction", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_a_cell_may_be_half_a_metre_away_and_a_cells_size_more(direction):
    """Cells of 0.05 m: up to 0.55 m."""
    assert SNAP == 0.5
    grid = grid_of(rows=60, columns=60, resolution=0.05)
    for num_cells, is_near in ((10, True), (12, False)):
        numbers = np.full((60, 60), -1)
        numbers[30 + direction[0] * num_cells, 30 + direction[1] * num_cells] = 7
        found = nearest_node(grid, numbers, (30.5 * 0.05, 30.5 * 0.05))
        assert found == (7 if is_near else None)


@pytest.mark.parametrize("point", [(-0.3, 3.0), (8.3, 3.0), (4.0, -0.3), (4.0, 6.3)])
def test_a_point_just_outside_of_a_map_stands_for_the_cell_at_its_border(point):
    numbers = graph_of({0: grid_of()}).nodes[0]
    found = nearest_node(grid_of(), numbers, point)
    assert found is not None
    row, column = np.argwhere(numbers == found)[0]
    assert math.dist(((column + 0.5) * 0.2, (row + 0.5) * 0.2), point) < 0.45


@pytest.mark.parametrize(
    "point", [(-0.9, 3.0), (8.9, 3.0), (4.0, -0.9), (4.0, 6.9), (-5.0, -5.0), (99.0, 99.0)]
)
def test_a_point_far_outside_of_a_map_stands_for_nothing(point):
    assert nearest_node(grid_of(), graph_of({0: grid_of()}).nodes[0], point) is None


def test_stairs_join_the_cells_at_their_staging_poses_up_and_down_at_their_costs():
    portal = portal_at(2.0, 3.1)
    graph = graph_of({0: grid_of(), 1: grid_of()}, [portal])
    low = nearest_node(grid_of(), graph.nodes[0], portal.lower.position)
    high = nearest_node(grid_of(), graph.nodes[1], portal.upper.position)
    assert graph.stairs == {(low, high): (portal, "up"), (high, low): (portal, "down")}
    assert graph.edges[low, high] == pytest.approx(portal.cost_up)
    assert graph.edges[high, low] == pytest.approx(portal.cost_down)
    assert graph.reasons == ()


def test_of_several_stairs_each_is_judged_for_itself():
    """A steep one in between must not end the list."""
    steep = portal_at(2.0, 1.1, stairway_id=1, rise=0.25)
    good = portal_at(2.0, 4.1, stairway_id=2)
    graph = graph_of({0: grid_of(), 1: grid_of()}, [steep, good])
    assert {portal.stairway_id for portal, _ in graph.stairs.values()} == {2}
    assert graph.reasons == ("stairway 1 (floor 0 to 1) is impassable for Boston Dynamics Spot: rise",)


@pytest.mark.parametrize("allow_unknown", [True, False])
def test_stairs_of_unknown_verdict_are_used_where_allowed_and_else_named(allow_unknown):
    portal = portal_at(2.0, 3.1, rise=0.178)
    assert portal.verdict == "unknown"
    graph = graph_of({0: grid_of(), 1: grid_of()}, [portal], allow_unknown=allow_unknown)
    assert bool(graph.stairs) is allow_unknown
    assert len(graph.reasons) == int(not allow_unknown)
    steep = portal_at(2.0, 3.1, rise=0.25)
    assert not graph_of({0: grid_of(), 1: grid_of()}, [steep], allow_unknown=allow_unknown).stairs


def test_stairs_with_one_end_only_are_not_used_and_it_is_said_which():
    graph = graph_of({0: grid_of()}, [portal_at(2.0, 3.1)])
    assert graph.stairs == {}
    assert graph.reasons == ("stairway 1 (floor 0 to 1) ends on floor 1, which has no map",)
    graph = graph_of({0: grid_of(columns=8), 1: grid_of(columns=8)}, [portal_at(1.0, 3.1)])
    assert graph.stairs == {}
    assert graph.reasons == ("stairway 1 (floor 0 to 1) ends where the robot cannot be on floor 1",)


def test_no_point_stands_for_ground_behind_a_wall():
    """Between two walls, too near for the robot, it stood for the room behind one of them."""
    grid = grid_of(rows=60, columns=60, resolution=0.05)
    cells = np.array(grid.cells)
    cells[27, :] = cells[33, :] = OCCUPIED
    walled = OccupancyGrid(cells=cells, resolution=0.05, origin=grid.origin)
    numbers = np.where(np.abs(np.arange(60)[:, None] - 30) > 7, np.arange(3600).reshape(60, 60), -1)
    place = (30.5 * 0.05, 30.5 * 0.05)
    assert nearest_node(walled, numbers, place) is None
    assert nearest_node(grid, numbers, place) is not None
    # Who stands in what the map calls an obstacle, gets out of it: a strip before an edge, noise.
    assert nearest_node(walled, numbers, (30.5 * 0.05, 27.5 * 0.05)) is not None
