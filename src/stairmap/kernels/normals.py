"""Sum up normals: which are level, which upright, which way they face."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_length

NormalSums: TypeAlias = tuple[int, int, Float64Array, int, Float64Array]
"""Planes, level ones, their sum, upright ones, the sum of their outer products."""


class NormalLimits(NamedTuple):
    """Which normals count.

    ``max_residual``: of their planes, 1/m. Inner ones are level whose component along the axis is below
    ``max_level``, a negative cosine; upright are all whose component is less than ``max_upright``.
    """

    max_residual: float
    max_level: float
    max_upright: float


class FacingLimits(NamedTuple):
    """What a direction is that many upright surfaces face.

    ``max_upright``: component of an upright normal along up. ``min_count``: upright normals, and of a peak's
    smoothed count. ``num_bins`` of the histogram of angles; ``max_peaks`` of it are looked at, normals within
    ``reach`` of each, rad; beyond ``max_angle`` nothing is ahead. Distances are counted in bins of ``width``
    metres, ``max_bins`` of them; more than ``min_in_bin`` make one.
    """

    max_upright: float
    min_count: int
    num_bins: int
    max_peaks: int
    reach: float
    max_angle: float
    width: float
    max_bins: int
    min_in_bin: int


def sum_normals(
    normals: Float32Array, residual: Float32Array, is_inner: Mask, axis: Float64Array, limits: NormalLimits
) -> NormalSums:
    """Sum level and upright normals.

    Parameters
    ----------
    normals
        (N, 3) float32 unit vectors.
    residual
        (N,) float32 how badly their planes fit, 1/m.
    is_inner
        (N,) whether they may count as level.
    axis
        (3,) unit vector.
    limits
        Which count as what.

    Returns
    -------
    How many have a small residual; how many are level, and their (3,) sum; how many are upright, and the
    (3, 3) sum of their outer products.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    _check_normals(normals)
    check_array(residual, "residual", np.float32, 1)
    check_array(is_inner, "is_inner", np.bool_, 1)
    check_array(axis, "axis", np.float64, 1)
    check_length(residual, "residual", len(normals))
    check_length(is_inner, "is_inner", len(normals))
    check_length(axis, "axis", 3)
    limits = NormalLimits(*limits)
    wide = normals.astype(np.float64)
    along = wide[:, 0] * axis[0] + wide[:, 1] * axis[1] + wide[:, 2] * axis[2]
    is_plane = residual <= limits.max_residual
    level = wide[is_plane & is_inner & (along < limits.max_level)]
    upright = wide[is_plane & (np.abs(along) < limits.max_upright)]
    num_planes = int(np.count_nonzero(is_plane))
    return num_planes, len(level), level.sum(axis=0), len(upright), upright.T @ upright


def count_floor_cells(
    normals: Float32Array, points: Float32Array, min_down: float, min_distance: float, num_cells: int
) -> tuple[Float32Array, IntArray]:
    """Count the normals of surfaces below the camera by their two level components.

    Parameters
    ----------
    normals, points
        (N, 3) float32, camera frame.
    min_down
        Least component along the camera's y axis.
    min_distance
        Least distance of the camera from the plane, m.
    num_cells
        Cells between -1 and 1 along each component.

    Returns
    -------
    (C, 3) normals that count, and (num_cells + 1, num_cells + 1) how many are in each cell of x and z.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    _check_normals(normals)
    check_array(points, "points", np.float32, 2)
    check_length(points, "points", len(normals))
    check_length(points, "points", 3, 1)
    if num_cells < 1:
        raise ValueError(f"num_cells: expected at least 1, got {num_cells}")
    wide, at = normals.astype(np.float64), points.astype(np.float64)
    distance = wide[:, 0] * at[:, 0] + wide[:, 1] * at[:, 1] + wide[:, 2] * at[:, 2]
    chosen = normals[(wide[:, 1] > min_down) & (distance > min_distance)]
    cells = np.floor((chosen[:, [0, 2]].astype(np.float64) + 1.0) * (num_cells / 2)).astype(np.int64)
    x, z = np.clip(cells, 0, num_cells).T
    side = num_cells + 1
    return chosen, np.bincount(x * side + z, minlength=side * side).reshape(side, side)


def find_facing(
    normals: Float32Array, points: Float32Array, axes: Float64Array, limits: FacingLimits
) -> tuple[Float64Array, IntArray]:
    """Find the directions that upright surfaces face away from the camera.

    Parameters
    ----------
    normals, points
        (N, 3) float32, camera frame, m.
    axes
        (3, 3) rows: up, ahead and left, unit vectors in the camera frame.
    limits
        What such a direction is.

    Returns
    -------
    (P,) angles from ahead towards left, rad, the commonest first, and at how many separate distances surfaces
    stand across each.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    _check_normals(normals)
    check_array(points, "points", np.float32, 2)
    check_array(axes, "axes", np.float64, 2)
    check_length(points, "points", len(normals))
    check_length(points, "points", 3, 1)
    check_length(axes, "axes", 3)
    check_length(axes, "axes", 3, 1)
    limits = FacingLimits(*limits)
    if limits.num_bins < 3 or limits.max_bins < 1:
        raise ValueError("limits: expected at least 3 bins of angles and 1 of distances, got fewer")
    nothing = np.zeros(0), np.zeros(0, dtype=np.int64)
    wide = normals.astype(np.float64)

    def along(values: Float64Array, axis: Float64Array) -> Float64Array:
        return np.asarray(values[:, 0] * axis[0] + values[:, 1] * axis[1] + values[:, 2] * axis[2])

    angles = np.arctan2(along(wide, axes[2]), along(wide, axes[1]))
    is_upright = np.abs(along(wide, axes[0])) < limits.max_upright
    upright = np.flatnonzero(is_upright & np.isfinite(angles))
    if len(upright) < limits.min_count:
        return nothing
    angles, places = angles[upright], points[upright].astype(np.float64)
    num = limits.num_bins
    counts = np.bincount(((angles + np.pi) * (num / (2 * np.pi))).astype(np.int64) % num, minlength=num)
    smooth = np.roll(counts, 1) + 2 * counts + np.roll(counts, -1)
    is_peak = (smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1)) & (smooth > limits.min_count)
    peaks = np.flatnonzero(is_peak)
    found = []
    for peak in peaks[np.argsort(-smooth[peaks], kind="stable")][: limits.max_peaks]:
        center = (peak + 0.5) * 2 * np.pi / num - np.pi
        offsets = (angles - center + np.pi) % (2 * np.pi) - np.pi
        near = np.abs(offsets) < limits.reach
        angle = center + float(np.median(offsets[near]))
        if abs(angle) > limits.max_angle:
            continue
        direction = np.cos(angle) * axes[1] + np.sin(angle) * axes[2]
        distances = along(places[near], direction) / limits.width
        histogram = np.bincount(np.clip(distances, 0, limits.max_bins).astype(np.int64))
        found.append((angle, int(np.count_nonzero(histogram > limits.min_in_bin))))
    if not found:
        return nothing
    return np.array([angle for angle, _ in found]), np.array([number for _, number in found])


def _check_normals(normals: Float32Array) -> None:
    check_array(normals, "normals", np.float32, 2)
    check_length(normals, "normals", 3, 1)
