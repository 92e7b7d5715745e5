"""A map of heights: one for each square of a level grid, as legged robots keep it of the ground around
them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, Points, Transform, readonly
from stairmap.transforms import transform_points

PLATE_STEP = 0.02
"""Points on a cell are at most this far apart, m."""

MIN_FACE = 0.04
"""Neighbours that differ by more in height, m, have an upright face between them."""

MAX_FACE = 3.0
"""A face is filled no higher than this, m; a wall's top tells nothing of steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HeightGrid:
    """Heights of the cells of a grid.

    Attributes
    ----------
    stamp_ns
        Stamp, nanoseconds.
    heights
        (num_x, num_y) float32 height of each cell, m, NaN where it is not known. Cell (i, j) is the square
        whose middle is at ((i + 0.5), (j + 0.5)) times the resolution.
    resolution
        Side of a cell, m.
    map_from_grid
        (4, 4) the grid's corner in the map; its z is the map's, so that heights are those of the map less its
        height.

    Raises
    ------
    ValueError
        If the heights are no grid or the resolution is not positive.
    """

    stamp_ns: int
    heights: Float32Array
    resolution: float
    map_from_grid: Transform

    def __post_init__(self) -> None:
        heights = readonly(self.heights, np.float32)
        if heights.ndim != 2 or not np.isfinite(self.resolution) or self.resolution <= 0:
            raise ValueError(
                f"expected a grid of heights and its resolution, got shape {heights.shape} and "
                f"{self.resolution} m"
            )
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "map_from_grid", readonly(self.map_from_grid))

    @property
    def map_from_middle(self) -> Transform:
        """(4, 4) the middle of the grid in the map, at its median height."""
        known = self.heights[np.isfinite(self.heights)]
        middle = np.eye(4)
        middle[:2, 3] = np.array(self.heights.shape) * self.resolution / 2
        middle[2, 3] = float(np.median(known)) if len(known) else 0.0
        return np.asarray(self.map_from_grid @ middle)

    def points(self) -> Points:
        """Return (N, 3) points on the cells and on the faces between them, map, m.

        A cell is a level plate, and where two neighbours differ by more than 40 mm an upright face stands
        between them: what a grid of heights says of a step is its tread and, to half a cell, where its riser
        is.
        """
        faces = [self._faces(axis) for axis in (0, 1)]
        return transform_points(self.map_from_grid, np.concatenate([self._plates(), *faces]))

    def _plates(self) -> Points:
        known = np.argwhere(np.isfinite(self.heights))
        per_side = max(int(np.ceil(self.resolution / PLATE_STEP)), 1)
        inside = (np.arange(per_side) + 0.5) / per_side
        offsets = np.stack(np.meshgrid(inside, inside, indexing="ij"), axis=-1).reshape(-1, 2)
        places = (known[:, None, :] + offsets) * self.resolution
        heights = self.heights[tuple(known.T)].astype(np.float64)
        return np.concatenate(
            [places, np.broadcast_to(heights[:, None, None], (*places.shape[:2], 1))], axis=2
        ).reshape(-1, 3)

    def _faces(self, axis: int) -> Points:
        """Points on the upright faces between neighbours along an axis."""
        heights = np.moveaxis(self.heights, axis, 0).astype(np.float64)
        low, high = np.minimum(heights[1:], heights[:-1]), np.maximum(heights[1:], heights[:-1])
        is_face: Mask = np.asarray((high - low > MIN_FACE) & (high - low < MAX_FACE))
        row, column = np.nonzero(is_face)
        bottom, size = low[is_face], (high - low)[is_face]
        count = np.ceil(size / PLATE_STEP).astype(np.int64)
        which = np.repeat(np.arange(len(row)), count)
        number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        z = bottom[which] + size[which] * (number + 0.5) / count[which]
        per_side = max(int(np.ceil(self.resolution / PLATE_STEP)), 1)
        parts: list[Float64Array] = []
        for inside in (np.arange(per_side) + 0.5) / per_side:
            across = (row[which] + 1.0) * self.resolution
            along = (column[which] + inside) * self.resolution
            parts.append(np.stack([across, along, z] if axis == 0 else [along, across, z], axis=1))
        return np.concatenate(parts)
