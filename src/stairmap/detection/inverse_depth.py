"""Inverse depth, in which every plane is linear in the pixel.

A plane n·X = d seen along the ray r = X / z gives 1/z = (n·r) / d: inverse depth
q is a linear function of the pixel, so a least-squares fit in a window gives the
surface's normal. The noise of triangulating sensors is constant in q as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.special import ndtr

from stairmap.arrays import Float32Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame

MAX_WORKING_WIDTH = 360
"""Images are reduced by a whole factor until they are no wider than this, in pixels."""


JUMP_STEP = 6
"""Every so many columns and rows are looked at for how a sensor shows jumps."""

JUMP_REACH, PLATEAU_REACH = 3, 6
"""A jump is looked at over so many pixels to either side of it; beyond, up to the second, lie plateaus."""

MIN_JUMP_SHARE, MAX_PLATEAU_SHARE = 0.05, 0.15
"""Least share of inverse depth that a jump takes, and the most that a plateau changes, of the jump: a floor
that recedes changes everywhere."""

MIN_JUMPS = 10
"""Fewest jumps that tell how a sensor smooths."""

SHARP = 0.5
"""Standard deviation over which a pixel's footprint blends what it sees, pixels: the least there is."""

SMOOTH = 2.0
"""The same of a sensor that fuses its measurements into a smooth image, pixels: phones do."""

SMOOTHINGS = np.linspace(0.2, 4.0, 77)
"""Standard deviations that are told apart, pixels."""

MAX_BEND = np.radians(10.0)
"""Largest angle between the normals above and below a window inside of one surface, rad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InverseDepthImage:
    """Inverse depth of a frame at the size a detector works at.

    Attributes
    ----------
    inverse_depth
        (height, width) float32, 1/m, 0 where nothing was measured.
    valid
        (height, width) whether something was measured.
    camera
        The camera of this reduced image.
    stride
        How many pixels of the frame make one of this image, along each axis.
    """

    inverse_depth: Float32Array
    valid: Mask
    camera: PinholeCamera
    stride: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceNormals:
    """Normals of an inverse-depth image.

    Attributes
    ----------
    normals
        (N, 3) float32 unit normals that point away from the camera, camera frame.
    points
        (N, 3) float32 points they belong to, camera frame, m.
    residual
        (N,) float32 standard deviation of inverse depth about each fitted plane, 1/m.
    is_inner
        (N,) whether the windows above and below it have parallel normals, so that it lies on no border.
    noise
        Their median.
    """

    normals: Float32Array
    points: Float32Array
    residual: Float32Array
    is_inner: Mask
    noise: float


def inverse_depth_from_frame(frame: DepthFrame, *, max_depth: float) -> InverseDepthImage:
    """Reduce a frame to the working size and invert its depth.

    Every block of ``stride`` x ``stride`` pixels becomes the mean inverse depth of its
    nearest surface: pixels more than 5 % behind the nearest one are left out, so that no
    point is invented between two surfaces.
    """
    stride = -(-frame.camera.width // MAX_WORKING_WIDTH)
    height, width = frame.camera.height // stride * stride, frame.camera.width // stride * stride
    with np.errstate(divide="ignore"):
        inverse = 1.0 / frame.depth[:height, :width]
    inverse[~(inverse > 1.0 / max_depth)] = 0.0
    inverse[inverse > 1e3] = 0.0
    if stride > 1:
        inverse = _reduce_blocks(inverse, stride)
    camera = PinholeCamera(
        width=width // stride,
        height=height // stride,
        fx=frame.camera.fx / stride,
        fy=frame.camera.fy / stride,
        cx=(frame.camera.cx + 0.5) / stride - 0.5,
        cy=(frame.camera.cy + 0.5) / stride - 0.5,
    )
    return InverseDepthImage(inverse_depth=inverse, valid=inverse > 0, camera=camera, stride=stride)


def estimate_smoothings(image: InverseDepthImage) -> tuple[float, ...]:
    """Estimate over how many pixels a sensor blends both sides of a jump of depth.

    Between two plateaus, a jump smoothed by a Gaussian takes a known share of itself in its steepest pixel.
    The upper quartile of all jumps counts: edges that run aslant look smoother than the sensor is.

    Parameters
    ----------
    image
        Inverse depth.

    Returns
    -------
    The Gaussian's standard deviation, pixels, at least ``SHARP``; where too few jumps are in view, ``SHARP``
    and ``SMOOTH``, of which the fit must choose.
    """
    q = image.inverse_depth
    shares = np.concatenate([_jump_shares(q[:, ::JUMP_STEP]), _jump_shares(q[::JUMP_STEP].T)])
    if len(shares) < MIN_JUMPS:
        return SHARP, SMOOTH
    within = ndtr(JUMP_REACH / SMOOTHINGS) - ndtr(-JUMP_REACH / SMOOTHINGS)
    expected = (ndtr(0.5 / SMOOTHINGS) - ndtr(-0.5 / SMOOTHINGS)) / within
    seen = float(np.percentile(shares, 75))
    return (max(float(np.interp(-seen, -expected, SMOOTHINGS)), SHARP),)


def _jump_shares(scans: Float32Array) -> Float32Array:
    """Share of each jump along the columns of (R, C) scans that its steepest pixel takes."""
    reach, far = JUMP_REACH, PLATEAU_REACH
    count = len(scans) - 2 * far
    if count < 1:
        return np.zeros(0, dtype=np.float32)

    def at(offset: int) -> Float32Array:
        return scans[far + offset : far + offset + count]

    total = at(reach) - at(-reach)
    limit = np.float32(MAX_PLATEAU_SHARE) * np.abs(total)
    is_jump = np.abs(total) > np.float32(MIN_JUMP_SHARE) * np.maximum(at(reach), at(-reach))
    is_jump &= (np.abs(at(-reach) - at(-far)) < limit) & (np.abs(at(far) - at(reach)) < limit)
    row, column = np.nonzero(is_jump)
    window = scans[row[:, None] + far + np.arange(-far, far + 1), column[:, None]]
    steps = np.abs(np.diff(window[:, far - reach : far + reach + 1], axis=1))
    steepest = np.argmax(steps, axis=1)
    is_central = (window > 0).all(axis=1) & (np.abs(steepest - (reach - 0.5)) < 1.0)
    return np.asarray((steps.max(axis=1, initial=0.0) / np.abs(total[row, column]))[is_central])


def _reduce_blocks(inverse: Float32Array, stride: int) -> Float32Array:
    """Mean inverse depth of each block's nearest surface."""
    parts = [inverse[i::stride, j::stride] for i in range(stride) for j in range(stride)]
    nearest = parts[0].copy()
    for part in parts[1:]:
        np.maximum(nearest, part, out=nearest)
    limit = nearest * np.float32(0.95)
    total, count = np.zeros_like(nearest), np.zeros_like(nearest)
    for part in parts:
        near = part > limit
        total += part * near
        count += near
    return np.asarray(total / np.maximum(count, 1), dtype=np.float32)


