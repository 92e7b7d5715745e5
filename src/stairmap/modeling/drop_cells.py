"""Cells of the map in which edges of the ground were seen, and what frames said for and against them."""

from __future__ import annotations

import itertools

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Transform
from stairmap.modeling.ground_table import sees_ground
from stairmap.modeling.observation_table import with_room
from stairmap.transforms import transform_points

CELL_SIZE = 0.10
"""Radius of a cell in plan, m: how well one frame places an edge."""

CELL_HEIGHT = 0.30
"""Half the height of a cell, m: less than between two floors, more than poses err from frame to frame."""

SAMPLE_STEP = 0.04
"""Distance of the places that an edge is sampled at, m."""

MAX_SCORE, MIN_SCORE = 12, -6
"""A frame that shows an edge counts one, one that sees ground across it minus one, between these: however
often an edge was seen, ten frames that look at ground there withdraw it."""

MIN_DISTANCE = 0.3
"""Edges that are nearer are placed no better, m."""

MIN_APPROACH = 0.3
"""An edge with nothing measured behind it must be seen from distances that differ by this much, m: where a
sensor sees no farther, ground seems to end as well, but always as far from the robot."""

ACROSS = (0.20, 0.35)
"""Distances beyond an edge at which a frame must see ground to speak against it, m."""

CELL_FIELDS = np.dtype(
    [
        ("score", np.int64),
        ("num_seen", np.int64),
        ("weight", np.float64),
        ("place", np.float64, 3),
        ("outward", np.float64, 3),
        ("camera_height", np.float64),
        ("depth", np.float64),
        ("distance", np.float64, 2),
        ("first_seen_ns", np.int64),
        ("last_seen_ns", np.int64),
    ]
)


class DropCells:
    """Cells in an array that grows by doubling."""

    def __init__(self) -> None:
        self._cells = np.zeros(64, dtype=CELL_FIELDS)
        self._index: dict[tuple[int, int, int], list[int]] = {}
        self._num = 0

    def __len__(self) -> int:
        return self._num

    @property
    def num_seen(self) -> IntArray:
        """(N,) in how many frames each cell's edge was seen."""
        return np.asarray(self._cells["num_seen"][: len(self)])

    @property
    def place(self) -> Points:
        """(N, 3) mean place of the edge in each cell, m, map; near frames count most."""
        return np.asarray(self._cells["place"][: len(self)] / self._cells["weight"][: len(self), None])

    @property
    def outward(self) -> Points:
        """(N, 3) level unit vector in which the ground falls off, map."""
        total = self._cells["outward"][: len(self)]
        return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-9))

    @property
    def camera_height(self) -> Float64Array:
        """(N,) mean height of the cameras above the edge, m."""
        return np.asarray(self._cells["camera_height"][: len(self)] / np.maximum(self.num_seen, 1))

    @property
    def depth(self) -> Float64Array:
        """(N,) depth below the edge that the nearest frame saw, m; NaN where none saw anything there."""
        return np.asarray(self._cells["depth"][: len(self)])

    @property
    def first_seen_ns(self) -> IntArray:
        """(N,) stamp of the first frame, nanoseconds."""
        return np.asarray(self._cells["first_seen_ns"][: len(self)])

    @property
    def last_seen_ns(self) -> IntArray:
        """(N,) stamp of the last frame, nanoseconds."""
        return np.asarray(self._cells["last_seen_ns"][: len(self)])

    def confirmed(self, min_score: int) -> IntArray:
        """Return the indices of cells for which this many more frames speak than against them.

        Where nothing was ever measured behind the edge, they must come from different distances.
        """
        cells = self._cells[: len(self)]
        nearest, farthest = cells["distance"].T
        is_sure = np.isfinite(cells["depth"]) | (farthest - nearest >= MIN_APPROACH)
        return np.flatnonzero((cells["score"] >= min_score) & is_sure)

    def add(
        self, view: np.void, edges: np.ndarray[tuple[int], np.dtype[np.void]], map_from_camera: Transform
    ) -> None:
        """Take in what one frame at a (4, 4) pose saw: its view of the ground, and its edges."""
        self._speak_against(view, map_from_camera)
        shown: set[int] = set()
        for edge in edges:
            ends = transform_points(map_from_camera, edge["edge"])
            along = ends[1] - ends[0]
            length = float(np.hypot(along[0], along[1]))
            if length < SAMPLE_STEP:
                continue
            outward = np.array([-along[1], along[0], 0.0]) / length
            shares = np.linspace(0.0, 1.0, int(length / SAMPLE_STEP) + 2)
            places = ends[0] + shares[:, None] * along
            for place in places:
                index = self._cell_at(place)
                if index not in shown:
                    shown.add(index)
                    self._speak_for(index, place, outward, view, edge)

    def _cell_at(self, place: Points) -> int:
        """Index of the cell of a place: the nearest whose edge is so near, or a new one.

        A cell is where its edge is, so no border of a grid parts what frames saw of one place.
        """
        x, y, z = (int(value) for value in np.floor(place / [CELL_SIZE, CELL_SIZE, CELL_HEIGHT]))
        best, nearest = -1, CELL_SIZE
        for key in itertools.product((x - 1, x, x + 1), (y - 1, y, y + 1), (z - 1, z, z + 1)):
            for index in self._index.get(key, ()):
                cell = self._cells[index]
                apart = cell["place"] / cell["weight"] - place
                distance = float(np.hypot(apart[0], apart[1]))
                if distance < nearest and abs(apart[2]) < CELL_HEIGHT:
                    best, nearest = index, distance
        if best < 0:
            best = self._num
            self._cells = with_room(self._cells, best + 1)
            self._index.setdefault((x, y, z), []).append(best)
            self._num += 1
        return best

    def _speak_for(self, index: int, place: Points, outward: Points, view: np.void, edge: np.void) -> None:
        cell = self._cells[index]
        if not cell["num_seen"]:
            cell["first_seen_ns"], cell["distance"], cell["depth"] = view["stamp_ns"], (np.inf, 0.0), np.nan
        cell["score"] = min(cell["score"] + 1, MAX_SCORE)
        cell["num_seen"] += 1
        # Of an edge twice as far, the same error of a pixel is four times as large.
        weight = max(float(edge["distance"]), MIN_DISTANCE) ** -4
        cell["weight"] += weight
        cell["place"] += weight * place
        cell["outward"] += outward
        cell["camera_height"] += view["height"]
        cell["last_seen_ns"] = view["stamp_ns"]
        nearest, farthest = cell["distance"]
        if np.isnan(cell["depth"]) or (edge["distance"] <= nearest and not np.isnan(edge["depth"])):
            cell["depth"] = edge["depth"]
        cell["distance"] = min(nearest, edge["distance"]), max(farthest, edge["distance"])

    def _speak_against(self, view: np.void, map_from_camera: Transform) -> None:
        if not len(self):
            return
        place, outward = self.place, self.outward
        is_crossed = np.ones(len(self), dtype=np.bool_)
        for distance in ACROSS:
            is_crossed &= sees_ground(view, map_from_camera, place + distance * outward)
        score = self._cells["score"][: len(self)]
        score[is_crossed] = np.maximum(score[is_crossed] - 1, MIN_SCORE)
