"""Route graphs of architects' buildings: no edge leads through a wall or over a well."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from stairmap.modeling.landings import join_flights, make_landing, top_of
from stairmap.navigation.floors import find_floors
from stairmap.navigation.keepout import block_stairs
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.portals import make_portals
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.route_graph import make_route_graph
from stairmap.simulation.meshes import load_building_scenes
from stairmap.simulation.render import RayCaster
from stairmap.stairway import Stairway

RESOLUTION = 0.1
DOWN = np.array([0.0, 0.0, -1.0])


def load_building(folder: Path) -> tuple[RayCaster, list[Stairway]]:
    scene = load_building_scenes(folder)[0]
    flights = [flight for stairway in scene.stairways for flight in stairway.flights]
    stairways = []
    for number, chain in enumerate(join_flights(flights), start=1):
        parts = [flights[index] for index in chain]
        landings = tuple(make_landing(*pair) for pair in pairwise(parts))
        stairways.append(replace(scene.stairways[0], id=number, flights=tuple(parts), landings=landings))
    return RayCaster(scene.mesh), stairways


def ground_below(caster: RayCaster, places: np.ndarray, height: float) -> np.ndarray:
    """(N,) height of what lies under (N, 2) places, seen from a metre above a floor, m; -inf for nothing."""
    origins = np.column_stack([places, np.full(len(places), height + 1.0)])
    return height + 1.0 - caster.distances(origins, DOWN, 10.0)


def is_blocked(caster: RayCaster, starts: np.ndarray, ends: np.ndarray, height: float) -> np.ndarray:
    """(N,) whether something stands between (N, 2) places at knee or chest height."""
    blocked = np.zeros(len(starts), dtype=bool)
    span = np.linalg.norm(ends - starts, axis=1, keepdims=True)
    rays = np.column_stack([(ends - starts) / np.maximum(span, 1e-9), np.zeros(len(starts))])
    for above in (0.3, 1.0):
        origins = np.column_stack([starts, np.full(len(starts), height + above)])
        blocked |= caster.distances(origins, rays, 50.0) < span[:, 0]
    return blocked


def map_floor(caster: RayCaster, stairways: list[Stairway], height: float) -> OccupancyGrid:
    """What a robot would map of a floor that it has seen as a whole, around the stairs."""
    ends = np.array([place for s in stairways for place in (s.flights[0].base, top_of(s.flights[-1]))])
    low, high = ends[:, :2].min(axis=0) - 5.0, ends[:, :2].max(axis=0) + 5.0
    shape = np.ceil((high - low) / RESOLUTION).astype(int)[::-1]
    rows, columns = np.indices(tuple(shape))
    centers = low + RESOLUTION * (np.stack([columns, rows], axis=-1).reshape(-1, 2) + 0.5)
    ground = ground_below(caster, centers, height) - height
    cells = np.full(len(centers), -1, dtype=np.int8)
    cells[np.abs(ground) < 0.05] = 0
    cells[(ground > 0.1) | ((ground < -0.15) & np.isfinite(ground))] = 100
    cells = cells.reshape(tuple(shape))
    centers = centers.reshape(*shape, 2)
    for axis in (0, 1):
        first, second = (np.moveaxis(centers, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        hit = is_blocked(caster, first.reshape(-1, 2), second.reshape(-1, 2), height).reshape(first.shape[:2])
        moved = np.moveaxis(cells, axis, 0)
        moved[:-1][hit] = 100
        moved[1:][hit] = 100
    return OccupancyGrid(cells=cells, resolution=RESOLUTION, origin=(float(low[0]), float(low[1])))


@pytest.mark.parametrize("name", ["hospital", "institute_var2", "office_a"])
def test_no_edge_leads_through_a_wall_or_over_a_well(name: str, shared_data: Path) -> None:
    caster, stairways = load_building(shared_data / "buildings" / name)
    floors = find_floors(stairways)
    robot = replace(load_robot("spot"), max_continuous_rise=0.3, max_single_rise=0.3, min_run=0.2)
    grids = {
        floor.level: block_stairs(map_floor(caster, stairways, floor.height), stairways, floors, floor.level)
        for floor in floors.floors
    }
    graph = make_route_graph(make_portals(stairways, floors, robot), robot, grids)
    floor_edges = [edge for edge in graph.edges if edge.kind == "floor"]
    stair_edges = [edge for edge in graph.edges if edge.kind != "floor"]
    # In the institute all stairs of a floor are joined; the other floors are rooms behind closed doors.
    assert stair_edges and (floor_edges or name == "office_a")
    heights = {floor.level: floor.height for floor in floors.floors}
    for edge in floor_edges:
        start, end = (graph.nodes[number] for number in (edge.start, edge.end))
        height = heights[start.level]
        ends = np.array([[start.position[:2]], [end.position[:2]]])
        assert not is_blocked(caster, *ends, height)[0], (name, start, end)
        shares = np.linspace(0, 1, int(edge.length / 0.05) + 2)[:, None]
        places = start.position[:2] + shares * (end.position - start.position)[:2]
        assert (ground_below(caster, places, height) > height - 0.15).all(), (name, start, end)
    # Over the stairs there is something to stand on all the way.
    for edge in stair_edges:
        start, end = (graph.nodes[number].position for number in (edge.start, edge.end))
        shares = np.linspace(0.02, 0.98, int(edge.length / 0.1) + 2)[:, None]
        for place in start + shares * (end - start):
            ground = ground_below(caster, place[None, :2], float(place[2]))[0]
            assert ground > place[2] - 0.45, (name, edge.kind, place, ground)
