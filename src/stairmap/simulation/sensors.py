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
from stairmap.simulation.kinect_sensors import KinectV1, KinectV2
from stairmap.simulation.render import Rendering
from stairmap.simulation.sensor_effects import (
    EDGE_DROPOUT,
    correlated_noise,
    drop_grazing,
    drop_out_of_range,
    drop_randomly,
    find_jumps,
)

_NOWHERE = 1e6
"""Depth that stands for none in filters; OpenCV does not take NaN, m."""


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

    @property
    def max_depth(self) -> float:
        """Farthest depth that it measures, m."""
        ...

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return what it measures of a rendering made with its camera."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class IdealSensor:
    """Exact depth of whatever is nearer than 10 m."""

    name: ClassVar[str] = "ideal"
    max_depth: ClassVar[float] = 10.0
    native_camera: ClassVar[PinholeCamera] = PinholeCamera(
        width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5
    )
    factor: float = 1.0

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics at the resolution that is read out."""
        return self.native_camera.scaled(self.factor)

    def measure(self, rendering: Rendering, random: np.random.Generator) -> DepthImage:
        """Return the exact depth; nothing is drawn."""
        depth = rendering.depth.copy()
        drop_out_of_range(depth, 0.0, self.max_depth)
        return depth.astype(np.float32)


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
    max_depth: ClassVar[float] = 8.0
    subpixel: ClassVar[float] = 0.08
    baseline: ClassVar[float] = 0.05
    window: ClassVar[int] = 7
    correlation: ClassVar[float] = 3.0
    native_camera: ClassVar[PinholeCamera] = PinholeCamera(
        width=640, height=480, fx=385, fy=385, cx=319.5, cy=239.5
    )
    factor: float = 1.0

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics at the resolution that is read out."""
        return self.native_camera.scaled(self.factor)

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
        drop_randomly(depth, jumps, EDGE_DROPOUT, random)
        drop_grazing(depth, rendering.incidence, np.radians(78), np.radians(86), random)
        drop_out_of_range(depth, 0.28, self.max_depth)
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
    max_depth: ClassVar[float] = 5.0
    smoothing: ClassVar[float] = 2.0
    correlation: ClassVar[float] = 8.0
    native_camera: ClassVar[PinholeCamera] = PinholeCamera(
        width=256, height=192, fx=212, fy=212, cx=127.5, cy=95.5
    )
    factor: float = 1.0

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics at the resolution that is read out."""
        return self.native_camera.scaled(self.factor)

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
        drop_out_of_range(depth, 0.3, self.max_depth)
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
    return SENSORS[name](factor=factor)


def _fatten_edges(depth: Float64Array, jumps: Mask, window: int) -> Float64Array:
    """Let the nearer surface win within half a window of a jump."""
    kernel = np.ones((window, window), np.uint8)
    # Only the nearer side of a jump spreads; a steep floor elsewhere in the window does not.
    edge_depth = np.where(jumps & np.isfinite(depth), depth, _NOWHERE)
    near = cv2.erode(edge_depth, kernel)
    with np.errstate(invalid="ignore"):
        covered = (near < _NOWHERE) & ~(depth - near < 0.02 + 0.01 * near)
    return np.where(covered, near, depth)
