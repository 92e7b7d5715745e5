"""Measure where single surfaces of a flight end: the front edges of treads, and the upper ends of risers.

Noise moves as many points out over an end as in, so where they are half as many as farther in is the end.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.clouds.surfaces import (
    COMMON_ERROR,
    MAX_OVERHANG_NOISE,
    MIN_POINTS,
    StepLattice,
    Strip,
    Surfaces,
    stacked,
)

FRONT_REACH = 0.12
"""A tread's front edge is sought so far before its place, m ..."""

FRONT_END = 0.6
"""... and to this share of a run behind it."""

FRONT_BIN, MIN_FRONT_BLUR = 0.005, 0.01
"""Points about an edge are counted in bins of this, smoothed over the noise or the second, m."""

TOP_SEARCH = (-0.3, 1.6)
"""The upper end of a riser is sought between these shares of the rise above the level below: only one riser
lies at its distance."""

TOP_WIDTH, TOP_BLUR = 2.5, 0.005
"""Points within 2.5 standard deviations of the noise of a riser are on it; directions of beams blur its upper
end by 5 mm: 0.1 degrees at 3 m."""

FULL_PERCENTILE = 80
"""A tread's usual number of points is this percentile: a part of it may be hidden."""

MIN_FRONT_POINTS = 10
"""Fewest points on a tread that tell where it begins."""


def measure_fronts(strip: Strip, lattice: StepLattice, index: IntArray, treads: Surfaces) -> Surfaces:
    """Measure where each tread begins: where the points on it reach half of their number behind.

    Noise moves as many points out over an edge as in, so half of them is the edge. Only points above the
    tread's middle count, for the face under its edge lies lower. ``treads`` begin with level -1.
    """
    results = []
    for row, k in enumerate(index.tolist()):
        s, z = float(lattice.nosing(k)), float(treads.place[row + 1])
        z = z if np.isfinite(z) else float(lattice.level(k))
        along = (s - FRONT_REACH, s + FRONT_END * lattice.run)
        results.append(_find_front(strip, strip.box(along, (z, z + strip.core)), along))
    return stacked(results)


def measure_riser_tops(strip: Strip, lattice: StepLattice, index: IntArray, risers: Surfaces) -> Surfaces:
    """Measure how high each riser reaches: a sensor near the floor sees no treads, only where risers end.

    Beyond the nosing its beams go on. The lower end of what it sees is where the step before hides the riser,
    and tells nothing.
    """
    results = []
    half = TOP_WIDTH * strip.noise
    for row, k in enumerate(index.tolist()):
        s, below = float(risers.place[row]), float(lattice.level(k - 1))
        if not risers.is_seen[row] or strip.noise <= MAX_OVERHANG_NOISE:
            results.append((float("nan"), float("inf"), 0.0, 0.0))
            continue
        up = (below + TOP_SEARCH[0] * lattice.rise, below + TOP_SEARCH[1] * lattice.rise)
        on = strip.box((s - half, s + half), up)
        height, std = _find_begin(-on[:, 2], (-up[1], -up[0]), 0.0)
        cover = strip.cover(on) if np.isfinite(height) else 0.0
        results.append((-height, float(np.hypot(std, TOP_BLUR)), cover, 0.0))
    return stacked(results)


def _find_front(
    strip: Strip, on: Float64Array, along: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Place, standard deviation and cover of the front end of points on a tread."""
    place, std = _find_begin(on[:, 0], along, strip.noise)
    if not np.isfinite(place):
        return float("nan"), float("inf"), 0.0, 0.0
    return place, float(np.hypot(std, 2 * COMMON_ERROR + 0.3 * strip.noise)), strip.cover(on), 0.0


def _find_begin(values: Float64Array, within: tuple[float, float], noise: float) -> tuple[float, float]:
    """Where values begin to be as many as they are behind, and its standard deviation; NaN if nowhere."""
    nothing = float("nan"), float("inf")
    if len(values) < MIN_FRONT_POINTS:
        return nothing
    num = int(np.ceil((within[1] - within[0]) / FRONT_BIN))
    counts = np.bincount(((values - within[0]) / FRONT_BIN).astype(np.int64), minlength=num)[:num]
    half_width = max(int(np.ceil(max(noise, MIN_FRONT_BLUR) / FRONT_BIN)), 1)
    kernel = np.full(2 * half_width + 1, 1.0 / (2 * half_width + 1))
    smooth = np.convolve(counts, kernel, mode="same")
    plateau = float(np.percentile(smooth[smooth > 0], FULL_PERCENTILE))
    if plateau * len(kernel) < MIN_POINTS:
        return nothing
    first = int(np.flatnonzero(smooth >= 0.5 * plateau)[0])
    if first == 0:
        # They begin before the window: there is no edge here.
        return nothing
    step = smooth[first] - smooth[first - 1]
    place = within[0] + FRONT_BIN * (first + 0.5 - (smooth[first] - 0.5 * plateau) / max(step, 1e-9))
    near = np.sqrt(max(plateau * len(kernel), 1.0))
    return float(place), float(FRONT_BIN * len(kernel) / near)
