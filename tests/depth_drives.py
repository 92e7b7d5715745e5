"""Frames of short drives, with their true poses."""

from __future__ import annotations

import numpy as np

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking, render_depth
from stairmap.arrays import Float64Array
from stairmap.camera import PinholeCamera
from stairmap.frame import DepthFrame

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
PERIOD_NS = 100_000_000
CAMERA = KINECT_CAMERA.scaled(0.5)
SIDE_WALL = 1.3
"""y of a wall beside the stairs, m: without it, nothing tells motion along the steps."""


def poses_towards_stairs(num_frames: int = 10, *, step: float = 0.06) -> Float64Array:
    """(N, 4, 4) map_from_camera of a camera that comes nearer and turns a little."""
    return np.array(
        [
            pose_looking((-2.4 + step * index, 0.02 * index, 0.9), yaw=0.015 * index, down=0.3)
            for index in range(num_frames)
        ]
    )


def frames_at(
    poses: Float64Array,
    *,
    stairs: AnalyticStairs | None = STAIRS,
    has_walls: bool = True,
    first_ns: int = 0,
    camera: PinholeCamera = CAMERA,
) -> list[DepthFrame]:
    """Noisy frames at these poses, 0.1 s apart, that do not tell up."""
    frames = []
    for index, pose in enumerate(poses):
        depth = render_depth(stairs, camera, pose, wall_at=4.5 if has_walls else None)
        if has_walls:
            aside = camera.rays() @ pose[1, :3]
            with np.errstate(divide="ignore"):
                wall = (SIDE_WALL - pose[1, 3]) / aside
            depth = np.where(wall > 0, np.fmin(depth, wall), depth)
        std = 0.0012 + 0.0019 * (depth - 0.4) ** 2  # Nguyen, Izadi, Lovell 2012
        depth = depth + std * np.random.default_rng(index).normal(size=depth.shape)
        frames.append(DepthFrame(stamp_ns=first_ns + index * PERIOD_NS, depth=depth, camera=camera))
    return frames


def wall_frames(num_frames: int, *, distance: float) -> list[DepthFrame]:
    """Frames of a camera that stands before a bare wall."""
    depth = np.full((CAMERA.height, CAMERA.width), distance, dtype=np.float32)
    return [DepthFrame(stamp_ns=i * PERIOD_NS, depth=depth, camera=CAMERA) for i in range(num_frames)]


def empty_frame(stamp_ns: int) -> DepthFrame:
    """A frame that measured nothing."""
    depth = np.full((CAMERA.height, CAMERA.width), np.nan, dtype=np.float32)
    return DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=CAMERA)
