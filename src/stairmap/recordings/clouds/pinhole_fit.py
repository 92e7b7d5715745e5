"""The camera that took an organised cloud, from its points: each lies on the ray of its pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, IntArray, Mask, Points, Transform
from stairmap.camera import PinholeCamera
from stairmap.recordings.camera_file import MAX_FIELD_OF_VIEW

OPTICAL_FROM_AXES = {
    "optical (x right, y down, z forward)": np.eye(3),
    "body (x forward, y left, z up)": np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
}
"""(3, 3) turns into the optical coordinate frame, by the name of what they turn (REP 103)."""

MIN_PIXELS = 100
"""Fewest pixels with depth that tell intrinsics."""

MAX_RAY_ERROR = 0.5
"""Largest root mean square of how far points lie off the rays of their pixels, px: what is registered to a
colour camera, or rounded to millimetres, stays below; sweeps of LiDARs and turned clouds are off by tens."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CloudCamera:
    """The camera of an organised cloud.

    Attributes
    ----------
    camera
        Intrinsics.
    axes
        Which axes the points have, a key of ``OPTICAL_FROM_AXES``.
    """

    camera: PinholeCamera
    axes: str

    @property
    def optical_from_cloud(self) -> Transform:
        """(3, 3) turn of the points into the camera's optical coordinate frame."""
        return OPTICAL_FROM_AXES[self.axes]


def fit_pinhole_camera(points: Points) -> CloudCamera | None:
    """Estimate the intrinsics that put all points on the rays of their pixels.

    Noise of depth moves a point along its ray, so ``x / z`` and ``y / z`` are straight lines over columns and
    rows whatever the noise.

    Parameters
    ----------
    points
        (height, width, 3) points, NaN where nothing was measured; any unit.

    Returns
    -------
    ``None`` where they do not lie on the rays of a pinhole camera along any known axes.
    """
    for axes, turn in OPTICAL_FROM_AXES.items():
        optical = points @ turn.T
        camera = _fit_along_z(optical)
        if camera is not None and find_ray_error(optical, camera) <= MAX_RAY_ERROR:
            return CloudCamera(camera=camera, axes=axes)
    return None


def find_ray_error(optical: Points, camera: PinholeCamera) -> float:
    """Return how far (height, width, 3) points lie off the rays of their pixels, root mean square, px."""
    valid = _is_before(optical)
    rows, columns = np.nonzero(valid)
    if not len(rows):
        return float("inf")
    off = camera.project(optical[valid]) - np.stack([columns, rows], axis=1)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def depth_of(optical: Points) -> DepthImage:
    """Return the (height, width) depth of organised points, NaN where nothing was measured."""
    return np.where(_is_before(optical), optical[..., 2], np.nan).astype(np.float32)


def _is_before(optical: Points) -> Mask:
    return np.asarray(np.isfinite(optical).all(axis=2) & (optical[..., 2] > 0))


def _fit_along_z(optical: Points) -> PinholeCamera | None:
    valid = _is_before(optical)
    rows, columns = np.nonzero(valid)
    if len(rows) < MIN_PIXELS or not (np.ptp(rows) and np.ptp(columns)):
        return None
    x, y, z = optical[valid].T
    lines = [_fit_line(columns, x / z), _fit_line(rows, y / z)]
    height, width = valid.shape
    for (slope, _), size in zip(lines, (width, height), strict=True):
        if slope <= 0 or 2 * np.arctan(size * slope / 2) > MAX_FIELD_OF_VIEW:
            return None
    (fx, cx), (fy, cy) = ((1 / slope, -offset / slope) for slope, offset in lines)
    return PinholeCamera(width=width, height=height, fx=float(fx), fy=float(fy), cx=float(cx), cy=float(cy))


def _fit_line(pixels: IntArray, values: Float64Array) -> tuple[float, float]:
    slope, offset = np.polyfit(pixels, values, 1)
    return float(slope), float(offset)
