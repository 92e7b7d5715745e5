"""Scans of side profiles by exact intersection, for tests of what reads them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.detection.elevation import STRIP_WIDTH, Elevation, ElevationGrid

Profile = Sequence[tuple[tuple[float, float], tuple[float, float]]]
"""Line segments of forward distance and height, m; the camera is at (0, 0)."""


def stairs_profile(
    *,
    distance: float,
    height: float,
    rise: float = 0.17,
    run: float = 0.28,
    num: int = 6,
    has_risers: bool = True,
    floor: bool = True,
) -> Profile:
    """Stairs that ascend away, nosing 0 at (distance, height), with a landing of 1 m."""
    parts = []
    if floor:
        parts.append(((0.05, height - rise), (distance, height - rise)))
    for index in range(num):
        s, z = distance + index * run, height + index * rise
        if has_risers:
            parts.append(((s, z - rise), (s, z)))
        parts.append(((s, z), (s + (run if index < num - 1 else 1.0), z)))
    return parts


def descending_profile(
    *, distance: float, height: float, rise: float = 0.17, run: float = 0.28, num: int = 5
) -> Profile:
    """An upper floor at ``height`` that ends at ``distance``, then treads that go down away from it."""
    parts = [((0.05, height), (distance, height))]
    for index in range(num):
        s, z = distance + index * run, height - (index + 1) * rise
        parts += [((s, z + rise), (s, z)), ((s, z), (s + (run if index < num - 1 else 2.0), z))]
    return parts


def grid_of(
    slope: Float64Array, num_strips: int, *, spread: float = 0.2, edge_shift: float = 0.0
) -> ElevationGrid:
    """A grid that looks along the camera's z, with strips between the bearings ``spread`` and -``spread``."""
    return ElevationGrid(
        up=np.array([0.0, -1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        left=np.array([-1.0, 0.0, 0.0]),
        slope=slope,
        bearing=np.linspace(spread, -spread, num_strips * STRIP_WIDTH),
        row_size=float(slope[-1] - slope[0]) / (len(slope) - 1),
        edge_shift=edge_shift,
    )


def scan(
    profile: Profile,
    *,
    num_strips: int = 3,
    num_rows: int = 330,
    top: float = 0.45,
    bottom: float = -1.2,
    noise: float = 0.0,
    seed: int = 0,
    edge_shift: float = 0.0,
) -> Elevation:
    """The elevation of a profile that is the same in all strips; noise of inverse distance in 1/m."""
    slope = np.linspace(bottom, top, num_rows)
    nearest = np.full(num_rows, np.inf)
    for (s0, z0), (s1, z1) in profile:
        # s·slope = z on the segment (s0 + a·ds, z0 + a·dz).
        ds, dz = s1 - s0, z1 - z0
        denominator = dz - slope * ds
        share = (slope * s0 - z0) / np.where(np.abs(denominator) > 1e-12, denominator, np.nan)
        s = s0 + share * ds
        hit = (share >= 0) & (share <= 1) & (s > 0)
        nearest = np.where(hit, np.minimum(nearest, s), nearest)
    q = np.where(np.isfinite(nearest), 1.0 / nearest, 0.0)[:, None] * np.ones(num_strips)
    if noise > 0:
        q = np.where(q > 0, q + np.random.default_rng(seed).normal(0, noise, q.shape), 0.0)
    grid = grid_of(slope, num_strips, edge_shift=edge_shift)
    middle = grid.bearing.reshape(num_strips, STRIP_WIDTH).mean(axis=1)
    return Elevation(grid=grid, bearing=middle, inverse_distance=q)
