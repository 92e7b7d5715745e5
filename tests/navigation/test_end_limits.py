"""Ends of stairs and edges of floors in numbers: where staging poses, strips and ways begin and end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stairmap.drop import Drop
from stairmap.navigation.carried_stairs import CarriedStairway, carry_to_floors
from stairmap.navigation.floors import Floor, FloorStack, find_floors
from stairmap.navigation.footprints import drop_rectangles
from stairmap.navigation.occupancy import FREE, OCCUPIED, OccupancyGrid
from stairmap.navigation.portals import make_portal, make_portals, note_obstacles
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.route_graph import RouteGraph, make_route_graph
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from walkable_stairways import make_flight, make_half_turn, make_stairway

RISE, RUN, COUNT = 0.17, 0.28, 12
STANDOFF = 0.6
SPOT = load_robot("spot")


def floors_at(*heights: float, open_levels: tuple[int, ...] = ()) -> FloorStack:
    """Floors at heights, of which stairway 1 joins the first and the last."""
    floors = tuple(
        Floor(level=level, height=height, is_explored=True, is_open=level in open_levels)
        for level, height in enumerate(heights)
    )
    return FloorStack(floors=floors, levels={1: (0, len(heights) - 1)}, open_ends={1: (False, False)})


def drop_at(x: float, *, z: float = COUNT * RISE, y: float = 0.0, turn: float = 0.0) -> Drop:
    """A drop of stairway 1, a metre long, that falls towards -x turned to the left."""
    side = 0.5 * np.array([np.sin(turn), -np.cos(turn), 0.0])
    edge = np.array([x, y, z]) + np.array([side, -side])
    return Drop(
        id=1, edge=edge, depth=0.5, num_observations=5, first_seen_ns=0, last_seen_ns=1, stairway_id=1
    )  # fmt: skip


def cut_above(missing: int) -> Stairway:
    """A flight of which the last risers were not seen."""
    return make_stairway(make_flight(num_risers=COUNT - missing, top_seen=False))


@pytest.mark.parametrize(("off", "is_edge"), [(0.33, True), (-0.33, True), (0.37, False), (-0.37, False)])
def test_an_edge_is_of_the_upper_floor_within_0_35_m_of_its_height(off: float, is_edge: bool) -> None:
    stack = floors_at(0.0, COUNT * RISE)
    drop = drop_at(COUNT * RUN, z=COUNT * RISE + off)
    carried = carry_to_floors(cut_above(2), stack, [drop])
    assert carried.stairway.flights[0].num_risers == COUNT + is_edge
    # Where the edge was seen, half a run is not known; otherwise a whole one.
    assert carried.unknown_above == pytest.approx(0.5 * RUN if is_edge else RUN)


def test_an_edge_before_the_last_nosing_that_was_seen_takes_no_riser_away() -> None:
    carried = carry_to_floors(cut_above(2), floors_at(0.0, COUNT * RISE), [drop_at(5 * RUN)])
    assert carried.stairway.flights[0].num_risers == COUNT - 2


def test_of_two_edges_the_farther_one_is_the_floors() -> None:
    edges = [drop_at(COUNT * RUN), drop_at((COUNT - 2) * RUN)]
    for drops in (edges, edges[::-1]):
        carried = carry_to_floors(cut_above(3), floors_at(0.0, COUNT * RISE), drops)
        assert carried.stairway.flights[0].num_risers == COUNT + 1


def test_a_floor_above_the_lowest_riser_that_was_seen_adds_none() -> None:
    flight = make_flight(num_risers=COUNT, bottom_seen=False)
    carried = carry_to_floors(make_stairway(flight), floors_at(2 * RISE, COUNT * RISE))
    assert carried.stairway.flights[0].num_risers == COUNT
    assert carried.stairway.flights[0].base == pytest.approx([0.0, 0.0, 0.0])
    assert carried.unknown_below == 0.0


def test_below_a_floor_that_nobody_knows_nothing_is_added_but_room() -> None:
    flight = make_flight(base=(2 * RUN, 0.0, 2 * RISE), num_risers=COUNT - 2, bottom_seen=False)
    carried = carry_to_floors(make_stairway(flight), floors_at(0.0, COUNT * RISE, open_levels=(0,)))
    assert carried.stairway.flights[0].num_risers == COUNT - 2
    assert (carried.unknown_below, carried.unknown_above) == (1.2, 0.0)


def test_what_is_said_to_be_carried_is_known_to_its_ends_unless_told_otherwise() -> None:
    carried = CarriedStairway(stairway=make_stairway())
    assert (carried.unknown_below, carried.unknown_above) == (0.0, 0.0)


def half_turn(*, bottom_seen: bool = True, top_seen: bool = True) -> Stairway:
    """Two flights with a landing between them; at the ends that nobody saw a riser is missing."""
    stairway = make_half_turn(height=18 * RISE)
    lower, upper = stairway.flights
    if not bottom_seen:
        base = lower.base + np.array([RUN, 0.0, RISE])
        lower = replace(lower, base=base, num_risers=8, bottom_seen=False)
    if not top_seen:
        upper = replace(upper, num_risers=8, top_seen=False)
    return replace(stairway, flights=(lower, upper))


@pytest.mark.parametrize(("bottom_seen", "top_seen"), [(False, True), (True, False), (False, False)])
def test_of_two_flights_the_first_is_carried_down_and_the_last_up(bottom_seen: bool, top_seen: bool) -> None:
    carried = carry_to_floors(
        half_turn(bottom_seen=bottom_seen, top_seen=top_seen), floors_at(0.0, 18 * RISE)
    )
    assert [flight.num_risers for flight in carried.stairway.flights] == [9, 9]
    assert carried.stairway.flights[0].base == pytest.approx([0.0, 0.0, 0.0])
    assert carried.unknown_below == pytest.approx(0.0 if bottom_seen else RUN)
    assert carried.unknown_above == pytest.approx(0.0 if top_seen else RUN)


def test_staging_poses_stand_off_by_what_is_not_known_of_their_end() -> None:
    below = make_flight(base=(RUN, 0.0, RISE - 1.0), num_risers=COUNT - 1, bottom_seen=False)
    portal = make_portal(make_stairway(below), floors_at(-1.0, COUNT * RISE - 1.0), SPOT)
    assert portal.lower.position == pytest.approx([-STANDOFF - RUN, 0.0, -1.0])
    assert portal.upper.position == pytest.approx([11 * RUN + STANDOFF, 0.0, COUNT * RISE - 1.0])
    # Measured from the foot, wherever that lies.
    assert portal.height == pytest.approx(COUNT * RISE)
    above = make_portal(cut_above(1), floors_at(0.0, COUNT * RISE), SPOT)
    assert above.lower.position == pytest.approx([-STANDOFF, 0.0, 0.0])
    assert above.upper.position == pytest.approx([11 * RUN + STANDOFF + RUN, 0.0, COUNT * RISE])


def test_an_end_without_a_map_or_on_free_ground_does_not_hide_the_other() -> None:
    portal = make_portal(make_stairway(make_flight()), find_floors([make_stairway(make_flight())]), SPOT)
    occupied, free = (
        OccupancyGrid(cells=np.full((160, 160), value, np.int8), resolution=0.1, origin=(-8.0, -8.0))
        for value in (OCCUPIED, FREE)
    )
    for grids in ({1: occupied}, {0: free, 1: occupied}):
        (note,) = note_obstacles(portal, grids).notes
        assert "its upper staging pose" in note
    (note,) = note_obstacles(portal, {0: occupied, 1: free}).notes
    assert "its lower staging pose" in note


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
def test_the_strip_at_a_drop_reaches_from_35_cm_before_to_20_cm_beyond_it(turn: float) -> None:
    drop = drop_at(3.0, y=1.0, turn=turn)
    (strip,) = drop_rectangles([drop], floors_at(0.0, COUNT * RISE), 1)
    outward = -np.array([np.cos(turn), np.sin(turn)])
    assert strip.center == pytest.approx(tuple(np.array([3.0, 1.0]) - 0.075 * outward))
    assert np.cos(strip.heading - np.arctan2(outward[1], outward[0])) == pytest.approx(1.0)
    assert strip.length == pytest.approx(0.55)
    assert strip.width == pytest.approx(1.6)


@pytest.mark.parametrize(("below", "is_on"), [(0.38, True), (0.98, True), (1.06, False)])
def test_a_drop_is_on_the_floor_that_is_nearest_to_its_height(below: float, is_on: bool) -> None:
    drop = drop_at(3.0, z=COUNT * RISE - below)
    assert bool(drop_rectangles([drop], floors_at(0.0, COUNT * RISE), 1)) == is_on


def stay(*heights: float) -> Trajectory:
    """Twelve poses at each height, the camera 0.6 m above the floor, away from all stairs."""
    z = np.repeat(np.array(heights), 12) + 0.6
    poses = np.tile(np.eye(4), (len(z), 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = -9.0 - 0.01 * np.arange(len(z)), z
    return Trajectory(stamps_ns=np.arange(len(z)), map_from_camera=poses)


def known_floors(**ids: int) -> FloorStack:
    """Floors that were found before, by name: ``at_3`` is 3 m up, ``below_3`` as much down."""
    heights = {name: float(name.split("_")[1]) * (-1 if name.startswith("below") else 1) for name in ids}
    floors = [
        Floor(level=level, height=heights[name], is_explored=True, id=ids[name])
        for level, name in enumerate(sorted(ids, key=heights.__getitem__))
    ]
    return FloorStack(floors=tuple(floors), levels={})


def ids_of(trajectory: Trajectory, known: FloorStack | None) -> list[int | None]:
    return [floor.id for floor in find_floors([], trajectory, camera_height=0.6, known=known).floors]


def test_floors_keep_the_ids_of_those_known_at_their_height() -> None:
    known = known_floors(below_3=4, at_0=7, at_3=5)
    assert ids_of(stay(0.2, 3.1, -3.2), known) == [4, 7, 5]
    # One that is new gets a number that none had, whichever lies nearest.
    assert ids_of(stay(0.0, 6.0, 3.0), known) == [7, 5, 8]
    assert ids_of(stay(0.0, 6.0, 9.0), known) == [7, 8, 9]


@pytest.mark.parametrize(("height", "floor_id"), [(3.58, 5), (3.62, 8)])
def test_a_floor_is_a_known_one_within_0_6_m_of_its_height(height: float, floor_id: int) -> None:
    assert ids_of(stay(0.0, height), known_floors(at_0=7, at_3=5)) == [7, floor_id]


def test_of_two_floors_near_a_known_one_the_nearer_is_it() -> None:
    # Storeys of 1.9 m: 0.9 and 1.0 m from what is known are both too far, 0.5 m is not.
    assert ids_of(stay(0.0, 2.5), known_floors(at_0=7, at_2=5)) == [7, 5]
    known = known_floors(at_0=1)
    known = replace(known, floors=(*known.floors, Floor(level=1, height=0.5, is_explored=True, id=2)))
    assert ids_of(stay(0.3), known) == [2]
    assert ids_of(stay(0.2), known) == [1]


def test_ids_are_levels_at_first_and_numbers_from_0_where_none_were_given() -> None:
    assert ids_of(stay(0.0, 3.0, -3.0), None) == [-1, 0, 1]
    nameless = FloorStack(floors=(Floor(level=0, height=0.0, is_explored=True),), levels={})
    assert ids_of(stay(0.0, 3.0), nameless) == [0, 1]


def test_a_floor_is_closed_unless_it_is_said_to_be_open() -> None:
    assert not Floor(level=0, height=0.0, is_explored=True).is_open


def open_above(*, num_risers: int = 10) -> Stairway:
    return make_stairway(make_flight(num_risers=num_risers, top_seen=False))


def open_below() -> Stairway:
    return make_stairway(make_flight(base=(0.0, 0.0, -1.7), num_risers=10, bottom_seen=False))


def test_an_end_that_nobody_saw_is_closed_where_a_robot_stood_at_its_height() -> None:
    for stairway, other, upper in ((open_above(), 1.7, True), (open_below(), -1.7, False)):
        assert find_floors([stairway], stay(0.0)).has_open_end(1, upper=upper)
        assert not find_floors([stairway], stay(0.0, other)).has_open_end(1, upper=upper)
        assert not find_floors([stairway], stay(0.0, other)).has_open_end(1, upper=not upper)
        assert not find_floors([stairway], stay(0.0)).has_open_end(1, upper=not upper)


@pytest.mark.parametrize(("height", "is_open"), [(1.98, False), (2.02, True)])
def test_an_end_lies_on_a_floor_within_0_3_m(height: float, is_open: bool) -> None:
    stack = find_floors([open_above()], stay(0.0, height), camera_height=0.6)
    assert stack.has_open_end(1, upper=True) == is_open


def open_grid() -> OccupancyGrid:
    """Free floor from (-5, -5) to (10, 10)."""
    return OccupancyGrid(cells=np.zeros((150, 150), np.int8), resolution=0.1, origin=(-5.0, -5.0))


def two_stairways(apart: float = 4.0) -> list[Stairway]:
    return [
        make_stairway(make_flight(base=(0.0, y, 0.0), num_risers=17), stairway_id=number)
        for number, y in ((1, 0.0), (2, apart))
    ]


def graph_of(stairways: list[Stairway], grids: dict[int, OccupancyGrid]) -> RouteGraph:
    return make_route_graph(make_portals(stairways, find_floors(stairways), SPOT), SPOT, grids)


def test_an_upper_floor_is_crossed_between_the_upper_staging_poses() -> None:
    graph = graph_of(two_stairways(), {1: open_grid()})
    floor = [edge for edge in graph.edges if edge.kind == "floor"]
    assert [(graph.nodes[edge.start].end, graph.nodes[edge.end].end) for edge in floor] == [
        ("upper", "upper")
    ] * 2
    assert [edge.length for edge in floor] == pytest.approx([4.0, 4.0])
    assert graph.notes == ("floor 0 has no map, so the graph has no edges on it",)


def test_stairs_that_a_robot_cannot_use_do_not_hide_the_next_ones() -> None:
    _, second = two_stairways()
    steep = make_stairway(make_flight(rise=0.34, run=0.2, num_risers=9), stairway_id=1)
    graph = graph_of([steep, second], {})
    assert {node.stairway_id for node in graph.nodes} == {2}
    assert graph.num_stairways == 2


def test_stairs_whose_feet_lie_within_a_cell_are_joined() -> None:
    floor = [edge for edge in graph_of(two_stairways(0.04), {0: open_grid()}).edges if edge.kind == "floor"]
    assert [edge.length for edge in floor] == pytest.approx([0.04, 0.04])


def test_waypoints_lie_between_two_stairs_and_each_is_needed() -> None:
    cells = np.zeros((150, 150), np.int8)
    cells[69:72, 20:80] = OCCUPIED
    graph = graph_of(two_stairways(), {0: replace(open_grid(), cells=cells)})
    edges = [edge for edge in graph.edges if edge.kind == "floor"]
    waypoints = [node for node in graph.nodes if node.kind == "waypoint"]
    assert len(edges) == 2 * (len(waypoints) + 1)
    assert min(edge.length for edge in edges) > 0.05
    places = [graph.nodes[0].position, *[node.position for node in waypoints]]
    ends = [node.position for node in graph.nodes if node.end == "lower"]
    assert all(np.linalg.norm(place - end) > 0.05 for place in places[1:] for end in ends)
    assert len(waypoints) == 3


def test_a_graph_of_nothing_was_asked_for_no_stairway() -> None:
    assert RouteGraph(nodes=(), edges=()).num_stairways == 0
