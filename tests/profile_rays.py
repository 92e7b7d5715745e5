"""Rays of stair profiles as a sensor measures them, for tests of what fits and judges profiles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.detection.fit import FittedProfile, Rays
from stairmap.detection.profile import Optics, StairProfile, Surface, outline_of, predict

ROW = 1 / 290
OPTICS = Optics(row_size=ROW, smoothing=0.5, shift=0.0)
NOISE = 0.001


def make_profile(**changes: Any) -> StairProfile:
    """Five steps that lead up, seen from 1 m above their floor; other values by name."""
    values = {"distance": 1.2, "height": -0.83, "run": 0.28, "rise": 0.17, "num_steps": 5, "thickness": 0.035}
    return StairProfile(**{**values, **changes})


def make_descending(**changes: Any) -> StairProfile:
    """Five steps that lead down, the camera 0.9 m over the uppermost and 0.6 m before its edge."""
    values = {"distance": 1.72, "height": -1.58, "run": -0.28, "rise": 0.17, "num_steps": 5}
    return StairProfile(**{**values, **changes})


def measure(
    profile: StairProfile,
    *,
    optics: Optics = OPTICS,
    noise: float = NOISE,
    seed: int = 0,
    slopes: tuple[float, float] = (-1.6, 0.3),
    bearings: Float64Array | None = None,
    num_alike: int = 1,
) -> Rays:
    """Rays in rows of one pixel and strips from left to right; so many neighbours in a row err alike."""
    strips = np.linspace(0.3, -0.3, 14) if bearings is None else bearings
    slope = np.arange(slopes[0], slopes[1], optics.row_size)
    outline = outline_of(profile, min_extent=optics.smoothing * optics.row_size)
    # What is behind an edge is farther than the least that is foretold.
    is_behind = outline.surface == Surface.BEHIND
    outline = replace(outline, line=np.where(is_behind[:, None], 0.6 * outline.line, outline.line))
    q = predict(outline, slope, optics, has_gradient=False).inverse_distance
    num = -(-len(strips) // num_alike)
    errors = np.random.default_rng(seed).normal(0, noise, (len(slope), num)).repeat(num_alike, axis=1)
    row, strip = np.divmod(np.arange(len(slope) * len(strips)), len(strips))
    return Rays(
        slope=slope[row],
        bearing=strips[strip],
        inverse_distance=q[row] + errors[row, strip],
        row=row,
        strip=strip,
    )


def fitted(profile: StairProfile, *, noise: float = NOISE, optics: Optics = OPTICS) -> FittedProfile:
    """A profile that was fitted, for what only reads it."""
    return FittedProfile(
        profile=profile,
        tilt=0.0,
        roll=0.0,
        turn=0.0,
        optics=optics,
        noise=noise,
        covariance=np.eye(6) * 1e-6,
        step_std=np.full((profile.num_steps, 2), 0.004),
        overhang_std=0.005,
        rise_information=np.zeros((2, 3)),
        cost=0.0,
    )


def changed(rays: Rays, chosen: Float64Array, inverse_distance: Float64Array | float) -> Rays:
    """Rays of which some measured something else."""
    return replace(rays, inverse_distance=np.where(chosen, inverse_distance, rays.inverse_distance))
