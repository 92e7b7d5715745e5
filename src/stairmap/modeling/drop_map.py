"""Model drops over frames: cells of the map keep where edges were seen, and whether ground was seen there.

An edge is told by frames that agree on it. A frame that sees the ground go on across the edge speaks against
it, so what was a shadow, a mirror or a place that was filled is withdrawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from stairmap.arrays import Float64Array, IntArray, Points
from stairmap.detection.observation import Detection
from stairmap.drop import Drop
from stairmap.modeling.drop_cells import DropCells
from stairmap.modeling.ground_table import GroundTable
from stairmap.trajectory import Trajectory

SAME_MAP = 1e-9
"""Poses that differ by no more are the same, m and as numbers of a rotation."""

MAX_HEIGHT_ERROR = 0.08
"""The ground before an edge lies as far below the camera as the ground it moves on, to this, m."""

LINK = 0.25
"""Cells of one edge are no farther apart, m: bearings that showed nothing in between, drift."""

MIN_AGREEMENT = 0.8
"""Cosine of the largest angle between the directions in which neighbouring cells fall off."""

LINE_TOLERANCE = 0.10
"""An edge that is straight within this, m, is one drop: the size of a cell, and drift."""

MIN_BENT_CELLS = 4
"""Fewer cells are not split."""

MIN_LENGTH = 0.20
"""Shortest drop that is told, m."""

MAX_MATCH = 0.5
"""A drop keeps the number of one whose middle was no farther away, m."""


class DropMap:
    """Collects what frames tell of the ground, and answers where it ends.

    Parameters
    ----------
    min_observations
        Frames that must agree on an edge.
    camera_height
        Height of the camera above the ground, m; ``None``: as most frames tell.
    table
        What is known from the start; nothing if not given.

    Attributes
    ----------
    table
        What frames saw of the ground.
    """

    def __init__(
        self, *, min_observations: int, camera_height: float | None = None, table: GroundTable | None = None
    ) -> None:
        self._min_observations, self._known_height = min_observations, camera_height
        self.table = GroundTable() if table is None else table
        self._cells = DropCells()
        self._placed: Float64Array = np.zeros((0, 4, 4))
        self._num_placed_edges = 0
        self._answered: tuple[Drop, ...] = ()
        self._next_id = 1

    @property
    def camera_height(self) -> float | None:
        """Height of the camera above the ground that it moves on, m; ``None`` where not known."""
        return self._known_height or self.table.camera_height()

    def add(self, detection: Detection) -> None:
        """Take in what one frame saw of the ground."""
        if detection.ground is not None:
            self.table.add(detection.stamp_ns, detection.ground, (*detection.drops, *detection.voids))

    def drops(self, trajectory: Trajectory) -> tuple[Drop, ...]:
        """Return the drops as a trajectory places them, by id.

        Frames that it has no pose for are left out.
        """
        self._place(trajectory)
        height = self.camera_height
        pieces: list[IntArray] = []
        cells = self._cells
        # A camera whose height is not the same in most frames is carried about: nobody knows on what ground.
        if height is not None:
            chosen = cells.confirmed(self._min_observations)
            chosen = chosen[np.abs(cells.camera_height[chosen] - height) < MAX_HEIGHT_ERROR]
            groups = [chosen[group] for group in group_cells(cells.place[chosen], cells.outward[chosen])]
            pieces = [group[piece] for group in groups for piece in split_straight(cells.place[group])]
        found = [self._drop(piece) for piece in pieces]
        self._answered = self._numbered([drop for drop in found if drop.length >= MIN_LENGTH])
        return self._answered

    def _drop(self, piece: IntArray) -> Drop:
        cells = self._cells
        depth = cells.depth[piece][np.isfinite(cells.depth[piece])]
        return Drop(
            id=0,
            edge=_edge_of(cells.place[piece], cells.outward[piece]),
            depth=float(np.median(depth)) if len(depth) else None,
            num_observations=int(cells.num_seen[piece].max()),
            first_seen_ns=int(cells.first_seen_ns[piece].min()),
            last_seen_ns=int(cells.last_seen_ns[piece].max()),
        )

    def _place(self, trajectory: Trajectory) -> None:
        """Put the frames that came since, or all if poses were moved, into cells."""
        stamps = self.table.views["stamp_ns"]
        placed = trajectory.has_pose(stamps) if len(stamps) else np.zeros(0, dtype=np.bool_)
        poses = np.full((len(stamps), 4, 4), np.nan)
        if placed.any():
            poses[placed] = trajectory.poses_at(stamps[placed])
        known = len(self._placed)
        if not np.allclose(poses[:known], self._placed, rtol=0, atol=SAME_MAP, equal_nan=True):
            self._cells = DropCells()
            known = self._num_placed_edges = 0
        edges = self.table.edges
        for number in range(known, len(poses)):
            view, pose = self.table.views[number], poses[number]
            begin = end = self._num_placed_edges
            while end < len(edges) and edges["stamp_ns"][end] == view["stamp_ns"]:
                end += 1
            self._num_placed_edges = end
            if not np.isnan(pose[0, 0]):
                self._cells.add(view, edges[begin:end], pose)
        self._placed = poses

    def _numbered(self, drops: Sequence[Drop]) -> tuple[Drop, ...]:
        """Give drops the numbers that they had in the last answer, and new ones to others."""
        left = list(self._answered)
        numbered = []
        for drop in sorted(drops, key=lambda drop: (drop.first_seen_ns, *drop.edge[0].tolist())):
            near = [
                known
                for known in left
                if np.linalg.norm(known.center - drop.center) < MAX_MATCH
                and known.outward @ drop.outward > MIN_AGREEMENT
            ]
            if near:
                known = min(near, key=lambda known: float(np.linalg.norm(known.center - drop.center)))
                left.remove(known)
                numbered.append(replace(drop, id=known.id))
            else:
                numbered.append(replace(drop, id=self._next_id))
                self._next_id += 1
        return tuple(sorted(numbered, key=lambda drop: drop.id))


def group_cells(place: Points, outward: Points) -> list[IntArray]:
    """Group (N, 3) places of cells that are neighbours along one edge.

    ``outward`` are the (N, 3) level unit vectors in which the ground falls off there.
    """
    if not len(place):
        return []
    pairs = cKDTree(place).query_pairs(LINK, output_type="ndarray")
    agree = np.einsum("ij,ij->i", outward[pairs[:, 0]], outward[pairs[:, 1]]) > MIN_AGREEMENT
    first, second = pairs[agree].T
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(len(place), len(place)))
    num, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == index) for index in range(num)]


def split_straight(place: Points) -> list[IntArray]:
    """Split (N, 3) places of one edge into straight pieces: at the farthest bend first."""
    pieces, rest = [], [np.arange(len(place))]
    while rest:
        part = rest.pop()
        _, axis = fit_plan_line(place[part])
        order = part[np.argsort(place[part, :2] @ axis)]
        chord = place[order[-1], :2] - place[order[0], :2]
        offset = place[order, :2] - place[order[0], :2]
        off = np.abs(offset[:, 0] * chord[1] - offset[:, 1] * chord[0]) / max(float(np.hypot(*chord)), 1e-9)
        bend = int(np.argmax(off))
        if off[bend] <= LINE_TOLERANCE or len(part) < MIN_BENT_CELLS:
            pieces.append(order)
        else:
            rest += [order[: bend + 1], order[bend + 1 :]]
    return pieces


def fit_plan_line(place: Points) -> tuple[Float64Array, Float64Array]:
    """(2,) middle and (2,) direction of the line through (N, 3) places in plan."""
    middle = place[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(place[:, :2] - middle, full_matrices=False)
    return middle, axes[0]


def _edge_of(place: Points, outward: Points) -> Points:
    """(2, 3) ends of the edge through places; its left end first as seen from the ground."""
    middle, axis = fit_plan_line(place)
    fall = outward.sum(axis=0)
    if axis @ [fall[1], -fall[0]] < 0:
        axis = -axis
    along = (place[:, :2] - middle) @ axis
    height = float(np.median(place[:, 2]))
    return np.array([[*(middle + value * axis), height] for value in (along.min(), along.max())])
