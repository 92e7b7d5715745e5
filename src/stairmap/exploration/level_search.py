"""A level as a planner sees it from one place: what it costs to get anywhere, and the ways there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points
from stairmap.navigation.occupancy import FREE, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner, SearchResult
from stairmap.navigation.planning_graph import nearest_node


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelSearch:
    """A level as a planner sees it from where the robot is.

    Attributes
    ----------
    level
        Its number.
    grid
        Its map.
    open_ground
        Where the robot's middle can be.
    opaque
        (rows, columns) of the map, what hides things behind it.
    planner, found
        The planner of this level and its search from the robot's place.
    """

    level: int
    grid: OccupancyGrid
    open_ground: OccupancyGrid
    opaque: Mask
    planner: FloorPlanner
    found: SearchResult

    @property
    def costs(self) -> Float64Array:
        """Cost to each cell of the open ground, s; infinite where there is no way."""
        numbers = self.planner.graph.nodes[self.level]
        costs = np.full(numbers.shape, np.inf)
        costs[numbers >= 0] = self.found.costs[numbers[numbers >= 0]]
        return costs

    def way_to(self, place: Float64Array) -> Points | None:
        """Return the (N, 2) way to a place on open ground, m; ``None`` without one."""
        node = nearest_node(self.open_ground, self.planner.graph.nodes[self.level], place)
        if node is None:
            return None
        route = self.planner.route_to(self.found, node)
        return shortened(route.legs[0].points[:, :2], self.open_ground) if route else None


def shortened(points: Points, open_ground: OccupancyGrid) -> Points:
    """Leave out points of a way between which a straight line stays on open ground."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        ahead = len(points) - 1
        while ahead > kept[-1] + 1 and not _is_line_open(points[kept[-1]], points[ahead], open_ground):
            # Halving finds a far one quickly; the way is made again every few metres anyhow.
            ahead = kept[-1] + 1 + (ahead - kept[-1] - 1) // 2
        kept.append(ahead)
    return points[kept]


def _is_line_open(start: Float64Array, end: Float64Array, open_ground: OccupancyGrid) -> bool:
    length = math.dist(start, end)
    num = max(math.ceil(2 * length / open_ground.resolution), 1)
    line = start + np.linspace(0.0, 1.0, num + 1)[:, None] * (end - start)
    index, inside = open_ground.cells_at(line)
    if not inside.all():
        return False
    return bool((open_ground.cells[index[:, 0], index[:, 1]] == FREE).all())
