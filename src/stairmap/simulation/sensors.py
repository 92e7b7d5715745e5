"""Noise models of depth sensors, each with the source of its numbers.

``measure`` turns an exact rendering into what the sensor would give. Constants
without a source are marked as ours. A sensor scaled by a factor is the same device
read out at another resolution: noise in metres stays, noise in pixels scales.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import cv2
import numpy as np

from stairmap.arrays import DepthImage, Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.simulation.render import Rendering
from stairmap.simulation.sensor_effects import (
    correlated_noise,
    drop_grazing,
    drop_out_of_range,
    drop_randomly,
    find_jumps,
    grazing_ratio,
    shifted_laterally,
)

_EDGE_DROPOUT = 0.09
"""Share of pixels missing on depth edges; 7-11 % were measured (FACTS section 4)."""


class Sensor(Protocol):
    """A depth camera."""

    @property
    def name(self) -> str:
        """What ``--sensor`` calls it."""
        ...

    @property
    def camera(self) -> PinholeCamera:
        """Its intrinsics."""
        ...

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return what it measures of a rendering made with its camera."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class IdealSensor:
    """Exact depth of whatever is nearer than 10 m."""

    name: ClassVar[str] = "ideal"
    camera: PinholeCamera = PinholeCamera(width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5)
    factor: float = 1.0

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return the exact depth; nothing is drawn."""
        depth = rendering.depth.copy()
        drop_out_of_range(depth, 0.0, 10.0)
        return depth.astype(np.float32)


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
    quantum: ClassVar[float] = 351.3
    camera: PinholeCamera = PinholeCamera(width=640, height=480, fx=585, fy=585, cx=320, cy=240)
    factor: float = 1.0

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
        drop_randomly(depth, find_jumps(rendering), _EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(75), np.radians(85), random)
        drop_out_of_range(depth, 0.5, 5.0)
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
    flying_share: ClassVar[float] = 0.5
    camera: PinholeCamera = PinholeCamera(width=512, height=424, fx=365, fy=365, cx=255.5, cy=211.5)
    factor: float = 1.0

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return depth with noise, flying pixels and holes."""
        jumps = find_jumps(rendering)
        depth = rendering.depth.copy()
        _make_flying_pixels(depth, jumps, self.flying_share, random)
        depth += self.axial_std(depth, rendering.incidence) * random.standard_normal(depth.shape)
        drop_randomly(depth, jumps, _EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(78), np.radians(85), random)
        drop_out_of_range(depth, 0.5, 4.5)
        return depth.astype(np.float32)

    @staticmethod
    def axial_std(depth: Float64Array, incidence: Float64Array) -> Float64Array:
        """Return σ_z in m at depths in m and angles in rad."""
        with np.errstate(invalid="ignore"):
            grazing = 0.1 * depth**1.5 * grazing_ratio(incidence) ** 2
            return np.asarray(1e-3 * (1.5 - 0.5 * depth + 0.3 * depth**2 + grazing))


@dataclass(frozen=True, slots=True, kw_only=True)
class RealSenseD435:
    """Active stereo: Intel RealSense D435.

    Noise is constant in disparity: ``σ_z = z²·s/(f·B)`` with s = 0.08 px (0.05 to 0.1),
    B = 50 mm (Intel's tuning guide), at the full-resolution f. It is correlated over the
    matching window: smoothed by a Gaussian of 3 px, 1/e at 6 px (5 to 10 px). The window also
    fattens edges: within half of its 7 px the nearer surface wins. The left f·B/z px have no
    partner in the right image, nor has what the right camera, 50 mm aside, does not see.
    Range 0.28 to 8 m (ours).
    """

    name: ClassVar[str] = "d435"
    subpixel: ClassVar[float] = 0.08
    baseline: ClassVar[float] = 0.05
    window: ClassVar[int] = 7
    correlation: ClassVar[float] = 3.0
    camera: PinholeCamera = PinholeCamera(width=640, height=480, fx=385, fy=385, cx=319.5, cy=239.5)
    factor: float = 1.0

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return depth with correlated noise, fattened edges and holes."""
        jumps = find_jumps(rendering)
        window = 2 * max(round(self.window * self.factor / 2 - 0.5), 1) + 1
        depth = _fatten_edges(rendering.depth, jumps, window)
        noise = correlated_noise(depth.shape, self.correlation * self.factor, random)
        scale = self.camera.fx / self.factor * self.baseline
        with np.errstate(invalid="ignore"):
            depth = scale / (scale / depth + self.subpixel * noise)
            band = np.arange(self.camera.width) < self.camera.fx * self.baseline / depth
        depth[band] = np.nan
        depth[~rendering.is_lit(np.array([self.baseline, 0.0, 0.0]))] = np.nan
        drop_randomly(depth, jumps, _EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(78), np.radians(86), random)
        drop_out_of_range(depth, 0.28, 8.0)
        return depth.astype(np.float32)

    @classmethod
    def axial_std(cls, depth: Float64Array) -> Float64Array:
        """Return σ_z in m at depths in m."""
        focal = 385.0
        return np.asarray(depth**2 * cls.subpixel / (focal * cls.baseline))


@dataclass(frozen=True, slots=True, kw_only=True)
class PhoneLidar:
    """Phone LiDAR as its system hands it out: 256x192, smooth, without holes (all numbers ours).

    A few hundred measured spots are fused with the colour image into a dense map: edges are
    ramps (Gaussian of 2 px over the exact inverse depth) and the error is smooth too,
    ``σ_z = 0.003 + 0.003 z`` with a correlation of 16 px. Range 0.3 to 5 m.
    """

    name: ClassVar[str] = "phone_lidar"
    smoothing: ClassVar[float] = 2.0
    correlation: ClassVar[float] = 8.0
    camera: PinholeCamera = PinholeCamera(width=256, height=192, fx=212, fy=212, cx=127.5, cy=95.5)
    factor: float = 1.0

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return smooth depth with smooth error."""
        inverse = np.nan_to_num(1 / rendering.depth)
        weight = np.isfinite(rendering.depth).astype(np.float64)
        sigma = self.smoothing * self.factor
        total = cv2.GaussianBlur(inverse, (0, 0), sigma)
        share = cv2.GaussianBlur(weight, (0, 0), sigma)
        with np.errstate(invalid="ignore", divide="ignore"):
            depth = np.where(weight > 0, share / total, np.nan)
        noise = correlated_noise(depth.shape, self.correlation * self.factor, random)
        depth += self.axial_std(depth) * noise
        drop_out_of_range(depth, 0.3, 5.0)
        return depth.astype(np.float32)

    @staticmethod
    def axial_std(depth: Float64Array) -> Float64Array:
        """Return σ_z in m at depths in m."""
        return np.asarray(0.003 + 0.003 * depth)


SENSORS: dict[str, type[IdealSensor | KinectV1 | KinectV2 | RealSenseD435 | PhoneLidar]] = {
    sensor.name: sensor for sensor in (IdealSensor, KinectV1, KinectV2, RealSenseD435, PhoneLidar)
}
"""Every sensor by the name that ``--sensor`` takes."""


def make_sensor(name: str, *, factor: float = 1.0) -> Sensor:
    """Return a sensor, read out at ``factor`` times its resolution (0.5: 320x240).

    Raises
    ------
    ValueError
        If there is no such sensor.
    """
    if name not in SENSORS:
        raise ValueError(f"unknown sensor {name!r}; choose one of: {', '.join(sorted(SENSORS))}")
    sensor = SENSORS[name]
    return sensor(camera=sensor().camera.scaled(factor), factor=factor)


def _make_flying_pixels(depth: Float64Array, jumps: Mask, share: float, random: np.random.Generator) -> None:
    """Move a share of the pixels at jumps between the nearest and farthest neighbour, in place."""
    kernel = np.ones((3, 3), np.uint8)
    near = cv2.erode(np.where(np.isnan(depth), np.inf, depth), kernel)
    far = cv2.dilate(np.where(np.isnan(depth), -np.inf, depth), kernel)
    flying = jumps & np.isfinite(near) & np.isfinite(far) & (random.random(depth.shape) < share)
    mix = random.random(depth.shape)
    depth[flying] = (near + mix * (far - near))[flying]


def _fatten_edges(depth: Float64Array, jumps: Mask, window: int) -> Float64Array:
    """Let the nearer surface win within half a window of a jump."""
    kernel = np.ones((window, window), np.uint8)
    # Only the nearer side of a jump spreads; a steep floor elsewhere in the window does not.
    edge_depth = np.where(jumps, depth, np.inf)
    near = cv2.erode(edge_depth, kernel)
    with np.errstate(invalid="ignore"):
        covered = np.isfinite(near) & ~(depth - near < 0.02 + 0.01 * near)
    return np.where(covered, near, depth)
