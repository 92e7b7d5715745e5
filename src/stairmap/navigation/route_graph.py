"""Stairs and the free ways between them as a graph of places and straight edges, for planners of routes.

A planner that follows straight edges must find them on the stairs and on free floor. So there is a node at
each end of a flight and each corner of a landing, and floors have edges only where their map is known: a
straight one where that is free, else one around by nodes on the way, or none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Literal, TypeAlias

import numpy as np

from stairmap.arrays import Points, Vector, readonly
from stairmap.navigation.floor_heights import FloorError
from stairmap.navigation.occupancy import FREE, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.navigation.planning_graph import is_usable
from stairmap.navigation.portals import Portal, WayKind
from stairmap.navigation.robot_profile import RobotProfile

EdgeKind: TypeAlias = Literal["stairs_up", "stairs_down", "floor"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteNode:
    """A place.

    Attributes
    ----------
    position
        (3,) m, map.
    level
        Its floor; on stairs, the floor that they begin on.
    kind
        A point of the way over a stairway, or a ``waypoint`` on a floor.
    heading
        Direction in which a robot stands there, rad; NaN where that does not matter.
    stairway_id
        The stairway; ``None`` on a floor.
    end
        ``lower`` or ``upper`` for a staging pose, else empty.
    is_open
        Whether nobody saw the end of the stairs that it stands before.
    """

    position: Vector
    level: int
    kind: WayKind | Literal["waypoint"]
    heading: float = math.nan
    stairway_id: int | None = None
    end: str = ""
    is_open: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", readonly(self.position))


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteEdge:
    """A straight way from one node to another.

    Attributes
    ----------
    start, end
        Indices of its nodes.
    kind
        ``stairs_up``, ``stairs_down`` or ``floor``.
    cost
        What it costs, s. The edges of a stairway have its cost together.
    length, height
        Length, and height gained, m.
    portal
        The stairway; ``None`` on a floor.
    is_first, is_last
        Whether it is the first or last edge over its stairway in this direction.
    """

    start: int
    end: int
    kind: EdgeKind
    cost: float
    length: float
    height: float
    portal: Portal | None = None
    is_first: bool = False
    is_last: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class RouteGraph:
    """Nodes and edges.

    Attributes
    ----------
    nodes, edges
        Places and ways between them.
    num_stairways
        Stairways that were asked for, usable or not.
    notes
        What is missing, a sentence each.
    """

    nodes: tuple[RouteNode, ...]
    edges: tuple[RouteEdge, ...]
    num_stairways: int = 0
    notes: tuple[str, ...] = ()


def make_route_graph(
    portals: Sequence[Portal],
    robot: RobotProfile,
    grids: Mapping[int, OccupancyGrid],
    *,
    allow_unknown: bool = True,
) -> RouteGraph:
    """Return the graph of all stairways that a robot can use, and of the floors between them.

    Parameters
    ----------
    portals
        The stairways.
    robot
        Its speeds and width, and in which directions it takes stairs.
    grids
        Maps of floors by level, on which stairs and drops are blocked (``block_stairs``).
    allow_unknown
        Whether stairs with the verdict ``unknown`` are used. Impassable ones never are.
    """
    nodes: list[RouteNode] = []
    edges: list[RouteEdge] = []
    staging: dict[int, list[int]] = {}
    for portal in portals:
        if not is_usable(portal, allow_unknown=allow_unknown):
            continue
        first = len(nodes)
        nodes += _stair_nodes(portal)
        staging.setdefault(portal.lower_level, []).append(first)
        staging.setdefault(portal.upper_level, []).append(len(nodes) - 1)
        edges += _stair_edges(portal, robot, first)
    notes = []
    for level, members in sorted(staging.items()):
        if len(members) < 2:
            continue
        if level not in grids:
            notes.append(f"floor {level} has no map, so the graph has no edges on it")
            continue
        planner = FloorPlanner({level: grids[level]}, (), robot)
        for start, end in combinations(members, 2):
            way = _find_floor_way(planner, level, nodes[start].position, nodes[end].position)
            if way is None:
                pair = " and ".join(
                    f"({nodes[number].position[0]:.2f}, {nodes[number].position[1]:.2f})"
                    for number in (start, end)
                )
                notes.append(f"floor {level}: no free way was seen between the stairs at {pair}")
                continue
            between = [
                RouteNode(position=np.array([*place, nodes[start].position[2]]), level=level, kind="waypoint")
                for place in way
            ]
            chain = [start, *range(len(nodes), len(nodes) + len(between)), end]
            nodes += between
            edges += _floor_edges(nodes, chain, robot.floor_speed)
    return RouteGraph(
        nodes=tuple(nodes),
        edges=tuple(edges),
        num_stairways=len(portals),
        notes=tuple(dict.fromkeys(notes)),
    )


def _stair_nodes(portal: Portal) -> list[RouteNode]:
    last = len(portal.way) - 1
    nodes = []
    for index, (position, kind) in enumerate(zip(portal.way, portal.way_kinds, strict=True)):
        is_upper = index == last
        pose = portal.upper if is_upper else portal.lower
        nodes.append(
            RouteNode(
                position=position,
                level=portal.upper_level if is_upper else portal.lower_level,
                kind=kind,
                heading=pose.heading if kind == "staging" else math.nan,
                stairway_id=portal.stairway_id,
                end=("upper" if is_upper else "lower") if kind == "staging" else "",
                is_open=(portal.is_upper_open if is_upper else portal.is_lower_open) and kind == "staging",
            )
        )
    return nodes


def _stair_edges(portal: Portal, robot: RobotProfile, first: int) -> list[RouteEdge]:
    """Edges over a stairway in the directions that a robot takes; its cost is shared among them."""
    steps = np.diff(portal.way, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    edges: list[RouteEdge] = []
    for sign, cost in ((1, portal.cost_up), (-1, portal.cost_down)):
        if not robot.takes_stairs(up=sign > 0):
            continue
        shares = cost * lengths / lengths.sum()
        for place, index in enumerate(range(len(steps))[::sign]):
            ends = (first + index, first + index + 1)[::sign]
            edges.append(
                RouteEdge(
                    start=ends[0],
                    end=ends[1],
                    kind="stairs_up" if sign > 0 else "stairs_down",
                    cost=float(shares[index]),
                    length=float(lengths[index]),
                    height=float(sign * steps[index, 2]),
                    portal=portal,
                    is_first=place == 0,
                    is_last=place == len(steps) - 1,
                )
            )
    return edges


def _floor_edges(nodes: Sequence[RouteNode], chain: Sequence[int], speed: float) -> list[RouteEdge]:
    """Edges both ways along a chain of nodes on one floor."""
    edges = []
    for first, second in pairwise(chain):
        length = float(np.linalg.norm((nodes[second].position - nodes[first].position)[:2]))
        for start, end in ((first, second), (second, first)):
            edges.append(
                RouteEdge(
                    start=start, end=end, kind="floor", cost=length / speed, length=length, height=0.0
                )
            )  # fmt: skip
    return edges


def _find_floor_way(planner: FloorPlanner, level: int, start: Vector, end: Vector) -> list[Points] | None:
    """Places of a free way between two others, without these; ``None`` where there is none."""
    if _is_free_line(planner, level, start, end):
        return []
    try:
        route = planner.find_route(level, start[:2], level, end[:2])
    except FloorError:
        return None
    if not route:
        return None
    places = [start[:2], *route.legs[0].points, end[:2]]
    kept, index = [], 0
    while index < len(places) - 1:
        # As far along the way as a straight line is free.
        ahead = next(
            (far for far in range(len(places) - 1, index + 1, -1)
             if _is_free_line(planner, level, places[index], places[far])),
            index + 1,
        )  # fmt: skip
        if not _is_clear_line(planner.graph.grids[level], places[index], places[ahead]):
            return None
        if ahead < len(places) - 1:
            kept.append(places[ahead])
        index = ahead
    return kept


def _line_cells(grid: OccupancyGrid, start: Vector, end: Vector) -> Points:
    """(N, 2) places along a line, two to a cell."""
    length = float(np.linalg.norm(end[:2] - start[:2]))
    shares = np.linspace(0.0, 1.0, int(2 * length / grid.resolution) + 2)[:, None]
    return np.asarray(start[:2] + shares * (end[:2] - start[:2]))


def _is_free_line(planner: FloorPlanner, level: int, start: Vector, end: Vector) -> bool:
    """Whether the robot can be everywhere on the line between two places."""
    grid, numbers = planner.graph.grids[level], planner.graph.nodes[level]
    index, inside = grid.cells_at(_line_cells(grid, start, end))
    return bool(inside.all() and (numbers[index[:, 0], index[:, 1]] >= 0).all())


def _is_clear_line(grid: OccupancyGrid, start: Vector, end: Vector) -> bool:
    """Whether ground was seen free all along the line, also nearer to obstacles than the robot is wide."""
    index, inside = grid.cells_at(_line_cells(grid, start, end))
    return bool(inside.all() and (grid.cells[index[:, 0], index[:, 1]] == FREE).all())
