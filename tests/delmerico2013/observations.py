"""Observations made of points along true nosings, for tests of the modeler."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analytic_stairs import AnalyticStairs, pose_looking
from stairmap.arrays import Points, Transform
from stairmap.config import Config
from stairmap.detection.observation import StairEdge, StairObservation
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, transform_points

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=6, heading=0.4)
K = Config().delmerico2013.detections_per_fit
MS = 1_000_000


def poses_before_stairs(num: int) -> list[Transform]:
    return [pose_looking((-1.5 + 0.02 * index, 0.1, 0.5), yaw=0.01 * index) for index in range(num)]


def observe(
    truth: Points,
    map_from_camera: Transform,
    stamp_ns: int,
    *,
    outliers: int = 0,
    spread: float = 0.008,
) -> StairObservation:
    """An observation of (N, 2, 3) nosings in the map: 120 points along each, spread in all directions."""
    random = np.random.default_rng(stamp_ns)
    fraction = random.random((len(truth), 120, 1))
    points = truth[:, :1] + fraction * (truth[:, 1:] - truth[:, :1])
    points = (points + random.normal(0, spread, points.shape)).reshape(-1, 3)
    points = np.concatenate([points, random.uniform(-1, 3, (outliers, 3))])
    camera_from_map = invert_transform(map_from_camera)
    edges = tuple(
        StairEdge(
            nosing=transform_points(camera_from_map, nosing),
            step_index=index,
            left_bounded=False,
            right_bounded=False,
            cue="jump",
            num_pixels=120,
        )
        for index, nosing in enumerate(truth)
    )
    return StairObservation(
        stamp_ns=stamp_ns,
        view="ascending",
        up=camera_from_map[:3, 2],
        forward=camera_from_map[:3, 0],
        edges=edges,
        rise=0.17,
        run=0.28,
        width=1.2,
        origin=edges[0].nosing[0],
        covariance=np.zeros((0, 0)),
        points=transform_points(camera_from_map, points),
    )


def observations_of(truth: Points, poses: Sequence[Transform], **how: float) -> list[StairObservation]:
    return [observe(truth, pose, index * MS, **how) for index, pose in enumerate(poses)]  # type: ignore[arg-type]


def trajectory_of(poses: Sequence[Transform]) -> Trajectory:
    return Trajectory(stamps_ns=np.arange(len(poses)) * MS, map_from_camera=np.array(poses))
