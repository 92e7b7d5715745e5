"""The pinhole camera: which ray a pixel looks along."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, Points
from stairmap.errors import CalibrationError


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeCamera:
    """Intrinsics of a rectified pinhole camera; x right, y down, z forward (REP 103 optical frame).

    Attributes
    ----------
    width, height
        Size of the image, px.
    fx, fy
        Focal lengths, px.
    cx, cy
        Principal point, px; the centre of the first pixel is (0, 0).

    Raises
    ------
    CalibrationError
        If a size or focal length is not positive, or any value is not finite.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        values = {"fx": self.fx, "fy": self.fy, "cx": self.cx, "cy": self.cy}
        for name, value in values.items():
            if not math.isfinite(value):
                raise CalibrationError(f"camera {name} must be finite, got {value}")
        for name, value in {"fx": self.fx, "fy": self.fy}.items():
            if value <= 0:
                raise CalibrationError(f"camera {name} must be positive, got {value:g}")
        for name, size in {"width": self.width, "height": self.height}.items():
            if size <= 0:
                raise CalibrationError(f"camera {name} must be positive, got {size}")

    def rays(self) -> Points:
        """Return the (height, width, 3) ray of every pixel, with z = 1."""
        u = (np.arange(self.width) - self.cx) / self.fx
        v = (np.arange(self.height) - self.cy) / self.fy
        rays = np.ones((self.height, self.width, 3))
        rays[..., 0], rays[..., 1] = u, v[:, None]
        return rays

    def project(self, points: Points) -> Float64Array:
        """Project points into the image.

        Parameters
        ----------
        points
            (..., 3) points in the camera frame, in metres.

        Returns
        -------
        (..., 2) pixel coordinates (u, v); NaN for points at or behind the camera.
        """
        points = np.asarray(points, dtype=np.float64)
        depth = np.where(points[..., 2] > 0, points[..., 2], np.nan)
        u = points[..., 0] / depth * self.fx + self.cx
        v = points[..., 1] / depth * self.fy + self.cy
        return np.stack([u, v], axis=-1)

    def unproject(self, depth: DepthImage) -> Points:
        """Return the (height, width, 3) points of a depth image in the camera frame; NaN stays NaN."""
        return np.asarray(self.rays() * np.asarray(depth, dtype=np.float64)[..., None])

    def unproject_pixels(self, pixels: Float64Array, depths: Float64Array) -> Points:
        """Return the (..., 3) points at (..., 2) pixel coordinates (u, v) and (...,) depths in metres."""
        pixels = np.asarray(pixels, dtype=np.float64)
        depths = np.asarray(depths, dtype=np.float64)
        x = (pixels[..., 0] - self.cx) / self.fx * depths
        y = (pixels[..., 1] - self.cy) / self.fy * depths
        return np.stack([x, y, depths], axis=-1)

    def scaled(self, factor: float) -> PinholeCamera:
        """Return the camera of the image resized by a factor.

        Pixel centres are at integers, so the principal point moves by half a pixel's
        difference: ``cx' = (cx + 0.5) * factor - 0.5``.
        """
        return PinholeCamera(
            width=round(self.width * factor),
            height=round(self.height * factor),
            fx=self.fx * factor,
            fy=self.fy * factor,
            cx=(self.cx + 0.5) * factor - 0.5,
            cy=(self.cy + 0.5) * factor - 0.5,
        )

    def strided(self, stride: int) -> PinholeCamera:
        """Return the camera of the image that keeps every ``stride``-th pixel, from the first."""
        return PinholeCamera(
            width=-(-self.width // stride),
            height=-(-self.height // stride),
            fx=self.fx / stride,
            fy=self.fy / stride,
            cx=self.cx / stride,
            cy=self.cy / stride,
        )
