"""The cells of all floors and the stairs between them as one graph of costs in seconds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.navigation.occupancy import FREE, OCCUPIED, OccupancyGrid
from stairmap.navigation.portals import Portal, StagingPose
from stairmap.navigation.robot_profile import RobotProfile

SNAP = 0.5
"""A staging pose or end of a route stands for the nearest free cell within this distance, m."""

_DEFAULT_RADIUS = 0.25
"""Radius that is kept from obstacles for a robot of unknown width, m."""

StairEdges: TypeAlias = dict[tuple[int, int], tuple[Portal, Literal["up", "down"]]]
"""Portal and direction by (from node, to node)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningGraph:
    """Cells and portals as a graph: node numbers of each floor, and (level, row, column) of each node.

    Attributes
    ----------
    grids
        Occupancy by level.
    nodes
        (rows, columns) number of each cell by level, -1 where the robot cannot be.
    places
        (N, 3) level, row and column of each node.
    edges
        (N, N) costs, s.
    stairs
        Portal and direction by (from node, to node).
    reasons
        Why portals are not used, one sentence each.
    """

    grids: Mapping[int, OccupancyGrid]
    nodes: Mapping[int, IntArray]
    places: IntArray
    edges: csr_matrix[np.float64]
    stairs: StairEdges
    reasons: tuple[str, ...] = field(default=())


def make_planning_graph(
    grids: Mapping[int, OccupancyGrid], portals: Sequence[Portal], robot: RobotProfile, *, allow_unknown: bool
) -> PlanningGraph:
    """Return the graph of all cells that a robot can be on, and of the portals that it can use."""
    width = robot.min_width
    radius = _DEFAULT_RADIUS if width is None else width / 2
    nodes: dict[int, IntArray] = {}
    places, rows, columns, costs = [], [], [], []
    count = 0
    for level, grid in sorted(grids.items()):
        open_cells = _open_cells(grid, radius)
        numbers = np.full(grid.cells.shape, -1, dtype=np.int64)
        numbers[open_cells] = count + np.arange(np.count_nonzero(open_cells))
        count += int(np.count_nonzero(open_cells))
        nodes[level] = numbers
        place = np.argwhere(open_cells)
        places.append(np.column_stack([np.full(len(place), level), place]))
        for source, target, length in _neighbours(numbers):
            rows += [source, target]
            columns += [target, source]
            costs += [np.full(2 * len(source), length * grid.resolution / robot.floor_speed)]
    stairs, reasons = _stair_edges(grids, nodes, portals, robot, allow_unknown=allow_unknown)
    for (source_node, target_node), (portal, kind) in stairs.items():
        rows.append(np.array([source_node]))
        columns.append(np.array([target_node]))
        costs.append(np.array([portal.cost_up if kind == "up" else portal.cost_down]))
    edges = csr_matrix(
        (np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count)
    )
    return PlanningGraph(
        grids=dict(grids),
        nodes=nodes,
        places=np.concatenate(places),
        edges=edges,
        stairs=stairs,
        reasons=reasons,
    )


def is_usable(portal: Portal, *, allow_unknown: bool) -> bool:
    """Whether a robot may use a stairway: never an impassable one, an unknown one if that is allowed."""
    return portal.verdict == "passable" or (portal.verdict == "unknown" and allow_unknown)


def nearest_node(grid: OccupancyGrid, numbers: IntArray, point: ArrayLike) -> int | None:
    """Return the node nearest to a (2 or 3,) point, at most 0.5 m away; ``None`` if there is none.

    Between both stands no obstacle, but for one that the point itself lies in: no robot gets through walls.
    """
    (index,), _ = grid.cells_at(point)
    reach = math.ceil(SNAP / grid.resolution)
    low = np.clip(index - reach, 0, None)
    window = numbers[low[0] : max(index[0] + reach + 1, 0), low[1] : max(index[1] + reach + 1, 0)]
    found = np.argwhere(window >= 0)
    if not len(found):
        return None
    cells = found + low
    place, centers = (
        np.asarray(point, dtype=np.float64).reshape(-1)[:2],
        grid.centers(cells[:, 0], cells[:, 1]),
    )
    distances = np.linalg.norm(centers - place, axis=1)
    for best in np.argsort(distances, kind="stable"):
        if distances[best] > SNAP + grid.resolution:
            break
        if _leads_out(grid, place, centers[best]):
            return int(window[tuple(found[best])])
    return None


