"""What one frame shows of the ground about the robot: points in a level frame that moves with the robot.

Points are kept relative to the robot, so that a loop closure moves a pose and everything follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import DepthImage, Float64Array, Mask, Points
from stairmap.exploration.odometry import Planar
from stairmap.exploration.simulated_robot import View

MAX_RANGE = 4.0
"""Points farther off tell too little of the ground's height, m."""

POINT_COLUMNS = 128
"""Depth images are thinned to about so many columns."""

GRAIN = 0.04
"""Points nearer together than this become one, m: less than a cell."""

FLOOR_LOW, FLOOR_HIGH = -0.10, 0.11
"""Points between these heights above the robot's ground are floor, m: noise at the largest range, and sills
that legs step over."""

DROP_HEIGHT = -0.15
"""What lies lower than this is a hole or stairs that lead down, m."""

BLIND_MARGIN = 0.15
"""The ground between the robot and the nearest that its camera can see counts as seen if floor is seen there,
at most so much beyond, m."""

TOO_NEAR = (0.42, 0.50)
"""Where the lower part of a whole column measures nothing, something stands too near to be seen, or the floor
ends: an obstacle between these distances, m, the farther the camera's shortest range."""

MIN_EMPTY_SHARE = 0.4
"""Lower part of a column that counts for that."""

GROUND_IN_RANGE = 1.1
"""Ground is measured surely from so many times the camera's shortest range on: bodies swing."""

SAME_SURFACE = (0.02, 0.02)
"""Neighbours of a pixel whose depth differs by less than this are of its surface: m, and m per m."""

MIN_NEIGHBOURS = 2
"""Of its 8 neighbours so many must be: at edges, pixels lie anywhere between near and far. Behind a railing
they would be specks of obstacle all over the floor; a bar one pixel wide still has two."""

MAX_HEIGHT = 2.5
"""What is higher than this is left out, m: ceilings tell nothing of a place."""

FLOOR, OBSTACLE, DROP, HIGH = 0, 1, 2, 3
"""Kinds of points; ``HIGH`` ones are above the body: no obstacles, but they tell where a scan was taken."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """Points of one frame.

    Attributes
    ----------
    stamp_ns
        Stamp of the frame.
    points
        (N, 3) float32, m: x ahead, y left, z above the robot's ground.
    kinds
        (N,) int8: floor 0, obstacle 1, drop 2, high 3.
    """

    stamp_ns: int
    points: NDArray[np.float32]
    kinds: NDArray[np.int8]

    def placed(self, pose: Planar) -> Points:
        """Return the (N, 3) points in the map, of a robot at a pose."""
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        x, y = self.points[:, 0], self.points[:, 1]
        return np.stack(
            [pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y, pose.z + self.points[:, 2]],
            axis=1,
        )

    def free_ahead(self, half_width: float, height: float = 0.0) -> float:
        """Return how far the way ahead is free of obstacles on a width, m; infinite where none is seen.

        ``height``: of the ground ahead above the robot's, m.
        """
        z = self.points[:, 2] - height
        ahead = (np.abs(self.points[:, 1]) < half_width) & (self.points[:, 0] > 0) & (z > 0.25) & (z < 0.9)
        return float(self.points[ahead, 0].min()) if np.count_nonzero(ahead) >= 3 else math.inf


def scan_from_view(view: View, *, top: float) -> Scan:
    """Return the scan of a frame; ``top``: height of the robot's body, m."""
    frame = view.frame
    stride = max(1, round(frame.camera.width / POINT_COLUMNS))
    camera = frame.camera.strided(stride)
    rays = camera.rays()
    depth = frame.depth[::stride, ::stride].astype(np.float64)
    rotation, position = view.body_from_camera[:3, :3], view.body_from_camera[:3, 3]
    points = (rays * depth[..., None]) @ rotation.T + position
    distance = np.hypot(points[..., 0], points[..., 1])
    seen = (distance < MAX_RANGE) & _on_surfaces(frame.depth)[::stride, ::stride]
    kinds = np.full(depth.shape, -1, dtype=np.int8)
    height = points[..., 2]
    with np.errstate(invalid="ignore"):
        kinds[(height > FLOOR_LOW) & (height <= FLOOR_HIGH)] = FLOOR
        kinds[(height > FLOOR_HIGH) & (height < top)] = OBSTACLE
        kinds[(height >= top) & (height < MAX_HEIGHT)] = HIGH
        kinds[height < DROP_HEIGHT] = DROP
    kinds[~seen] = -1
    blind = _blind_ground(points, distance, kinds, rays @ rotation.T, float(position[2]))
    near = _too_near(depth, rays @ rotation.T, float(position[2]))
    kept = kinds >= 0
    every = np.concatenate([points[kept], blind, near])
    kind = np.concatenate(
        [
            kinds[kept],
            np.full(len(blind), FLOOR, dtype=np.int8),
            np.full(len(near), OBSTACLE, dtype=np.int8),
        ]
    )
    keys = np.column_stack([np.round(every / GRAIN).astype(np.int64), kind])
    _, first = np.unique(keys @ np.array([1, 1 << 12, 1 << 24, 1 << 40]), return_index=True)
    return Scan(stamp_ns=frame.stamp_ns, points=every[first].astype(np.float32), kinds=kind[first])


