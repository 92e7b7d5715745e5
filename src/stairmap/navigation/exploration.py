"""Where to explore next: frontiers of the floors that are known, and stairs to floors that are not.

The report's behaviour follows from the costs: cheap frontiers of this floor come first, and the stairs,
whose cost is high but finite, when nothing cheaper is left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import IntArray, Mask, Vector, readonly
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.navigation.planning_graph import is_usable, nearest_node

MIN_FRONTIER = 0.4
"""Shortest border between free and unknown ground that is worth a visit, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A place to explore from.

    Attributes
    ----------
    kind
        ``frontier``: the border of unknown ground; ``stairs``: those to an unexplored floor.
    level
        Floor on which it lies.
    position
        (2,) where to go, m, map: a cell of the frontier, or the staging pose before the stairs.
    cost
        Cost to get there, and for stairs to climb them, s.
    size
        Length of a frontier, m; NaN for stairs.
    stairway_id
        The stairway; ``None`` for a frontier.
    """

    kind: Literal["frontier", "stairs"]
    level: int
    position: Vector
    cost: float
    size: float = math.nan
    stairway_id: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", readonly(self.position))

    def to_dict(self) -> dict[str, Any]:
        """Return the candidate as JSON types."""
        return {
            "kind": self.kind,
            "level": self.level,
            "position": self.position.tolist(),
            "cost": self.cost,
            "size": self.size,
            "stairway": self.stairway_id,
        }


def find_candidates(planner: FloorPlanner, level: int, point: ArrayLike) -> tuple[Candidate, ...]:
    """Return the places to explore from that can be reached, cheapest first.

    Stairs are candidates when they lead to a floor without a map, and the planner would use them: those
    with the verdict ``unknown`` only where it allows them.

    Parameters
    ----------
    planner
        Maps and stairs.
    level, point
        Floor and (2,) place of the robot.

    Raises
    ------
    FloorError
        If the floor has no map, or the robot cannot be there.
    """
    found = planner.search(level, point)
    candidates = []
    for floor_level, grid in planner.graph.grids.items():
        numbers = planner.graph.nodes[floor_level]
        for cells in find_frontiers(grid, numbers >= 0):
            costs = found.costs[numbers[cells[:, 0], cells[:, 1]]]
            best = int(np.argmin(costs))
            if math.isfinite(costs[best]):
                position = grid.centers(cells[best : best + 1, 0], cells[best : best + 1, 1])[0]
                candidates.append(
                    Candidate(
                        kind="frontier",
                        level=floor_level,
                        position=position,
                        cost=float(costs[best]),
                        size=len(cells) * grid.resolution,
                    )
                )
    for portal in planner.portals:
        if not is_usable(portal, allow_unknown=planner.allow_unknown):
            continue
        for near, far, pose, climb in (
            (portal.lower_level, portal.upper_level, portal.lower, portal.cost_up),
            (portal.upper_level, portal.lower_level, portal.upper, portal.cost_down),
        ):
            if not planner.robot.takes_stairs(up=near == portal.lower_level):
                continue
            if near not in planner.graph.grids or far in planner.graph.grids:
                continue
            node = nearest_node(planner.graph.grids[near], planner.graph.nodes[near], pose.position)
            if node is not None and math.isfinite(found.costs[node]):
                candidates.append(
                    Candidate(
                        kind="stairs",
                        level=near,
                        position=pose.position[:2],
                        cost=float(found.costs[node]) + climb,
                        stairway_id=portal.stairway_id,
                    )
                )
    return tuple(sorted(candidates, key=lambda candidate: candidate.cost))


def find_frontiers(grid: OccupancyGrid, is_open: Mask) -> list[IntArray]:
    """Return the (N, 2) rows and columns of each frontier: open cells near unknown ones.

    Parameters
    ----------
    grid
        Map of a floor.
    is_open
        (rows, columns) where the robot can be. It keeps clear of obstacles, not of unknown ground.
    """
    unknown = (grid.cells == UNKNOWN).astype(np.uint8)
    near = cv2.dilate(unknown, np.ones((3, 3), dtype=np.uint8)) > 0
    border = (is_open & near & (grid.cells == FREE)).astype(np.uint8)
    num_labels, labels = cv2.connectedComponents(border, connectivity=8)
    frontiers = [np.argwhere(labels == label) for label in range(1, num_labels)]
    return [cells for cells in frontiers if len(cells) * grid.resolution >= MIN_FRONTIER]
