"""One sweep of a LiDAR: points that were measured within a tenth of a second or so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask, Points
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, transform_points

MAX_TIME_STEP_NS = 1_000_000
"""Points this near in time share a pose when a sweep is straightened, nanoseconds: a robot that turns by
2 rad/s moves a point 4 m off by 8 mm in 1 ms, and half of that is the largest error."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """The points of one sweep in the coordinate frame of the LiDAR.

    Attributes
    ----------
    stamp_ns
        Stamp of the message, in nanoseconds.
    points
        (N, 3) float32 points where something was measured, in metres.
    offsets_ns
        (N,) int64 when each point was measured, nanoseconds after the stamp (negative: before it); ``None``
        where the LiDAR does not tell.

    Raises
    ------
    ValueError
        If there are not as many times as points.
    """

    stamp_ns: int
    points: Float32Array
    offsets_ns: IntArray | None = None

    def __post_init__(self) -> None:
        points = np.ascontiguousarray(self.points, dtype=np.float32).reshape(-1, 3).view()
        points.flags.writeable = False
        object.__setattr__(self, "points", points)
        if self.offsets_ns is None:
            return
        offsets = np.ascontiguousarray(self.offsets_ns, dtype=np.int64).view()
        offsets.flags.writeable = False
        if offsets.shape != (len(points),):
            raise ValueError(f"{len(points)} points have {offsets.size} times")
        object.__setattr__(self, "offsets_ns", offsets)

    def __len__(self) -> int:
        return len(self.points)


def straightened(sweep: Sweep, trajectory: Trajectory, *, max_gap_ns: int) -> tuple[Points, Mask]:
    """Place the points of a sweep in the map, each by the pose of its own time.

    Parameters
    ----------
    sweep
        The sweep.
    trajectory
        ``map_from_sensor``.
    max_gap_ns
        See ``Trajectory.has_pose``.

    Returns
    -------
    (N, 3) points in the map, m, and which of the sweep's points have a pose; N counts those.
    """
    offsets = np.zeros(len(sweep), dtype=np.int64) if sweep.offsets_ns is None else sweep.offsets_ns
    slot = np.floor_divide(offsets, MAX_TIME_STEP_NS)
    order = np.argsort(slot, kind="stable")
    slots, starts = np.unique(slot[order], return_index=True)
    ends = np.append(starts[1:], len(order))
    stamps = sweep.stamp_ns + slots * MAX_TIME_STEP_NS
    if sweep.offsets_ns is not None:
        stamps = stamps + MAX_TIME_STEP_NS // 2
    known = trajectory.has_pose(stamps, max_gap_ns=max_gap_ns)
    placed, has_pose = np.empty((len(sweep), 3)), np.zeros(len(sweep), dtype=bool)
    if not known.any():
        return placed[has_pose], has_pose
    poses = trajectory.poses_at(stamps[known], max_gap_ns=max_gap_ns)
    for pose, start, end in zip(poses, starts[known], ends[known], strict=True):
        chosen = order[start:end]
        placed[chosen] = transform_points(pose, sweep.points[chosen].astype(np.float64))
        has_pose[chosen] = True
    return placed[has_pose], has_pose


def in_sensor(points: Points, map_from_sensor: Float64Array) -> Points:
    """Take (N, 3) points of the map into the coordinate frame of a sensor at a (4, 4) pose."""
    return transform_points(invert_transform(map_from_sensor), points)
