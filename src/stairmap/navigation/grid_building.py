"""Occupancy grids of floors from the depth frames of a run.

A cell is free where the floor itself was seen, or where the robot was; occupied where something stands
on the floor up to the robot's height, or where a point lies below the floor: a hole or stairs that lead down.
"""

from __future__ import annotations

import cv2
import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform
from stairmap.frame import DepthFrame
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, MapError, OccupancyGrid
from stairmap.transforms import transform_points

_STRIDE = 4
_MAX_RANGE = 4.0
_FLOOR_BAND = 0.07
"""Points this near to a floor's height are floor, m: noise and drift at the largest range."""

_STEP_HEIGHT = 0.11
"""Lowest thing that counts as an obstacle, m."""

_ROBOT_HEIGHT = 1.2
_HOLE_DEPTH = 0.15
_OWN_RADIUS = 0.25
"""The floor this near to the camera is free, m: the robot stood on it."""

_MIN_HITS = 2
_MIN_SHARE = 0.3
_CLOSING_CELLS = 5
"""Gaps between rows of pixels on the floor are closed up to so many cells."""

_BORDER_CELLS = _CLOSING_CELLS // 2 + 1
"""Unknown cells around all that was seen: closing would fill a narrower border up to the edge of the map."""

_KEY_BASE = 1 << 20


class GridBuilder:
    """Collects what depth frames show of each floor.

    Parameters
    ----------
    floors
        The floors; frames taken on none of them, such as on stairs, are passed over.
    resolution
        Size of a cell, m.
    """

    def __init__(self, floors: FloorStack, *, resolution: float = 0.05) -> None:
        self._floors, self._resolution = floors, resolution
        self._votes: dict[int, list[tuple[IntArray, IntArray]]] = {}

    def add(self, frame: DepthFrame, map_from_camera: Transform) -> None:
        """Take in one frame; its pose tells on which floor the robot was."""
        foot = float(map_from_camera[2, 3]) - self._floors.camera_height
        floor = min(self._floors.floors, key=lambda floor: abs(floor.height - foot))
        if abs(floor.height - foot) > 0.3:
            return
        camera = frame.camera.strided(_STRIDE)
        points = camera.unproject(frame.depth[::_STRIDE, ::_STRIDE])
        valid = np.isfinite(points[..., 2]) & (points[..., 2] <= _MAX_RANGE)
        mapped = transform_points(map_from_camera, points[valid])
        height = mapped[:, 2] - floor.height
        kind = np.full(len(mapped), -1, dtype=np.int64)
        kind[np.abs(height) < _FLOOR_BAND] = 0
        kind[((height > _STEP_HEIGHT) & (height < _ROBOT_HEIGHT)) | (height < -_HOLE_DEPTH)] = 1
        own = self._own_cells(map_from_camera[:2, 3])
        keys = np.concatenate([self._keys(mapped[kind >= 0]), own])
        kinds = np.concatenate([kind[kind >= 0], np.zeros(len(own), dtype=np.int64)])
        # One frame has one vote a cell and kind, however many pixels saw it.
        unique = np.unique(keys * 2 + kinds)
        self._votes.setdefault(floor.level, []).append((unique // 2, unique % 2))

    def grids(self) -> dict[int, OccupancyGrid]:
        """Return the grid of each floor that was seen, by level.

        Raises
        ------
        MapError
            If no frame showed any floor.
        """
        if not self._votes:
            raise MapError("no frame was taken on a floor, so there is no map to plan on")
        return {level: self._grid(votes) for level, votes in sorted(self._votes.items())}

    def _keys(self, points: Points) -> IntArray:
        cells = np.floor(points[:, :2] / self._resolution).astype(np.int64) + _KEY_BASE // 2
        return np.asarray(cells[:, 1] * _KEY_BASE + cells[:, 0])

    def _own_cells(self, position: Float64Array) -> IntArray:
        steps = np.arange(-_OWN_RADIUS, _OWN_RADIUS + 1e-9, self._resolution)
        offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        offsets = offsets[np.linalg.norm(offsets, axis=1) <= _OWN_RADIUS]
        return self._keys(offsets + position)

    def _grid(self, votes: list[tuple[IntArray, IntArray]]) -> OccupancyGrid:
        keys = np.concatenate([vote[0] for vote in votes])
        kinds = np.concatenate([vote[1] for vote in votes])
        rows, columns = keys // _KEY_BASE, keys % _KEY_BASE
        low = np.array([rows.min(), columns.min()]) - _BORDER_CELLS
        high = np.array([rows.max(), columns.max()]) + _BORDER_CELLS
        shape = (int(high[0] - low[0]) + 1, int(high[1] - low[1]) + 1)
        flat = (rows - low[0]) * shape[1] + columns - low[1]
        size = shape[0] * shape[1]
        floor_hits = np.bincount(flat[kinds == 0], minlength=size).reshape(shape)
        hits = np.bincount(flat[kinds == 1], minlength=size).reshape(shape)
        is_occupied = (hits >= _MIN_HITS) & (hits > _MIN_SHARE * floor_hits)
        is_free = _close_gaps(floor_hits > 0) & ~is_occupied
        cells = np.full(shape, UNKNOWN, dtype=np.int8)
        cells[is_free] = FREE
        cells[is_occupied] = OCCUPIED
        origin = (low - _KEY_BASE // 2) * self._resolution
        return OccupancyGrid(
            cells=cells, resolution=self._resolution, origin=(float(origin[1]), float(origin[0]))
        )


def _close_gaps(mask: Mask) -> Mask:
    kernel = np.ones((_CLOSING_CELLS, _CLOSING_CELLS), dtype=np.uint8)
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, kernel) > 0)
