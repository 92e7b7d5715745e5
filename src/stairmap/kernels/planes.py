"""Fit planes to windows of an image of inverse depth.

A plane n·X = d seen along the ray r = X / z gives 1/z = (n·r) / d: inverse depth is linear in the pixel.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import cv2
import numpy as np

from stairmap.arrays import Float32Array, Mask
from stairmap.kernels.checks import check_array

WindowPlanes: TypeAlias = tuple[Float32Array, Float32Array, Float32Array, Mask, float]
"""Normals, points, residuals, whether inner, and the median residual."""


class PlaneWindows(NamedTuple):
    """How windows lie and when one tells a plane.

    ``width``, ``height``: in pixels of the image reduced by two, odd. ``fx``, ``fy``, ``cx``, ``cy``: pinhole
    camera of that. ``min_mass``: share of a window that must be measured. ``max_residual``,
    ``residual_floor``: largest share of inverse depth that the standard deviation about the plane may be, and
    what is always allowed, 1/m squared. ``min_cosine``: of the normals above and below one that lies on no
    border.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    min_mass: float
    max_residual: float
    residual_floor: float
    min_cosine: float


def fit_window_planes(inverse_depth: Float32Array, windows: PlaneWindows) -> WindowPlanes:
    """Fit a plane to inverse depth in windows about every second pixel of the image reduced by two.

    Parameters
    ----------
    inverse_depth
        (height, width) float32, 1/m, 0 where nothing was measured.
    windows
        How windows lie and when one tells a plane.

    Returns
    -------
    normals
        (N, 3) float32 unit normals that point away from the camera, camera frame.
    points
        (N, 3) float32 points they belong to, camera frame, m.
    residual
        (N,) float32 standard deviation of inverse depth about each plane, 1/m.
    is_inner
        (N,) whether the windows above and below have parallel normals.
    noise
        Median of the residuals, 0 without any.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(inverse_depth, "inverse_depth", np.float32, 2)
    windows = PlaneWindows(*windows)
    if windows.width % 2 != 1 or windows.height % 2 != 1 or min(windows.width, windows.height) < 1:
        raise ValueError("windows: expected an odd width and height, got others")
    height, width = inverse_depth.shape[0] // 2, inverse_depth.shape[1] // 2
    if min(height, width) < 1:
        nothing = np.zeros((0, 3), dtype=np.float32)
        return nothing, nothing, nothing[:, 0], nothing[:, 0] > 0, 0.0
    inside = inverse_depth[: 2 * height, : 2 * width]
    measured = (inside > 0).astype(np.float32)
    quarter = np.float32(0.25)

    def halved(values: Float32Array) -> Float32Array:
        upper, lower = values[0::2], values[1::2]
        return ((upper[:, 0::2] + upper[:, 1::2]) + (lower[:, 0::2] + lower[:, 1::2])) * quarter

    weight, mean = halved(measured), halved(inside)
    u = (np.arange(width, dtype=np.float32) - np.float32(windows.cx)) / np.float32(windows.fx)
    v = ((np.arange(height, dtype=np.float32) - np.float32(windows.cy)) / np.float32(windows.fy))[:, None]

    def window_mean(values: Float32Array) -> Float32Array:
        size = (windows.width, windows.height)
        filtered = cv2.boxFilter(values, cv2.CV_32F, size, borderType=cv2.BORDER_CONSTANT)
        # Windows overlap: every second one along each axis tells as much as all.
        return np.asarray(filtered[::2, ::2], dtype=np.float32)

    mass = window_mean(weight)
    usable = mass > np.float32(windows.min_mass)
    inverse_mass = np.float32(1.0) / np.maximum(mass, np.float32(0.1))
    mean_q = window_mean(mean) * inverse_mass
    # With few missing pixels the window's moments of u and v are those of the full window.
    var_u = np.float32(max((windows.width**2 - 1) / 12 / windows.fx**2, 1e-12))
    var_v = np.float32(max((windows.height**2 - 1) / 12 / windows.fy**2, 1e-12))
    weight_u, weight_v = window_mean(weight * u) * inverse_mass, window_mean(weight * v) * inverse_mass
    slope_u = (window_mean(mean * u) * inverse_mass - weight_u * mean_q) / var_u
    slope_v = (window_mean(mean * v) * inverse_mass - weight_v * mean_q) / var_v
    squares = np.divide(mean * mean, weight, out=np.zeros_like(mean), where=weight > 0)
    variance = window_mean(squares) * inverse_mass - mean_q * mean_q
    variance = variance - slope_u * slope_u * var_u - slope_v * slope_v * var_v
    # A depth jump inside the window leaves a residual of several percent of q.
    allowed = np.float32(windows.max_residual) * mean_q
    usable &= variance < allowed * allowed + np.float32(windows.residual_floor)
    rows, columns = np.nonzero(usable)
    q, a, b = mean_q[rows, columns], slope_u[rows, columns], slope_v[rows, columns]
    ray_u, ray_v = u[2 * columns], v[2 * rows, 0]
    c = q - a * ray_u - b * ray_v
    length = np.maximum(np.sqrt(a * a + b * b + c * c), np.float32(1e-9))
    normals = np.stack([a / length, b / length, c / length], axis=1)
    points = np.stack([ray_u / q, ray_v / q, np.float32(1.0) / q], axis=1)
    residual = np.sqrt(np.maximum(variance[rows, columns], np.float32(0)))
    grid = np.zeros((usable.shape[0] + 2, usable.shape[1], 3), dtype=np.float32)
    grid[rows + 1, columns] = normals
    above, below = grid[rows, columns], grid[rows + 2, columns]
    cosine = above[:, 0] * below[:, 0] + above[:, 1] * below[:, 1] + above[:, 2] * below[:, 2]
    noise = float(np.median(residual.astype(np.float64))) if len(rows) else 0.0
    return normals, points, residual, cosine > np.float32(windows.min_cosine), noise
