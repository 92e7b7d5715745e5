"""Single frames of simulated scenes, each with what could be seen in it.

A view is one camera at one place in one scene. It is rendered without noise, measured by its sensor with
noise from a seed, and carries the truth: the exact pose, the flight, and how many image rows of each
tread and riser the camera saw, at the size of image that detectors work at.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stairmap.arrays import DepthImage, Float64Array, IntArray, Points, Transform, readonly
from stairmap.camera import PinholeCamera
from stairmap.detection.orientation import POSE_UP_STD
from stairmap.frame import DepthFrame
from stairmap.simulation.kinect_sensors import KinectV1, KinectV2
from stairmap.simulation.render import RayCaster, Rendering
from stairmap.simulation.scene import Scene
from stairmap.simulation.sensors import PhoneLidar, RealSenseD435, Sensor
from stairmap.stairway import Flight
from stairmap.transforms import rotation_from_vector

WORKING_SIZE = 360
"""Rows are counted in the image reduced by a whole factor until its longer side has no more pixels."""

MIN_PIXELS_ACROSS = 8
"""A tread or riser seen over fewer pixels along its nosing counts as not seen."""

_LEVEL_COSINE = 0.9
"""Cosine of a surface's tilt from which it is a tread; risers have less than the sine of it."""

_NEAR = 0.012
"""How far from where it should be a pixel's point may lie, m: treads may slope by 4 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """One camera at one place in one scene.

    Attributes
    ----------
    kind, group
        Which kind of scene, and which part of the kind.
    scene
        The scene; at most one stairway of one flight.
    sensor
        The depth camera.
    map_from_camera
        (4, 4) true pose of the image as it is delivered.
    seed
        Of the sensor's noise.
    quarter_turns
        By how many quarter turns (counter-clockwise) the image was turned after it was measured: a
        portrait image comes from a sensor mounted on its side.
    spare_below, spare_above
        (M, 2, 3) nosings below and above the flight that may be reported as steps of it, m, map.
    ends_are_known
        Whether a flight's first and last step are settled; an escalator's are not.
    """

    kind: str
    group: str
    scene: Scene
    sensor: Sensor
    map_from_camera: Transform
    seed: tuple[int, ...]
    quarter_turns: int = 0
    spare_below: Points = field(default_factory=lambda: np.zeros((0, 2, 3)))
    spare_above: Points = field(default_factory=lambda: np.zeros((0, 2, 3)))
    ends_are_known: bool = True

    def __post_init__(self) -> None:
        for name in ("map_from_camera", "spare_below", "spare_above"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def flight(self) -> Flight | None:
        """The flight to be found; ``None`` where there is none."""
        flights = [flight for stairway in self.scene.stairways for flight in stairway.flights]
        return flights[0] if flights else None

    @property
    def camera(self) -> PinholeCamera:
        """Intrinsics of the image as it is delivered."""
        return turned_camera(self.sensor.camera, self.quarter_turns)

    def frame(self, depth: DepthImage) -> DepthFrame:
        """Return a depth image of the view as a frame, with the true up, as sure as a pose tells it."""
        up = self.map_from_camera[2, :3]
        return DepthFrame(stamp_ns=0, depth=depth, camera=self.camera, up=up, up_std=POSE_UP_STD)


@dataclass(frozen=True, slots=True, kw_only=True)
class StepsInView:
    """What of a flight a camera saw, from the noise-free image within the sensor's range.

    Attributes
    ----------
    tread_rows, riser_rows
        (num_risers,) thickness of each tread and riser across its nosing, px of the working image; zero
        where it was not seen. The riser's lip counts as riser; the last tread is the upper floor, up to
        one run.
    riser_sigmas
        (num_risers,) rise in standard deviations of the sensor's depth at the riser; infinite for
        a sensor without noise, zero where the riser was not seen.
    """

    tread_rows: Float64Array
    riser_rows: Float64Array
    riser_sigmas: Float64Array

    def __post_init__(self) -> None:
        for name in ("tread_rows", "riser_rows", "riser_sigmas"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON types; infinity as ``None``."""
        sigmas = [round(float(value), 3) if np.isfinite(value) else None for value in self.riser_sigmas]
        return {
            "tread_rows": np.round(self.tread_rows, 3).tolist(),
            "riser_rows": np.round(self.riser_rows, 3).tolist(),
            "riser_sigmas": sigmas,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> StepsInView:
        """Rebuild it from ``to_dict``."""
        return cls(
            tread_rows=data["tread_rows"],
            riser_rows=data["riser_rows"],
            riser_sigmas=np.array([np.inf if value is None else value for value in data["riser_sigmas"]]),
        )


def take_view(view: View) -> tuple[DepthImage, StepsInView | None]:
    """Return the noisy depth image of a view, (height, width) m, and what it shows of the flight."""
    # The sensor measures its own image; the image is turned afterwards.
    mounted = _unturned_pose(view.map_from_camera, view.quarter_turns)
    rendering = RayCaster(view.scene.mesh).render(view.sensor.camera, mounted)
    depth = view.sensor.measure(rendering, np.random.default_rng(view.seed))
    flight = view.flight
    seen = None if flight is None else measure_steps(flight, rendering, view.sensor)
    return np.rot90(depth, view.quarter_turns), seen


def measure_steps(flight: Flight, rendering: Rendering, sensor: Sensor) -> StepsInView:
    """Return what a noise-free image shows of each step within a sensor's range."""
    camera = rendering.camera
    stride = -(-max(camera.width, camera.height) // WORKING_SIZE)
    with np.errstate(invalid="ignore"):
        seen = rendering.depth <= sensor.max_depth
    v, u = np.nonzero(seen)
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(len(u))], axis=1)
    pose = rendering.map_from_camera
    points = (rays * rendering.depth[seen][:, None]) @ pose[:3, :3].T + pose[:3, 3]
    up = np.abs(rendering.normals[seen] @ pose[2, :3])
    local = (points - flight.base) @ flight.map_from_flight[:3, :3]
    inside = np.abs(local[:, 1]) <= flight.width / 2 + _NEAR
    is_tread, is_riser = inside & (up >= _LEVEL_COSINE), inside & (up <= np.sqrt(1 - _LEVEL_COSINE**2))
    rows = np.zeros((3, flight.num_risers))
    nosings = np.array([step.nosing for step in flight.steps])
    middles = (nosings.mean(axis=1) - flight.base) @ flight.map_from_flight[:3, :3]
    # Nosings of stairs that slope sideways are not level.
    across = nosings[:, 0, 2] - nosings[:, 1, 2]
    for index, (x, _, z) in enumerate(middles):
        back = middles[index + 1, 0] if index + 1 < len(middles) else x + flight.run
        above = local[:, 2] - z - local[:, 1] * across[index] / flight.width
        # A tread that slopes by 4 % is 0.04 times its depth higher at its back.
        fits = (above >= -_NEAR) & (above <= _NEAR + 0.05 * np.maximum(local[:, 0] - x, 0))
        tread = is_tread & fits & (local[:, 0] >= x - _NEAR) & (local[:, 0] <= back + flight.overhang)
        below = middles[index - 1, 2] if index else z - flight.rise
        riser = is_riser & (above <= _NEAR) & (above >= below - z - _NEAR)
        riser &= (local[:, 0] >= x - _NEAR) & (local[:, 0] <= x + flight.overhang + _NEAR)
        direction = _image_direction(camera, pose, nosings[index])
        rows[0, index] = _thickness(u[tread], v[tread], direction) / stride
        rows[1, index] = _thickness(u[riser], v[riser], direction) / stride
        if rows[1, index] > 0:
            depths = np.array([np.median(rendering.depth[seen][riser])])
            angles = np.array([np.median(rendering.incidence[seen][riser])])
            std = float(_depth_std(sensor, depths, angles)[0])
            rows[2, index] = (z - below) / std if std > 0 else np.inf
    return StepsInView(tread_rows=rows[0], riser_rows=rows[1], riser_sigmas=rows[2])


