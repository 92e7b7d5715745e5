"""Sample an image of inverse depth along rays that are told by slope and bearing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float32Array, Float64Array
from stairmap.kernels.checks import check_array, check_length


class SamplingView(NamedTuple):
    """The pinhole camera of an image, pixels, and when a sample counts.

    ``same_surface``: pixels whose inverse depths differ by less than this share may be interpolated.
    ``least_depth``: rays with less depth for each metre forward see nothing.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    same_surface: float
    least_depth: float


class StripMeans(NamedTuple):
    """How samples of a strip are averaged.

    ``num_samples`` of neighbouring bearings are one strip; those within ``spread`` of their median, as a
    share of it, count, if ``min_valid`` are measured and ``min_near`` count.
    """

    num_samples: int
    spread: float
    min_valid: int
    min_near: int


def sample_rays(
    inverse_depth: Float32Array,
    axes: Float64Array,
    slope: Float64Array,
    bearing: Float64Array,
    view: SamplingView,
) -> Float32Array:
    """Sample inverse forward distance on a grid of slopes and bearings.

    Between pixels of one surface it is interpolated, which is exact on planes; elsewhere the nearest counts.

    Parameters
    ----------
    inverse_depth
        (height, width) float32, 1/m, 0 where nothing was measured.
    axes
        (3, 3) rows: forward, up and left, unit vectors in the camera frame.
    slope, bearing
        (R,) heights gained and (N,) metres to the left, for each metre forward.
    view
        The camera, and when a sample counts.

    Returns
    -------
    (R, N) float32 inverse forward distance, 1/m; 0 where none is.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    _check_sampling(inverse_depth, axes, slope, bearing)
    view = SamplingView(*view)
    climb = slope.astype(np.float32)[:, None]
    across = bearing.astype(np.float32)[None, :]
    forward, up, left = axes.astype(np.float32)
    fx, fy, cx, cy, same, least = (np.float32(value) for value in view)
    depth = forward[2] + climb * up[2] + across * left[2]
    inverse = np.float32(1.0) / np.maximum(depth, least)
    map_u = (forward[0] + climb * up[0] + across * left[0]) * inverse * fx + cx
    map_v = (forward[1] + climb * up[1] + across * left[1]) * inverse * fy + cy
    height, width = inverse_depth.shape
    # Rays that miss the image by a pixel or more need no place in it.
    is_near = (map_u > -1) & (map_u < width) & (map_v > -1) & (map_v < height) & (depth >= least)
    map_u, map_v = np.where(is_near, map_u, np.float32(0)), np.where(is_near, map_v, np.float32(0))
    padded = np.pad(inverse_depth, 1)
    nearest = padded[np.rint(map_v).astype(np.int64) + 1, np.rint(map_u).astype(np.int64) + 1]
    low_u, low_v = np.floor(map_u), np.floor(map_v)
    part_u, part_v = map_u - low_u, map_v - low_v
    row, column = low_v.astype(np.int64) + 1, low_u.astype(np.int64) + 1
    one = np.float32(1.0)
    above = padded[row, column] * (one - part_u) + padded[row, column + 1] * part_u
    below = padded[row + 1, column] * (one - part_u) + padded[row + 1, column + 1] * part_u
    linear = above * (one - part_v) + below * part_v
    is_smooth = np.abs(linear - nearest) < same * nearest
    sampled = np.where(is_smooth, linear, nearest) * depth
    return np.where(is_near, sampled, np.float32(0))


def sample_strips(
    inverse_depth: Float32Array,
    axes: Float64Array,
    slope: Float64Array,
    bearing: Float64Array,
    view: SamplingView,
    means: StripMeans,
) -> Float64Array:
    """Sample a grid as ``sample_rays`` does and average neighbouring bearings, those near their median.

    Parameters
    ----------
    inverse_depth, axes, slope, bearing, view
        As there; N is a multiple of ``means.num_samples``.
    means
        How samples are averaged.

    Returns
    -------
    (R, S) float64 inverse forward distance, 1/m; 0 where too few samples are there or agree.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    _check_sampling(inverse_depth, axes, slope, bearing)
    means = StripMeans(*means)
    num = means.num_samples
    if num < 1 or len(bearing) % num:
        raise ValueError(f"bearing: expected a multiple of {num} values, got {len(bearing)}")
    cells = sample_rays(inverse_depth, axes, slope, bearing, view).reshape(len(slope), -1, num)
    ordered = np.sort(cells, axis=2)
    num_valid = np.count_nonzero(ordered, axis=2)
    middle = np.minimum(num - num_valid + num_valid // 2, num - 1)
    median = np.take_along_axis(ordered, middle[:, :, None], axis=2)
    near = np.abs(ordered - median) < np.float32(means.spread) * median
    count = np.count_nonzero(near, axis=2)
    total = np.where(near, ordered, np.float32(0)).sum(axis=2, dtype=np.float64)
    enough = (num_valid >= means.min_valid) & (count >= means.min_near)
    return np.where(enough, total / np.maximum(count, 1), 0.0)


def sharpen_scans(
    inverse_distance: Float64Array, kernel: NDArray[np.float32], num_rounds: int, min_share: float
) -> Float64Array:
    """Undo a part of what a sensor smooths along scans.

    The scans are smoothed again, compared with what was measured, and the difference is added, a few times
    over (van Cittert).

    Parameters
    ----------
    inverse_distance
        (R, S) inverse forward distance of scans, 1/m, 0 where nothing was measured.
    kernel
        (K,) float32 weights over which rows are smoothed, an odd number; their sum is 1.
    num_rounds
        How often the difference is added.
    min_share
        A cell is sharpened where more than this share of the measurements about it is there.

    Returns
    -------
    (R, S) sharpened inverse distance, as it was where it cannot be.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(inverse_distance, "inverse_distance", np.float64, 2)
    check_array(kernel, "kernel", np.float32, 1)
    if len(kernel) % 2 != 1:
        raise ValueError(f"kernel: expected an odd number of weights, got {len(kernel)}")
    if inverse_distance.size == 0:
        return inverse_distance.copy()
    rows = np.arange(len(inverse_distance))
    reach = len(kernel) // 2

    def smoothed(values: NDArray[np.float32]) -> NDArray[np.float32]:
        total = np.zeros_like(values)
        for place, weight in enumerate(kernel):
            total = total + weight * values[np.clip(rows + place - reach, 0, len(rows) - 1)]
        return total

    measured: NDArray[np.float32] = inverse_distance.astype(np.float32)
    is_measured = (measured > 0).astype(np.float32)
    share = smoothed(is_measured)
    scale = np.float32(1.0) / np.maximum(share, np.float32(1e-3))
    sharp = measured
    for _ in range(num_rounds):
        sharp = np.asarray(sharp + is_measured * (measured - smoothed(sharp) * scale), dtype=np.float32)
    is_better = (share > np.float32(min_share)) & (sharp > 0) & (measured > 0)
    return np.asarray(np.where(is_better, sharp.astype(np.float64), inverse_distance))


def _check_sampling(
    inverse_depth: NDArray[np.float32], axes: Float64Array, slope: Float64Array, bearing: Float64Array
) -> None:
    check_array(inverse_depth, "inverse_depth", np.float32, 2)
    check_array(axes, "axes", np.float64, 2)
    check_array(slope, "slope", np.float64, 1)
    check_array(bearing, "bearing", np.float64, 1)
    if inverse_depth.size == 0:
        raise ValueError("inverse_depth: expected at least one pixel, got none")
    check_length(axes, "axes", 3)
    check_length(axes, "axes", 3, 1)
