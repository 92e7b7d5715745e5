"""Is depth in metres? A wrong scale gives stairs for giants, or none at all, and no other sign."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import islice

import numpy as np

from stairmap.arrays import DepthImage
from stairmap.errors import CalibrationError

MIN_MEDIAN_DEPTH = 0.1
"""Smallest plausible median depth, m: depth cameras begin to see there."""

MAX_MEDIAN_DEPTH = 50.0
"""Largest plausible median depth, m."""

NUM_FRAMES_CHECKED = 5
"""How many frames with valid depth are looked at."""

USUAL_SCALES = (1000.0, 5000.0)
"""PNG values per metre in use indoors: millimetres, TUM RGB-D."""

_TYPICAL_MEDIAN_DEPTH = 2.0


def check_depth_scale(depths: Iterable[DepthImage], depth_scale: float) -> float | None:
    """Check that depth lies where depth cameras see.

    Parameters
    ----------
    depths
        (height, width) images as scaled, metres; the first five with any valid pixel count.
    depth_scale
        PNG values per metre that they were scaled with.

    Returns
    -------
    Median depth of the images, in metres; ``None`` if no image has a valid pixel.

    Raises
    ------
    CalibrationError
        If the median is not within 0.1 to 50 m. The message names the scale that would put it there.
    """
    valid = (depth[np.isfinite(depth)] for depth in depths)
    sample = list(islice((values for values in valid if values.size), NUM_FRAMES_CHECKED))
    if not sample:
        return None
    median_depth = float(np.median(np.concatenate(sample)))
    if MIN_MEDIAN_DEPTH <= median_depth <= MAX_MEDIAN_DEPTH:
        return median_depth
    scale = find_likely_scale(median_depth * depth_scale, depth_scale)
    advice = f"the likely depth_scale is {scale:g}" if scale else "check depth_scale"
    raise CalibrationError(
        f"expected a median depth of {MIN_MEDIAN_DEPTH:g} to {MAX_MEDIAN_DEPTH:g} m, got {median_depth:.4g} "
        f"m with depth_scale {depth_scale:g} (values per metre: 1000 for mm, 5000 for TUM RGB-D); {advice}"
    )


def find_likely_scale(median_value: float, depth_scale: float) -> float | None:
    """Return the scale that makes a median pixel value plausible, ``None`` if none does.

    A scale below one is taken for metres per value, which is what some drivers call a depth scale.
    """

    def is_plausible(scale: float) -> bool:
        return MIN_MEDIAN_DEPTH <= median_value / scale <= MAX_MEDIAN_DEPTH

    if depth_scale < 1 and is_plausible(1 / depth_scale):
        return 1 / depth_scale
    scales = [scale for scale in USUAL_SCALES if is_plausible(scale)]
    return min(
        scales, key=lambda scale: abs(math.log(median_value / scale / _TYPICAL_MEDIAN_DEPTH)), default=None
    )
