"""Side elevations of a scene: what a planar scanner along a heading would see.

For a heading and up, a ray's slope is tau = z / s: height gained per metre
forward. All pixels of a stairway's step that have the same slope have the same
forward distance s, wherever they lie across the step. So the image is resampled to rows
of equal slope, and strips of columns are averaged: each strip becomes a scan in the
vertical plane along the heading, with a fraction of a pixel's noise and no roll or obliqueness
left. In inverse forward distance Q = 1/s a riser is constant and a tread is Q = tau / z.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, Points, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.geometry import cross

STRIP_WIDTH = 16
"""Columns of a strip, working pixels: wide enough to average noise, narrow against a stairway."""

COLUMN_STEP = 2
"""Every so many columns are sampled: eight of a strip's sixteen tell its median well enough."""

MIN_FORWARD = 0.15
"""Rays with a smaller forward component (more than 81 degrees off the heading) are not used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Elevation:
    """Scans of a frame in vertical planes along one heading; row 0 looks highest.

    Attributes
    ----------
    slope
        (rows,) float32 slope tau of each row, descending.
    inverse_distance
        (rows, strips) float32 inverse forward distance Q, 1/m, 0 where nothing was measured.
    lateral
        (rows, strips) float32 lateral position over forward distance, t / s, positive to the left.
    row_density
        Rows per unit of slope.
    edge_shift
        How many rows the reduced image moved the edges of near surfaces outward on average.
    """

    slope: Float32Array
    inverse_distance: Float32Array
    lateral: Float32Array
    row_density: float
    edge_shift: float = 0.0

    @property
    def valid(self) -> Mask:
        """(rows, strips) whether a cell was measured."""
        return np.asarray(self.inverse_distance > 0)


def make_elevation(image: InverseDepthImage, up: Vector, forward: Vector) -> Elevation | None:
    """Resample an image into side elevations along a heading.

    Parameters
    ----------
    image
        Inverse depth.
    up, forward
        (3,) perpendicular unit vectors, camera frame.

    Returns
    -------
    Elevation, or ``None`` when the image does not look along the heading at all.
    """
    camera = image.camera
    num_strips = camera.width // STRIP_WIDTH
    first = _first_column(camera.width)
    u = np.arange(first, first + num_strips * STRIP_WIDTH, COLUMN_STEP, dtype=np.float32)
    x = (u - np.float32(camera.cx)) / np.float32(camera.fx)
    y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)
    # The rows' slopes are those of the column that looks most nearly along the heading.
    along = forward[0] * x + forward[2]
    middle = x[int(np.argmax(along))] if along.max() > MIN_FORWARD else np.float32(0)
    middle = np.clip(middle, x[len(x) // 4], x[3 * len(x) // 4])
    ahead = forward[0] * middle + forward[1] * y + forward[2]
    above = up[0] * middle + up[1] * y + up[2]
    usable = ahead > MIN_FORWARD
    if np.count_nonzero(usable) < 20:
        return None
    slope = (above[usable] / ahead[usable]).astype(np.float32)[:, None]
    up32, forward32 = up.astype(np.float32), forward.astype(np.float32)
    ray_y = ((up32[0] * x + up32[2]) - slope * (forward32[0] * x + forward32[2])) / (
        slope * forward32[1] - up32[1]
    )
    ray_forward = forward32[0] * x + forward32[2] + forward32[1] * ray_y
    map_v = ray_y * np.float32(camera.fy) + np.float32(camera.cy)
    map_u = np.ascontiguousarray(np.broadcast_to(u, map_v.shape))
    remapped = cv2.remap(image.inverse_depth, map_u, map_v, cv2.INTER_NEAREST, borderValue=0)
    sampled: Float32Array = np.asarray(remapped, dtype=np.float32)
    sampled[ray_forward < MIN_FORWARD] = 0
    sampled /= np.maximum(ray_forward, np.float32(MIN_FORWARD))
    left = cross(up, forward).astype(np.float32)
    per_strip = STRIP_WIDTH // COLUMN_STEP
    centers = per_strip // 2 + per_strip * np.arange(num_strips)
    lateral = (left[0] * x[centers] + left[2] + left[1] * ray_y[:, centers]) / np.maximum(
        ray_forward[:, centers], np.float32(MIN_FORWARD)
    )
    cells = sampled.reshape(-1, num_strips, per_strip)
    density = len(slope) / max(float(slope[0, 0] - slope[-1, 0]), 1e-6)
    return Elevation(
        slope=slope[:, 0],
        inverse_distance=_average_cells(cells),
        lateral=lateral,
        row_density=density,
        # A block of pixels shows its nearest surface, however little of it is that.
        edge_shift=0.5 * (image.stride - 1) / image.stride,
    )


def strip_columns(width: int, strips: Mask, *, margin: int) -> tuple[int, int]:
    """Return the first column and one past the last of the given strips and ``margin`` more on each side."""
    chosen = np.flatnonzero(strips)
    offset = _first_column(width)
    first = offset + (int(chosen[0]) - margin) * STRIP_WIDTH
    last = offset + (int(chosen[-1]) + 1 + margin) * STRIP_WIDTH
    return max(first, 0), min(last, width)


def lateral_positions(elevation: Elevation, nosings: Float64Array) -> Points:
    """Turn (N, 3) nosings of s, z and strip into (N, 3) points s, z, t, m."""
    strip = nosings[:, 2].astype(np.int64)
    slope = (nosings[:, 1] / np.maximum(nosings[:, 0], 1e-6)).astype(np.float32)
    row = np.searchsorted(-elevation.slope, -slope).clip(0, len(elevation.slope) - 1)
    return np.stack([nosings[:, 0], nosings[:, 1], nosings[:, 0] * elevation.lateral[row, strip]], axis=1)


def _first_column(width: int) -> int:
    """Column where strip 0 begins: the strips are centred in the image."""
    return (width - width // STRIP_WIDTH * STRIP_WIDTH) // 2


def _average_cells(cells: Float32Array) -> Float32Array:
    """Mean of each cell's values near their median; 0 where fewer than half are valid."""
    ordered = np.sort(cells, axis=2)
    num = cells.shape[2]
    num_valid = np.count_nonzero(ordered, axis=2)
    middle = np.minimum(num - num_valid + num_valid // 2, num - 1)
    median = np.take_along_axis(ordered, middle[:, :, None], axis=2)
    near = (np.abs(ordered - median) < np.float32(0.04) * median).astype(np.float32)
    count = near.sum(axis=2)
    total = (ordered * near).sum(axis=2)
    enough = (num_valid * 2 >= num) & (count * 3 >= num)
    return np.where(enough, total / np.maximum(count, 1), np.float32(0)).astype(np.float32)
