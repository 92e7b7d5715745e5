"""Shortest ways over floors and stairs, and where to explore next.

Each floor is a grid of cells with eight neighbours; portals are edges between floors with the finite cost
of their stairs. Costs are seconds. ``scipy.sparse.csgraph`` does the search: it is a core dependency
already, and compiled; networkx takes seconds for 40,000 cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra

from stairmap.arrays import Float64Array, IntArray, Points, readonly
from stairmap.navigation.floors import FloorError
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.navigation.planning_graph import SNAP, make_planning_graph, nearest_node
from stairmap.navigation.portals import ANY_ROBOT, Portal
from stairmap.navigation.robot_profile import RobotProfile


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A part of a route: over one floor, or up or down one stairway.

    Attributes
    ----------
    kind
        ``floor``, ``up`` or ``down``.
    level
        Floor on which it begins.
    stairway_id
        The stairway; ``None`` on a floor.
    points
        (N, 2 or 3) way, m, map.
    cost
        Its cost, s.
    """

    kind: Literal["floor", "up", "down"]
    level: int
    stairway_id: int | None = None
    points: Points
    cost: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points))


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """The cheapest way between two places; false if there is none, and then ``reason`` says why.

    Attributes
    ----------
    legs
        Its parts, in order.
    cost
        Their sum, s; infinite without a way.
    reason
        Why there is none.
    """

    legs: tuple[Leg, ...] = ()
    cost: float = math.inf
    reason: str = ""

    def __bool__(self) -> bool:
        return bool(self.legs)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchResult:
    """What a search from one place gives: (N,) cost to each node, s, and the node before it."""

    start: int
    costs: Float64Array
    previous: IntArray


class FloorPlanner:
    """Plans over the floors of a building for one robot.

    Parameters
    ----------
    grids
        Occupancy of each floor by level; unknown cells are not entered.
    portals
        Stairways between them. Those that the robot cannot climb are not used.
    robot
        Its speed and width.
    allow_unknown
        Whether stairs with the verdict ``unknown`` are used.

    Raises
    ------
    FloorError
        If there is no grid.
    """

    def __init__(
        self,
        grids: Mapping[int, OccupancyGrid],
        portals: Sequence[Portal],
        robot: RobotProfile = ANY_ROBOT,
        *,
        allow_unknown: bool = False,
    ) -> None:
        if not grids:
            raise FloorError("there is no map of any floor to plan on")
        self.portals, self.robot, self.allow_unknown = tuple(portals), robot, allow_unknown
        self.graph = make_planning_graph(grids, portals, robot, allow_unknown=allow_unknown)

    def search(self, level: int, point: ArrayLike) -> SearchResult:
        """Return the cost to every place from a (2,) point of a floor.

        Raises
        ------
        FloorError
            If the floor has no map, or the robot cannot be there.
        """
        start = self._node(level, point, "the start")
        costs, previous = dijkstra(self.graph.edges, indices=np.array([start]), return_predecessors=True)
        return SearchResult(start=start, costs=costs[0], previous=previous[0].astype(np.int64))

    def find_route(self, start_level: int, start: ArrayLike, goal_level: int, goal: ArrayLike) -> Route:
        """Return the cheapest way between (2,) points of two floors.

        Raises
        ------
        FloorError
            If a floor has no map, or the robot cannot be at an end.
        """
        goal_node = self._node(goal_level, goal, "the goal")
        return self.route_to(self.search(start_level, start), goal_node)

    def route_to(self, found: SearchResult, node: int) -> Route:
        """Return the way from the start of a search to a node."""
        if not math.isfinite(found.costs[node]):
            reasons = "; ".join(self.graph.reasons) or "no free way was seen"
            return Route(reason=f"there is no way to floor {int(self.graph.places[node, 0])}: {reasons}")
        nodes = [node]
        while nodes[-1] != found.start:
            nodes.append(int(found.previous[nodes[-1]]))
        return Route(legs=self._legs(nodes[::-1], found.costs), cost=float(found.costs[node]))

    def _node(self, level: int, point: ArrayLike, name: str) -> int:
        if level not in self.graph.grids:
            known = ", ".join(str(known) for known in self.graph.grids)
            raise FloorError(f"{name} is on floor {level}, which has no map; maps are of floors {known}")
        node = nearest_node(self.graph.grids[level], self.graph.nodes[level], point)
        if node is None:
            x, y = np.asarray(point, dtype=np.float64)[:2]
            raise FloorError(
                f"{name} ({x:.2f}, {y:.2f}) on floor {level} is not within {SNAP} m of ground that is free "
                "and wide enough for the robot"
            )
        return node

    def _legs(self, nodes: list[int], costs: Float64Array) -> tuple[Leg, ...]:
        legs: list[Leg] = []
        begin = 0
        for index in range(1, len(nodes) + 1):
            stairs = self.graph.stairs.get((nodes[index - 1], nodes[index])) if index < len(nodes) else None
            if stairs is None and index < len(nodes):
                continue
            legs.append(self._floor_leg(nodes[begin:index], costs))
            if stairs is not None:
                portal, kind = stairs
                up = kind == "up"
                legs.append(
                    Leg(
                        kind=kind,
                        level=portal.lower_level if up else portal.upper_level,
                        stairway_id=portal.stairway_id,
                        points=portal.way if up else portal.way[::-1],
                        cost=portal.cost_up if up else portal.cost_down,
                    )
                )
                begin = index
        return tuple(legs)

    def _floor_leg(self, nodes: list[int], costs: Float64Array) -> Leg:
        places = self.graph.places[nodes]
        level = int(places[0, 0])
        return Leg(
            kind="floor",
            level=level,
            points=self.graph.grids[level].centers(places[:, 1], places[:, 2]),
            cost=float(costs[nodes[-1]] - costs[nodes[0]]),
        )
