"""Find what could be stood on: the upper ends of the runs of points in narrow columns, with free air above.

A cloud is cut into columns. Along each, points that follow one another closely are one run: a tread, a riser
with the tread on it, a table's top, a wall. Undersides and ceilings have no free air above them, or are large
and level: neither is taken for a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray

MAX_GAP = 0.08
"""Points of one column farther apart than this upward, m, are of two runs: less than the lowest rise."""

HEADROOM = 0.5
"""Free height above a step, m. Handrails and tables are higher, the slabs of a shelf are not."""

MAX_THICKNESS = 0.40
"""Tallest run that a step and its riser make, m; what is taller is a wall."""

TOP_DEPTH = 0.03
"""The height of a run's upper end is the mean of the points within this of its highest, m, or more where
noise is larger."""

MAX_SIDE = 1 << 20
"""Most columns along one side of a cloud: 50 km."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """Points sorted into columns, and the runs in them.

    Attributes
    ----------
    cell
        Side of a column, m.
    low
        (2,) x and y of the corner of column (0, 0), m.
    points
        (N, 3) points, by column and then upward, m.
    key
        (N,) column of each point: ``ix * num_y + iy``.
    num_y
        Number of columns along y.
    """

    cell: float
    low: Float64Array
    points: Float32Array
    key: IntArray
    num_y: int

    def within(self, center: Float64Array, radius: float) -> Float32Array:
        """Return the (M, 3) points whose column lies in a square about a (2,) place, m."""
        first, last = (
            np.floor((center + sign * radius - self.low) / self.cell).astype(np.int64) for sign in (-1, 1)
        )
        rows = np.arange(max(first[0], 0), last[0] + 1)
        begin = np.searchsorted(self.key, rows * self.num_y + max(first[1], 0))
        end = np.searchsorted(self.key, rows * self.num_y + min(last[1], self.num_y - 1), side="right")
        parts = [self.points[low:high] for low, high in zip(begin, end, strict=True) if high > low]
        return np.concatenate(parts) if parts else np.zeros((0, 3), dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tops:
    """Upper ends of runs with free air above, sorted by column.

    Attributes
    ----------
    key
        (M,) column of each.
    place
        (M, 2) mean x and y of the column's points at the top, m.
    height
        (M,) its z, m.
    thickness
        (M,) how far its run reaches down, m.
    spread
        (M,) standard deviation of the heights that made it, m.
    """

    key: IntArray
    place: Float64Array
    height: Float64Array
    thickness: Float64Array
    spread: Float64Array

    def __len__(self) -> int:
        return len(self.key)

    def chosen(self, which: IntArray) -> Tops:
        """Return some of them."""
        return Tops(
            key=self.key[which],
            place=self.place[which],
            height=self.height[which],
            thickness=self.thickness[which],
            spread=self.spread[which],
        )


def sort_into_columns(points: Float32Array, cell: float) -> Columns:
    """Sort (N, 3) points, z up, into columns of a side, m."""
    low = points[:, :2].min(axis=0).astype(np.float64) if len(points) else np.zeros(2)
    index = ((points[:, :2] - low.astype(np.float32)) * np.float32(1.0 / cell)).astype(np.int64)
    np.clip(index, 0, MAX_SIDE - 1, out=index)
    num_y = int(index[:, 1].max()) + 1 if len(points) else 1
    key = index[:, 0] * num_y + index[:, 1]
    # One sort of whole numbers: the column, then the height in tenths of a millimetre.
    bottom = points[:, 2].min() if len(points) else np.float32(0)
    height = ((points[:, 2] - bottom) * np.float32(1e4)).astype(np.int64)
    span = int(height.max()) + 1 if len(points) else 1
    order = np.argsort(key * span + height, kind="stable")
    return Columns(cell=cell, low=low, points=points[order], key=key[order], num_y=num_y)


def find_tops(columns: Columns, *, noise: float) -> Tops:
    """Find the upper ends of the runs of a cloud that have free air above.

    Parameters
    ----------
    columns
        The cloud.
    noise
        Standard deviation of a point's height, m.
    """
    points, key = columns.points, columns.key
    if not len(points):
        none = np.zeros(0)
        return Tops(
            key=np.zeros(0, np.int64), place=np.zeros((0, 2)), height=none, thickness=none, spread=none
        )
    z = points[:, 2].astype(np.float64)
    starts_column = np.concatenate([[True], key[1:] != key[:-1]])
    starts_run = starts_column | np.concatenate([[True], np.diff(z) > MAX_GAP])
    begin = np.flatnonzero(starts_run)
    end = np.append(begin[1:], len(z))
    bottom, top = z[begin], z[end - 1]
    next_bottom = np.append(np.where(starts_column[begin[1:]], np.inf, z[begin[1:]]), np.inf)
    keep = np.flatnonzero((next_bottom - top > HEADROOM) & (top - bottom < MAX_THICKNESS))
    run_of = np.cumsum(starts_run) - 1
    depth = max(TOP_DEPTH, 4.0 * noise)
    is_top = z > top[run_of] - depth
    counted = [
        np.add.reduceat(np.where(is_top, values, 0.0), begin)[keep]
        for values in (1.0, points[:, 0].astype(np.float64), points[:, 1].astype(np.float64), z - top[run_of])
    ]
    squares = np.add.reduceat(np.where(is_top, (z - top[run_of]) ** 2, 0.0), begin)[keep]
    count, sum_x, sum_y, below = counted
    mean = below / count
    return Tops(
        key=key[begin[keep]],
        place=np.stack([sum_x / count, sum_y / count], axis=1),
        height=top[keep] + mean,
        thickness=(top - bottom)[keep],
        spread=np.sqrt(np.maximum(squares / count - mean**2, 0.0)),
    )
