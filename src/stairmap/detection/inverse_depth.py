"""Inverse depth, in which every plane is linear in the pixel.

A plane n·X = d seen along the ray r = X / z gives 1/z = (n·r) / d: inverse depth
q is a linear function of the pixel, so a least-squares fit in a window gives the
surface's normal. The noise of triangulating sensors is constant in q as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, readonly
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.kernels import fit_window_planes, measure_jumps, reduce_depth
from stairmap.kernels.images import InverseRange, JumpShape
from stairmap.kernels.planes import PlaneWindows

MAX_WORKING_WIDTH = 360
"""Images are reduced by a whole factor until they are no wider than this, in pixels."""


MAX_INVERSE_DEPTH = 1e3
"""What is nearer than a millimetre is no measurement, 1/m."""

SAME_SURFACE = 0.95
"""Pixels of a block within this share of the nearest one's inverse depth are averaged."""

MIN_WINDOW_SHARE = 0.7
"""Share of a window that must be measured for its normal."""

MAX_RESIDUAL_SHARE, RESIDUAL_FLOOR = 0.02, 4e-5
"""A plane's standard deviation in inverse depth is at most this share of it, beyond a variance that is always
allowed, 1/m squared: a jump inside of a window leaves several percent."""

JUMP_STEP = 6
"""Each N-th column and row is looked at for how a sensor shows jumps."""

JUMP_REACH, PLATEAU_REACH = 3, 6
"""A jump is looked at over this many pixels to either side of it; beyond, up to the second, lie plateaus."""

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
    limits = InverseRange(1.0 / max_depth, MAX_INVERSE_DEPTH, SAME_SURFACE)
    inverse = reduce_depth(frame.depth, stride, limits)
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
    shape = JumpShape(JUMP_STEP, JUMP_REACH, PLATEAU_REACH, MIN_JUMP_SHARE, MAX_PLATEAU_SHARE)
    shares = measure_jumps(image.inverse_depth, shape)
    if len(shares) < MIN_JUMPS:
        return SHARP, SMOOTH
    return (max(float(np.interp(-_upper_quartile(shares), _FALLING_SHARES, SMOOTHINGS)), SHARP),)


def _upper_quartile(values: Float32Array) -> float:
    """As ``numpy.percentile`` says, at a tenth of its cost for few values."""
    place = 0.75 * (len(values) - 1)
    low, high = np.sort(values)[[math.floor(place), math.ceil(place)]].tolist()
    return float(low + (high - low) * (place - math.floor(place)))


def _falling_shares() -> Float64Array:
    # The normal distribution between -x and x is erf(x / √2); SciPy's takes a quarter of a second to import.
    pixel, all_of_it = (
        np.array([math.erf(reach / smoothing / math.sqrt(2.0)) for smoothing in SMOOTHINGS.tolist()])
        for reach in (0.5, JUMP_REACH)
    )
    return readonly(-pixel / all_of_it)


_FALLING_SHARES = _falling_shares()
"""Share of a jump that its steepest pixel takes at each of ``SMOOTHINGS``, counted negative to ascend."""


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
    if min(image.valid.shape) < 2:
        nothing = np.zeros((0, 3), dtype=np.float32)
        return SurfaceNormals(
            normals=nothing,
            points=nothing,
            residual=nothing[:, 0],
            is_inner=np.zeros(0, dtype=bool),
            noise=0.0,
        )
    camera = image.camera.scaled(0.5)
    windows = PlaneWindows(
        width=window[0],
        height=window[1],
        fx=camera.fx,
        fy=camera.fy,
        cx=camera.cx,
        cy=camera.cy,
        min_mass=MIN_WINDOW_SHARE,
        max_residual=MAX_RESIDUAL_SHARE,
        residual_floor=RESIDUAL_FLOOR,
        min_cosine=math.cos(MAX_BEND),
    )
    normals, points, residual, is_inner, noise = fit_window_planes(image.inverse_depth, windows)
    return SurfaceNormals(normals=normals, points=points, residual=residual, is_inner=is_inner, noise=noise)