def fit_surface_normals(image: InverseDepthImage, *, window: tuple[int, int] = (9, 5)) -> SurfaceNormals:
    """Fit a plane to inverse depth in every window of the image, reduced by two.

    Windows with less than 70 % valid pixels give none.

    Parameters
    ----------
    image
        Inverse depth.
    window
        Width and height of the windows in pixels of the image reduced by two.
    """
    height, width = image.valid.shape
    if min(height, width) < 2:
        nothing = np.zeros((0, 3), dtype=np.float32)
        return SurfaceNormals(
            normals=nothing, points=nothing, residual=nothing[:, 0], is_inner=nothing[:, 0] > 0, noise=0.0
        )
    small_size = (width // 2, height // 2)
    inside = image.inverse_depth[: height // 2 * 2, : width // 2 * 2]
    measured = np.asarray(inside > 0, dtype=np.float32)
    weight = np.asarray(cv2.resize(measured, small_size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    mean = np.asarray(cv2.resize(inside, small_size, interpolation=cv2.INTER_AREA), dtype=np.float32)
    camera = image.camera.scaled(0.5)
    u = (np.arange(small_size[0], dtype=np.float32) - np.float32(camera.cx)) / np.float32(camera.fx)
    v = ((np.arange(small_size[1], dtype=np.float32) - np.float32(camera.cy)) / np.float32(camera.fy))[
        :, None
    ]

    def window_mean(values: Float32Array) -> Float32Array:
        filtered = cv2.boxFilter(values, cv2.CV_32F, window, borderType=cv2.BORDER_CONSTANT)
        # Windows overlap: every second one along each axis tells as much as all.
        return np.asarray(filtered[::2, ::2], dtype=np.float32)

    mass = window_mean(weight)
    usable = mass > 0.7
    inverse_mass = 1.0 / np.maximum(mass, np.float32(0.1))
    mean_q = window_mean(mean) * inverse_mass
    # With few missing pixels the window's moments of u and v are those of the full window.
    var_u = np.float32((window[0] ** 2 - 1) / 12 / camera.fx**2)
    var_v = np.float32((window[1] ** 2 - 1) / 12 / camera.fy**2)
    weight_u, weight_v = window_mean(weight * u) * inverse_mass, window_mean(weight * v) * inverse_mass
    slope_u = (window_mean(mean * u) * inverse_mass - weight_u * mean_q) / var_u
    slope_v = (window_mean(mean * v) * inverse_mass - weight_v * mean_q) / var_v
    squares = np.divide(mean * mean, weight, out=np.zeros_like(mean), where=weight > 0)
    variance = window_mean(squares) * inverse_mass - mean_q**2 - slope_u**2 * var_u - slope_v**2 * var_v
    # A depth jump inside the window leaves a residual of several percent of q.
    usable &= variance < (0.02 * mean_q) ** 2 + 4e-5
    rows, columns = np.nonzero(usable)
    q, a, b = mean_q[rows, columns], slope_u[rows, columns], slope_v[rows, columns]
    ray_u, ray_v = u[2 * columns], v[2 * rows, 0]
    normals = np.stack([a, b, q - a * ray_u - b * ray_v], axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    points = np.asarray(np.stack([ray_u, ray_v, np.ones_like(q)], axis=1) / q[:, None], dtype=np.float32)
    residual = np.sqrt(np.maximum(variance[rows, columns], np.float32(0)))
    noise = float(np.median(residual)) if len(rows) else 0.0
    grid = np.zeros((usable.shape[0] + 2, usable.shape[1], 3), dtype=np.float32)
    grid[rows + 1, columns] = normals
    is_inner = np.einsum("ij,ij->i", grid[rows, columns], grid[rows + 2, columns]) > np.cos(MAX_BEND)
    return SurfaceNormals(normals=normals, points=points, residual=residual, is_inner=is_inner, noise=noise)