def _leads_out(grid: OccupancyGrid, place: Float64Array, center: Float64Array) -> bool:
    """Whether a straight line from a place to a free cell meets no obstacle once it has left its own."""
    shares = np.linspace(0.0, 1.0, 2 * math.ceil(SNAP / grid.resolution) + 3)[:, None]
    index, inside = grid.cells_at(place + shares * (center - place))
    index = index[inside]
    is_occupied = grid.cells[index[:, 0], index[:, 1]] == OCCUPIED
    return not is_occupied[np.argmin(is_occupied) :].any()


def _open_cells(grid: OccupancyGrid, radius: float) -> Mask:
    """Cells that are free and farther from all obstacles than the robot's radius."""
    passable = (grid.cells != OCCUPIED).astype(np.uint8)
    if passable.all():
        return np.asarray(grid.cells == FREE)
    distance = cv2.distanceTransform(passable, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * grid.resolution
    return np.asarray((grid.cells == FREE) & (distance > radius))


def _neighbours(numbers: IntArray) -> list[tuple[IntArray, IntArray, float]]:
    """Pairs of neighbouring nodes in four directions, and how many cells they are apart."""
    shifts = (
        (numbers[:, :-1], numbers[:, 1:], 1.0),
        (numbers[:-1], numbers[1:], 1.0),
        (numbers[:-1, :-1], numbers[1:, 1:], math.sqrt(2)),
        (numbers[:-1, 1:], numbers[1:, :-1], math.sqrt(2)),
    )
    pairs = []
    for first, second, length in shifts:
        both = (first >= 0) & (second >= 0)
        pairs.append((first[both], second[both], length))
    return pairs


def _stair_edges(
    grids: Mapping[int, OccupancyGrid],
    nodes: Mapping[int, IntArray],
    portals: Sequence[Portal],
    robot: RobotProfile,
    *,
    allow_unknown: bool,
) -> tuple[StairEdges, tuple[str, ...]]:
    stairs: StairEdges = {}
    reasons = []
    for portal in portals:
        name = f"stairway {portal.stairway_id} (floor {portal.lower_level} to {portal.upper_level})"
        if not is_usable(portal, allow_unknown=allow_unknown):
            check = portal.assessment.limiting
            reasons.append(f"{name} is {portal.verdict} for {portal.assessment.robot}: {check.limit.measure}")
            continue
        ends: list[int] = []
        for level, pose in ((portal.lower_level, portal.lower), (portal.upper_level, portal.upper)):
            node = _staging_node(grids, nodes, level, pose)
            if isinstance(node, str):
                reasons.append(f"{name} {node}")
            else:
                ends.append(node)
        if len(ends) == 2:
            if robot.takes_stairs(up=True):
                stairs[ends[0], ends[1]] = (portal, "up")
            if robot.takes_stairs(up=False):
                stairs[ends[1], ends[0]] = (portal, "down")
            if robot.stair_directions != "both":
                reasons.append(f"{name} is used {robot.stair_directions} only: so does {robot.name}")
    return stairs, tuple(reasons)


def _staging_node(
    grids: Mapping[int, OccupancyGrid], nodes: Mapping[int, IntArray], level: int, pose: StagingPose
) -> int | str:
    """Node of a staging pose, or what is wrong with it."""
    if level not in grids:
        return f"ends on floor {level}, which has no map"
    node = nearest_node(grids[level], nodes[level], pose.position)
    return f"ends where the robot cannot be on floor {level}" if node is None else node
