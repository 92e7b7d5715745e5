"""Depth images of a staircase by exact ray and box intersection, for tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Points, Transform
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame
from stairmap.transforms import invert_transform, transform_from_parts, transform_points

KINECT_CAMERA = PinholeCamera(width=320, height=240, fx=262.5, fy=262.5, cx=159.5, cy=119.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalyticStairs:
    """A staircase on a floor: base at (0, 0, 0), ascending along the map's +x turned by ``heading``."""

    rise: float = 0.17
    run: float = 0.28
    width: float = 1.2
    num_risers: int = 8
    heading: float = 0.0

    def boxes(self) -> Points:
        """(N, 2, 3) lower and upper corners in the flight's coordinate frame; all end far behind."""
        index = np.arange(self.num_risers)
        far = self.num_risers * self.run + 1.5
        low = np.stack(
            [index * self.run, np.full(index.shape, -self.width / 2), np.full(index.shape, -2.0)], 1
        )
        high = np.stack(
            [np.full(index.shape, far), np.full(index.shape, self.width / 2), (index + 1) * self.rise], 1
        )
        return np.stack([low, high], axis=1)

    def map_from_flight(self) -> Transform:
        cosine, sine = np.cos(self.heading), np.sin(self.heading)
        return transform_from_parts([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]], [0, 0, 0])


def pose_looking(
    position: tuple[float, float, float], *, yaw: float = 0.0, down: float = 0.0, roll: float = 0.0
) -> Transform:
    """(4, 4) map_from_camera of a camera that looks along yaw (from +x), tilted down and rolled, rad."""
    forward = np.array([np.cos(yaw) * np.cos(down), np.sin(yaw) * np.cos(down), -np.sin(down)])
    level_right = np.array([np.sin(yaw), -np.cos(yaw), 0.0])
    level_bottom = np.cross(forward, level_right)
    right = np.cos(roll) * level_right + np.sin(roll) * level_bottom
    bottom = np.cos(roll) * level_bottom - np.sin(roll) * level_right
    return transform_from_parts(np.stack([right, bottom, forward], axis=1), position)


def render_depth(
    stairs: AnalyticStairs | None,
    camera: PinholeCamera,
    map_from_camera: Transform,
    *,
    wall_at: float | None = None,
    floor: bool = True,
) -> DepthImage:
    """Depth of stairs, floor and wall in metres, NaN where a ray meets nothing within 10 m.

    ``wall_at`` puts a wall across the whole view at this x of the flight, m. Without stairs the
    flight's coordinate frame is the map's.
    """
    map_from_flight = np.eye(4) if stairs is None else stairs.map_from_flight()
    flight_from_camera = invert_transform(map_from_flight) @ map_from_camera
    origin = flight_from_camera[:3, 3]
    rays = camera.rays().reshape(-1, 3) @ flight_from_camera[:3, :3].T
    rays = np.where(np.abs(rays) < 1e-12, 1e-12, rays)
    depth = np.full(len(rays), np.inf)
    for low, high in () if stairs is None else stairs.boxes():
        first, second = (low - origin) / rays, (high - origin) / rays
        enter = np.minimum(first, second).max(axis=1)
        leave = np.maximum(first, second).min(axis=1)
        depth = np.where((enter <= leave) & (enter > 0), np.minimum(depth, enter), depth)
    planes = ([(2, 0.0)] if floor else []) + ([] if wall_at is None else [(0, wall_at)])
    for axis, position in planes:
        at = (position - origin[axis]) / rays[:, axis]
        depth = np.where(at > 0, np.minimum(depth, at), depth)
    depth[depth > 10] = np.nan
    return depth.reshape(camera.height, camera.width).astype(np.float32)


def render_frame(
    stairs: AnalyticStairs | None,
    map_from_camera: Transform,
    *,
    camera: PinholeCamera = KINECT_CAMERA,
    stamp_ns: int = 0,
    wall_at: float | None = None,
    floor: bool = True,
    noise_seed: int | None = None,
) -> DepthFrame:
    """Frame with the depth image and the camera's true up; with a seed, with a Kinect's axial noise."""
    depth = render_depth(stairs, camera, map_from_camera, wall_at=wall_at, floor=floor)
    if noise_seed is not None:
        std = 0.0012 + 0.0019 * (depth - 0.4) ** 2  # Nguyen, Izadi, Lovell 2012
        depth = depth + std * np.random.default_rng(noise_seed).normal(size=depth.shape)
    return DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=camera, up=map_from_camera[2, :3])


def nosings(stairs: AnalyticStairs) -> Points:
    """(num_risers, 2, 3) true nosings in the map, left end first, lowest first."""
    index = np.arange(stairs.num_risers)
    ends = np.zeros((stairs.num_risers, 2, 3))
    ends[..., 0] = (index * stairs.run)[:, None]
    ends[..., 1] = np.array([0.5, -0.5]) * stairs.width
    ends[..., 2] = ((index + 1) * stairs.rise)[:, None]
    return transform_points(stairs.map_from_flight(), ends)
