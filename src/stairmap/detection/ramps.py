"""Where an edge lies that a sensor made a ramp of.

A sensor that smooths, or that mixes two surfaces in a pixel, shows a jump of depth as a ramp over a few
pixels. Smoothing inverse depth leaves the edge where it is halfway between both surfaces.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array

MAX_RAMP = 8
"""Most pixels or rows that a smoothing sensor may make of a jump."""

RAMP_END = 0.3
"""A ramp ends where a pixel adds less than this share of its steepest pixel's."""

SHARP = 0.5
"""How far past the last pixel of a surface a sharp edge lies, pixels."""


def find_crossings(below: Float64Array) -> Float64Array:
    """Find how many pixels past the last one on a surface its edge lies.

    Parameters
    ----------
    below
        (N, ``MAX_RAMP`` + 1) by how much inverse depth falls below that of the surface, at the last pixel on
        it and the following ones, 1/m; NaN where nothing was measured. The first column counts as 0.

    Returns
    -------
    (N,) pixels; ``SHARP`` where no ramp was measured.
    """
    below = below.copy()
    below[:, 0] = 0.0
    growth = np.diff(below, axis=1)
    steepest = np.fmax.accumulate(np.nan_to_num(growth), axis=1)
    # The ramp ends before the first pixel that adds little to it.
    is_flat = ~(growth[:, 1:] > RAMP_END * steepest[:, :-1])
    last = 1 + np.argmax(np.append(is_flat, np.ones((len(below), 1), bool), axis=1), axis=1)
    each = np.arange(len(below))
    half = 0.5 * below[each, last]
    with np.errstate(invalid="ignore", divide="ignore"):
        after = np.argmax(below >= half[:, None], axis=1)
        before = np.maximum(after - 1, 0)
        rise = below[each, after] - below[each, before]
        crossing = before + (half - below[each, before]) / rise
    is_ramp = np.isfinite(crossing) & (after > 0)
    return np.where(is_ramp, np.clip(crossing, 0.0, MAX_RAMP), SHARP)
