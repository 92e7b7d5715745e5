"""Noise models of the Kinects: structured light and time of flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np

from stairmap.arrays import DepthImage, Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.simulation.render import Rendering
from stairmap.simulation.sensor_effects import (
    EDGE_DROPOUT,
    drop_grazing,
    drop_out_of_range,
    drop_randomly,
    find_jumps,
    grazing_ratio,
    shifted_laterally,
)

_NOWHERE = 1e6
"""Depth that stands for none in filters; OpenCV does not take NaN, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KinectV1:
    """Structured light: Kinect v1, PrimeSense, Xtion.

    Axial noise of Nguyen, Izadi and Lovell 2012 (3DIMPVT):
    ``σ_z = 0.0012 + 0.0019 (z − 0.4)²``, beyond 60° plus ``0.0001/√z · θ²/(π/2 − θ)²``; lateral
    ``σ = 0.8 + 0.035 θ/(π/2 − θ)`` px. Quantised to 1/8 px of disparity (Khoshelham and Elberink
    2012): ``q = round(351.3/z)``, ``z' = 351.3/q``, a step of 2.85e-3 z² m.

    Nguyen's σ was measured on a real Kinect and so contains the quantisation already. The
    noise drawn here is smaller by its variance, step²/12, and the result again has Nguyen's σ.
    (simkinect's noise is drawn in disparity before rounding instead; using both would
    count it twice.) Lateral noise was measured on edges and moves edges only.

    Missing: projector shadow (a second ray to the projector 75 mm to the right), range
    0.5 to 5 m, grazing rays (none at 75°, half at 80°, all at 85°), 9 % of the pixels at depth edges.
    """

    name: ClassVar[str] = "kinect_v1"
    max_depth: ClassVar[float] = 5.0
    quantum: ClassVar[float] = 351.3
    native_camera: ClassVar[PinholeCamera] = PinholeCamera(
        width=640, height=480, fx=585, fy=585, cx=320, cy=240
    )
    factor: float = 1.0

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics at the resolution that is read out."""
        return self.native_camera.scaled(self.factor)

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return depth with noise, quantisation and holes."""
        lateral = self.lateral_std(rendering.incidence) * self.factor
        depth = shifted_laterally(rendering, lateral, random)
        noise = np.sqrt(
            np.maximum(self.axial_std(depth, rendering.incidence) ** 2 - self.step(depth) ** 2 / 12, 0.0)
        )
        depth += noise * random.standard_normal(depth.shape, dtype=np.float32)
        with np.errstate(invalid="ignore", divide="ignore"):
            depth = self.quantum / np.rint(self.quantum / depth)
        depth[~rendering.is_lit(np.array([0.075, 0.0, 0.0]))] = np.nan
        drop_randomly(depth, find_jumps(rendering), EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(75), np.radians(85), random)
        drop_out_of_range(depth, 0.5, self.max_depth)
        return depth.astype(np.float32)

    @staticmethod
    def axial_std(depth: Float64Array, incidence: Float64Array) -> Float64Array:
        """Return σ_z in m at depths in m and angles in rad."""
        std = 0.0012 + 0.0019 * (depth - 0.4) ** 2
        with np.errstate(invalid="ignore"):
            grazing = 0.0001 / np.sqrt(depth) * grazing_ratio(incidence) ** 2
            return np.asarray(std + np.where(incidence > np.radians(60), grazing, 0.0))

    @staticmethod
    def lateral_std(incidence: Float64Array) -> Float64Array:
        """Return the lateral σ in px of the 640x480 image."""
        return 0.8 + 0.035 * grazing_ratio(incidence)

    @classmethod
    def step(cls, depth: Float64Array) -> Float64Array:
        """Return the depth between neighbouring disparities, m."""
        return np.asarray(depth**2 / cls.quantum)


@dataclass(frozen=True, slots=True, kw_only=True)
class KinectV2:
    """Time of flight: Kinect v2.

    ``σ_z[mm] = 1.5 − 0.5 z + 0.3 z² + 0.1 z^1.5 θ²/(π/2 − θ)²`` (Fankhauser et al. 2015, ICAR).
    Flying pixels: of the pixels at depth jumps, half (ours) lie anywhere between the two
    surfaces, because one pixel mixes the light of both. Range 0.5 to 4.5 m.
    """

    name: ClassVar[str] = "kinect_v2"
    max_depth: ClassVar[float] = 4.5
    flying_share: ClassVar[float] = 0.5
    native_camera: ClassVar[PinholeCamera] = PinholeCamera(
        width=512, height=424, fx=365, fy=365, cx=255.5, cy=211.5
    )
    factor: float = 1.0

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics at the resolution that is read out."""
        return self.native_camera.scaled(self.factor)

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return depth with noise, flying pixels and holes."""
        jumps = find_jumps(rendering)
        depth = rendering.depth.copy()
        _make_flying_pixels(depth, jumps, self.flying_share, random)
        depth += self.axial_std(depth, rendering.incidence) * random.standard_normal(depth.shape)
        drop_randomly(depth, jumps, EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(78), np.radians(85), random)
        drop_out_of_range(depth, 0.5, self.max_depth)
        return depth.astype(np.float32)

    @staticmethod
    def axial_std(depth: Float64Array, incidence: Float64Array) -> Float64Array:
        """Return σ_z in m at depths in m and angles in rad."""
        with np.errstate(invalid="ignore"):
            grazing = 0.1 * depth**1.5 * grazing_ratio(incidence) ** 2
            return np.asarray(1e-3 * (1.5 - 0.5 * depth + 0.3 * depth**2 + grazing))


def _make_flying_pixels(depth: Float64Array, jumps: Mask, share: float, random: np.random.Generator) -> None:
    """Move a share of the pixels at jumps between the nearest and farthest neighbour, in place."""
    kernel = np.ones((3, 3), np.uint8)
    near = cv2.erode(np.where(np.isnan(depth), _NOWHERE, depth), kernel)
    far = cv2.dilate(np.where(np.isnan(depth), -_NOWHERE, depth), kernel)
    flying = jumps & (near < _NOWHERE) & (far > -_NOWHERE) & (random.random(depth.shape) < share)
    mix = random.random(depth.shape)
    depth[flying] = (near + mix * (far - near))[flying]
