"""Which unit a cloud is in, by how tall it is: rooms are 2 m high, and no building is 150 m."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}
"""Metres of each unit that ``--unit`` takes."""

TALLEST = 150.0
"""A cloud that is taller than this in some unit is in a smaller one, m."""

LOWEST = 1.5
"""A cloud that is lower than this in some unit is in a larger one, m."""

INNER = (0.5, 99.5)
"""Percentiles between which a cloud's height is measured: single points lie anywhere."""


def find_unit(heights: Float64Array) -> str:
    """Return ``m``, ``cm`` or ``mm`` by how far (N,) heights, in the file's unit, reach."""
    low, high = np.percentile(heights, INNER)
    extent = float(high - low)
    if extent <= TALLEST:
        return "m"
    for name in ("mm", "cm"):
        if LOWEST <= extent * UNITS[name] <= TALLEST:
            return name
    return "m"
