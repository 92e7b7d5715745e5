"""From the points of image lines to the stair edges of an observation.

The report stops at points; its stair edges are clusters of the modeler. What is here only
describes the same points as the rest of stairmap does.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Vector
from stairmap.detection.observation import StairEdge


def edges_from_points(
    points: Points, line_index: IntArray, *, forward: Vector, up: Vector
) -> tuple[StairEdge, ...]:
    """Fit one stair edge to the points of each line.

    The points are regressed on their coordinate to the right, seen from below. No end is ever
    called bounded, because the report keeps only the columns that all lines share. Steps are numbered in
    order of height: the report's method does not look for missed ones.

    Parameters
    ----------
    points
        (N, 3) points, in metres.
    line_index
        (N,) index of each point's line, in ascending order.
    forward, up
        (3,) unit vectors up the stairs and against gravity, in the same frame.

    Returns
    -------
    Stair edges from the lowest to the highest.
    """
    starts = np.append(0, np.flatnonzero(line_index[1:] != line_index[:-1]) + 1)
    counts = np.diff(np.append(starts, len(line_index)))
    right = points @ np.cross(forward, up)
    means = np.add.reduceat(points, starts, axis=0) / counts[:, None]
    mean_right = np.add.reduceat(right, starts) / counts
    offsets = right - np.repeat(mean_right, counts)
    variance = np.add.reduceat(offsets**2, starts)
    covariance = np.add.reduceat(offsets[:, None] * points, starts, axis=0)
    slopes = covariance / np.maximum(variance, 1e-12)[:, None]
    left_end = np.minimum.reduceat(offsets, starts)
    right_end = np.maximum.reduceat(offsets, starts)
    ends = means[:, None] + np.stack([left_end, right_end], axis=1)[..., None] * slopes[:, None]
    order = np.argsort(means @ up, kind="stable")
    return tuple(_stair_edge(ends[line], step, int(counts[line])) for step, line in enumerate(order))


def _stair_edge(ends: Float64Array, step_index: int, num_pixels: int) -> StairEdge:
    return StairEdge(
        nosing=ends,
        step_index=step_index,
        left_bounded=False,
        right_bounded=False,
        cue="jump",
        num_pixels=num_pixels,
    )
