"""Reduce a depth image to inverse depth, and look at how sharp its jumps are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float32Array
from stairmap.kernels.checks import check_array


class InverseRange(NamedTuple):
    """Which inverse depths are measurements, 1/m, and what shares of the nearest one are its surface."""

    least: float
    most: float
    same_surface: float


class JumpShape(NamedTuple):
    """What a jump between two plateaus is.

    ``step``: every so many columns and rows are looked at. ``reach``: pixels to either side over which it is
    looked at; up to ``far`` lie plateaus. ``min_share``: of inverse depth that it takes; ``max_plateau``: the
    most that a plateau changes, in jumps.
    """

    step: int
    reach: int
    far: int
    min_share: float
    max_plateau: float


def reduce_depth(depth: Float32Array, stride: int, limits: InverseRange) -> Float32Array:
    """Invert depth and average it over blocks, each over its nearest surface.

    Parameters
    ----------
    depth
        (H, W) float32, m; what is no measurement may have any value, also NaN.
    stride
        Side of a block, pixels; what is left over at the right and below is cut off.
    limits
        What is a measurement, and what is of the nearest surface.

    Returns
    -------
    (H // stride, W // stride) float32 inverse depth, 1/m, 0 where nothing was measured.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(depth, "depth", np.float32, 2)
    if stride < 1:
        raise ValueError(f"stride: expected at least 1, got {stride}")
    limits = InverseRange(*limits)
    height, width = depth.shape[0] // stride * stride, depth.shape[1] // stride * stride
    with np.errstate(divide="ignore"):
        inverse = np.float32(1.0) / depth[:height, :width]
    inverse[~(inverse > np.float32(limits.least))] = 0.0
    inverse[inverse > np.float32(limits.most)] = 0.0
    if stride == 1:
        return inverse
    parts = [inverse[i::stride, j::stride] for i in range(stride) for j in range(stride)]
    nearest = parts[0].copy()
    for part in parts[1:]:
        np.maximum(nearest, part, out=nearest)
    limit = nearest * np.float32(limits.same_surface)
    total, count = np.zeros_like(nearest), np.zeros_like(nearest)
    for part in parts:
        near = part > limit
        total += part * near
        count += near
    return np.asarray(total / np.maximum(count, np.float32(1)), dtype=np.float32)


def measure_jumps(inverse_depth: Float32Array, shape: JumpShape) -> Float32Array:
    """Measure which share of each jump its steepest pixel takes.

    Parameters
    ----------
    inverse_depth
        (height, width) float32, 1/m, 0 where nothing was measured.
    shape
        What a jump is.

    Returns
    -------
    (N,) float32 shares, those along columns first.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(inverse_depth, "inverse_depth", np.float32, 2)
    shape = JumpShape(*shape)
    if not (shape.step > 0 and 0 < shape.reach <= shape.far):
        raise ValueError("shape: expected a step above 0 and reach from 1 to far, got others")
    scans = inverse_depth[:, :: shape.step], inverse_depth[:: shape.step].T
    return np.concatenate([_jumps_along(part, shape) for part in scans])


def _jumps_along(scans: NDArray[np.float32], shape: JumpShape) -> Float32Array:
    """Shares of jumps along the columns of (R, C) scans."""
    reach, far = shape.reach, shape.far
    count = len(scans) - 2 * far
    if count < 1:
        return np.zeros(0, dtype=np.float32)

    def at(offset: int) -> Float32Array:
        return scans[far + offset : far + offset + count]

    total = at(reach) - at(-reach)
    limit = np.float32(shape.max_plateau) * np.abs(total)
    is_jump = np.abs(total) > np.float32(shape.min_share) * np.maximum(at(reach), at(-reach))
    is_jump &= (np.abs(at(-reach) - at(-far)) < limit) & (np.abs(at(far) - at(reach)) < limit)
    row, column = np.nonzero(is_jump)
    window = scans[row[:, None] + far + np.arange(-far, far + 1), column[:, None]]
    steps = np.abs(np.diff(window[:, far - reach : far + reach + 1], axis=1))
    steepest = np.argmax(steps, axis=1)
    is_central = (window > 0).all(axis=1) & (np.abs(steepest - (reach - 0.5)) < 1.0)
    return np.asarray((steps.max(axis=1, initial=0.0) / np.abs(total[row, column]))[is_central])