def turned_camera(camera: PinholeCamera, quarter_turns: int) -> PinholeCamera:
    """Return the intrinsics of an image that was turned counter-clockwise by quarter turns."""
    for _ in range(quarter_turns % 4):
        # Column u becomes row width - 1 - u; row v becomes column v.
        camera = PinholeCamera(
            width=camera.height, height=camera.width, fx=camera.fy, fy=camera.fx,
            cx=camera.cy, cy=camera.width - 1 - camera.cx,
        )  # fmt: skip
    return camera


def _unturned_pose(map_from_camera: Transform, quarter_turns: int) -> Transform:
    """Return the pose of the image before it was turned."""
    pose = np.array(map_from_camera)
    # Turned counter-clockwise by 90 deg, the old x axis (right) points up: the new -y.
    turn = rotation_from_vector([0, 0, -np.pi / 2 * (quarter_turns % 4)])
    pose[:3, :3] = pose[:3, :3] @ turn
    return pose


def _image_direction(camera: PinholeCamera, pose: Transform, nosing: Points) -> Float64Array:
    """Return the (2,) unit direction of a nosing in the image; level where the camera sees no part of it."""
    share = np.linspace(0, 1, 33)[:, None]
    points = nosing[0] * (1 - share) + nosing[1] * share
    pixels = camera.project((points - pose[:3, 3]) @ pose[:3, :3])
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    if len(pixels) < 2:
        return np.array([1.0, 0.0])
    direction = pixels[-1] - pixels[0]
    return np.asarray(direction / max(float(np.linalg.norm(direction)), 1e-12))


def _thickness(u: IntArray, v: IntArray, direction: Float64Array) -> float:
    """Return the mean extent of pixels across a direction of the image, px."""
    if len(u) == 0:
        return 0.0
    along = np.rint(u * direction[0] + v * direction[1]).astype(np.int64)
    num_across = len(np.unique(along))
    return len(u) / num_across if num_across >= MIN_PIXELS_ACROSS else 0.0


def _depth_std(sensor: Sensor, depth: Float64Array, incidence: Float64Array) -> Float64Array:
    """Return the standard deviation of a sensor's depth, m; zero for one without noise."""
    if isinstance(sensor, (KinectV1, KinectV2)):
        return sensor.axial_std(depth, incidence)
    if isinstance(sensor, (RealSenseD435, PhoneLidar)):
        return sensor.axial_std(depth)
    return np.zeros(len(depth))


def with_roll(view: View, roll: float) -> View:
    """Return a view with its camera turned about the optical axis, clockwise as it looks, rad."""
    pose = np.array(view.map_from_camera)
    pose[:3, :3] = pose[:3, :3] @ rotation_from_vector([0, 0, roll])
    return replace(view, map_from_camera=pose)