def _on_surfaces(depth: DepthImage) -> Mask:
    """Return the pixels with depth that have neighbours of the same surface."""
    image = np.where(np.isfinite(depth), depth, -np.inf)
    padded = np.pad(image, 1, constant_values=-np.inf)
    rows, columns = depth.shape
    count = np.zeros(depth.shape, dtype=np.int8)
    with np.errstate(invalid="ignore"):
        tolerance = SAME_SURFACE[0] + SAME_SURFACE[1] * image
        for row, column in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)):
            count += np.abs(padded[row : row + rows, column : column + columns] - image) < tolerance
    return np.asarray(count >= MIN_NEIGHBOURS)


def _too_near(depth: Float64Array, rays: Points, camera_height: float) -> Points:
    """Return points of what stands before columns that measure nothing.

    Rows that look down upon level ground within the camera's shortest range measure nothing either way: the
    rows above them count.
    """
    with np.errstate(divide="ignore"):
        ground = np.where(rays[..., 2] < 0, camera_height / -rays[..., 2], np.inf)
    rows = np.flatnonzero(ground.min(axis=1) > GROUND_IN_RANGE * TOO_NEAR[1])
    lower = depth[rows[round((1 - MIN_EMPTY_SHARE) * len(rows)) :]]
    if not len(lower):
        return np.empty((0, 3))
    columns = np.flatnonzero(~np.isfinite(lower).any(axis=0))
    ahead = rays[-1, columns, :2]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-9)[:, None]
    distances = np.linspace(*TOO_NEAR, 5)[:, None, None]
    level = (distances * ahead).reshape(-1, 2)
    return np.column_stack([level, np.full(len(level), 0.3)])


def _blind_ground(
    points: Points, distance: Float64Array, kinds: NDArray[np.int8], rays: Points, camera_height: float
) -> Points:
    """Return points of the ground between the robot and the nearest floor that each column sees.

    A column fills it only if its lowest pixels see floor, no farther than they must: a hole between
    would have to fit into the blind ground.
    """
    lowest = rays[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(
            lowest[:, 2] < -0.05, camera_height / -lowest[:, 2] * np.hypot(lowest[:, 0], lowest[:, 1]), np.inf
        )
    near = np.where(kinds >= 0, distance, np.inf)
    first = near.argmin(axis=0)
    columns = np.arange(len(lowest))
    is_floor = (kinds[first, columns] == FLOOR) & (near[first, columns] < reach + BLIND_MARGIN)
    ends = points[first, columns][is_floor]
    shares = np.linspace(0.0, 1.0, 30)[:, None, None]
    filled = shares * ends * [1.0, 1.0, 0.0]
    return np.asarray(filled.reshape(-1, 3))
