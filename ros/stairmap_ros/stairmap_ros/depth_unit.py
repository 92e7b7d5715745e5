"""What is said of depth images in another unit than ROS's convention (REP 118). No ROS in here."""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import DepthImage
from stairmap.errors import CalibrationError
from stairmap.recordings.depth_scale import MAX_MEDIAN_DEPTH
from stairmap.recordings.depth_unit_watch import DepthUnitMistake

PIXEL_STRIDE = 16
"""Every so many rows and columns count for the median."""


def check_depth_unit(depth: DepthImage, message: Any) -> None:
    """Check that a (height, width) image, m, is no image in millimetres.

    Raises
    ------
    CalibrationError
        If its median is farther than any depth camera sees.
    """
    sample = depth[::PIXEL_STRIDE, ::PIXEL_STRIDE]
    sample = sample[np.isfinite(sample)]
    if not sample.size or np.median(sample) <= MAX_MEDIAN_DEPTH:
        return
    median = float(np.median(sample))
    if is_floating(message):
        raise CalibrationError(
            f"depth has a median of {median:.0f} m: 32FC1 must be metres (REP 118), this is probably "
            f"millimetres; publish metres, or 16UC1 in millimetres"
        )
    raise CalibrationError(
        f"depth has a median of {median:.0f} m: depth_unit does not fit these images; 0.001 is millimetres"
    )


def describe_unit_mistake(mistake: DepthUnitMistake, message: Any, depth_unit: float) -> str:
    """Return what is wrong with the unit, and what mends it."""
    if is_floating(message):
        return f"{mistake}; publish 32FC1 in metres (REP 118)"
    return f"{mistake}; set depth_unit to {depth_unit * mistake.factor:g}"


def is_floating(message: Any) -> bool:
    """Tell whether a depth message, compressed or not, holds floating-point numbers."""
    return str(getattr(message, "encoding", "") or getattr(message, "format", "")).startswith("32FC1")
