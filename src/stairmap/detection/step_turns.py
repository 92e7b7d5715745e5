"""Steps that are turned against each other, as those of winders and spirals are."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.detection.edge_lines import StepExtents
from stairmap.detection.nosings import MIN_SURFACE_PIXELS, PIXELS_PER_SAMPLE
from stairmap.detection.refinement import RefinedLattice

MAX_TURN = np.radians(6.0)
"""Largest angle between a step and the others beyond its noise, rad: eight winders to a quarter turn by
11 degrees each."""

MAX_GROWTH = np.radians(2.0)
"""Largest growth of the angle from step to step beyond its noise, rad."""

MIN_TURN_STD, MAX_TURN_STD = np.radians(1.0), np.radians(15.0)
"""What is added to an angle's standard deviation, and above which it tells nothing, rad."""


def measure_turns(lattice: RefinedLattice, extents: StepExtents) -> tuple[Float64Array, Float64Array]:
    """Measure how far each riser is turned out of the lattice's lateral axis.

    All pixels between two nosings in height and within half a run of the riser count: a turned
    riser leaves the narrow band in which pixels are its members.

    Returns
    -------
    (num_nosings,) angles, NaN where there are too few pixels, and their standard deviations, rad.
    """
    pixels = lattice.pixels
    num_nosings = len(extents.left)
    x = (pixels.forward - np.float32(lattice.distance)) / np.float32(lattice.run)
    y = (pixels.height - np.float32(lattice.height)) / np.float32(lattice.rise)
    index = np.ceil(y).astype(np.int64)
    inside = (index >= 0) & (index < num_nosings) & (np.abs(index - y - 0.5) < 0.3)
    index = index.clip(0, num_nosings - 1)
    with np.errstate(invalid="ignore"):
        inside &= (np.abs(x - index) < 0.45) & (pixels.left < extents.left[index] - 0.03)
        inside &= pixels.left > extents.right[index] + 0.03
    index = index[inside]
    s, t = pixels.forward[inside].astype(np.float64), pixels.left[inside].astype(np.float64)
    count = np.bincount(index, minlength=num_nosings)

    def mean(values: Float64Array) -> Float64Array:
        return np.asarray(np.bincount(index, values, num_nosings) / np.maximum(count, 1))

    mean_s, mean_t = mean(s), mean(t)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance_t = mean(t * t) - mean_t**2
        turn = (mean(s * t) - mean_s * mean_t) / variance_t
        scatter = np.maximum(mean(s * s) - mean_s**2 - turn**2 * variance_t, 1e-6)
        std = np.sqrt(PIXELS_PER_SAMPLE * scatter / (count * lattice.row_step * variance_t))
    turn[count * lattice.row_step < 2 * MIN_SURFACE_PIXELS] = np.nan
    return turn, std


def find_turned(lattice: RefinedLattice, extents: StepExtents) -> tuple[Mask, float]:
    """Tell which steps are turned against the others.

    A step is, when its own angle says so; all are, when the angles grow from step to step, as those of
    winders and spirals do: clearly over two steps on end, or over all that are left, though each alone is
    lost in the noise.

    Returns
    -------
    (num_nosings,) whether each step is turned, and the largest such angle, rad (0 for none).
    """
    turn, std = measure_turns(lattice, extents)
    with np.errstate(invalid="ignore"):
        turned = np.abs(turn) > MAX_TURN + 2.0 * std
    if _winds(turn, std):
        turned[:] = True
        return turned, float(np.nanmax(np.abs(turn)))
    kept = np.flatnonzero(np.isfinite(turn) & ~turned & (std < MAX_TURN_STD))
    if len(kept) >= 2:
        weight = 1.0 / (std[kept] + MIN_TURN_STD) ** 2
        offset = kept - np.average(kept, weights=weight)
        spread = float(np.sum(weight * offset**2))
        growth = float(np.sum(weight * offset * turn[kept])) / spread
        if abs(growth) > MAX_GROWTH + 2.0 / np.sqrt(spread):
            turned[:] = True
            return turned, float(np.abs(turn[kept]).max())
    return np.asarray(turned), float(np.abs(turn[turned]).max()) if turned.any() else 0.0


def _winds(turn: Float64Array, std: Float64Array) -> bool:
    """Whether the angle grows twice on end in one direction by more than ``MAX_GROWTH`` beyond its noise.

    A wall behind the stairs is turned against one step only, and a bag on a step turns it there and back.
    """
    growth = np.diff(turn)
    limit = MAX_GROWTH + 2.0 * np.hypot(std[1:], std[:-1])
    with np.errstate(invalid="ignore"):
        direction = np.where(np.abs(growth) > limit, np.sign(growth), 0.0)
    return bool((direction[1:] * direction[:-1] > 0).any())
