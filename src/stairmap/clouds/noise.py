"""Estimate how noisy a cloud is, by the thickness of its level surfaces."""

from __future__ import annotations

import numpy as np

from stairmap.clouds.tops import Columns

MAX_GAP = 0.06
"""Points of one column farther apart upward than this are of two surfaces, m."""

MAX_THICKNESS = 0.12
"""Thicker surfaces are upright, or two, m."""

MIN_POINTS = 4
"""Fewest points of a column's surface that tell its thickness."""

UNKNOWN_NOISE = 0.01
"""Noise of a cloud in which no surface tells, m."""


def estimate_noise(columns: Columns) -> float:
    """Estimate the standard deviation of a point's height by the thinnest runs of the columns, m."""
    z, key = columns.points[:, 2].astype(np.float64), columns.key
    starts = np.concatenate([[True], (key[1:] != key[:-1]) | (np.diff(z) > MAX_GAP)])
    begin = np.flatnonzero(starts)
    count = np.diff(np.append(begin, len(z)))
    low = z[begin]
    local = z - np.repeat(low, count)
    mean = np.add.reduceat(local, begin) / count
    variance = np.add.reduceat(local**2, begin) / count - mean**2
    thin = (count >= MIN_POINTS) & (local[np.append(begin[1:], len(z)) - 1] < MAX_THICKNESS)
    if not thin.any():
        return UNKNOWN_NOISE
    return float(np.sqrt(np.median(variance[thin] * count[thin] / (count[thin] - 1))))
