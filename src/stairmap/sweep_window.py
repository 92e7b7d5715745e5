"""Gather sweeps over a second or a metre: one of them is too thin to show steps.

A window begins where the last one ended. So no point is used twice, and what two windows say of a stairway is
as independent as two looks at it can be. A robot that stands still sees the same again, with the same errors:
it gives three windows of a place and no more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Transform, Vector, readonly
from stairmap.geometry import normalized
from stairmap.sweep import Sweep, straightened
from stairmap.sweep_alignment import PlaneMap, evenly
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, transform_points

MAX_POSE_GAP_NS = 150_000_000
"""Poses farther apart are not interpolated, nanoseconds: SLAM gives ten a second, and their stamps jitter."""

MAX_DURATION_NS = 1_000_000_000
"""Longest window, nanoseconds: ten sweeps, 200,000 points of a Mid-360."""

MAX_WAY = 1.0
"""Longest way within a window, m: poses drift by some per cent of it."""

MAX_BREAK_NS = 500_000_000
"""Sweeps farther apart, nanoseconds, do not belong to one window."""

MAX_RANGE = 6.0
"""Points farther from the LiDAR are not searched for steps, m: beyond, a step has some tens of points. That a
beam went on beyond the steps still tells how high they are."""

MAX_HEIGHT = 4.0
"""Points so far above or below the LiDAR are left out, m: a storey and a little."""

MAX_POINTS = 40_000
"""Most points of a sweep that are kept, evenly taken: a window of ten holds 10 MB."""

MAX_FAR = 10_000
"""Most points beyond ``MAX_RANGE`` of a sweep that are kept."""

MIN_SWEEPS = 3
"""A window of fewer sweeps, as a recording may end with, is not looked at."""

SAME_PLACE, SAME_HEADING = 0.15, float(np.radians(8.0))
"""A LiDAR that moved by less, m, or turned by less, rad, sees the same again."""

MAX_LOOKS = 3
"""Windows of one place that count."""

MAX_LEVEL_ANGLE = float(np.radians(8.0))
"""A plane that leans by less, rad, may be a floor or a tread: normals of few points err by 2°."""

OUTLYING_ANGLE = float(np.radians(1.5))
"""A plane that leans by more against the others', rad, such as a ramp, counts less."""

NUM_ROUNDS = 6
"""Rounds of weighting planes: each goes most of the way that is left."""

UP_STD, GROUND_STD = float(np.radians(0.4)), float(np.radians(0.2))
"""Standard deviations of up by the poses, and of a floor's normal against it (floors are built level to 3 mm
over 1 m), rad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepWindow:
    """Points of some sweeps in the coordinate frame that the LiDAR had in the middle of them.

    Attributes
    ----------
    stamp_ns
        Stamp of the middle sweep, nanoseconds.
    map_from_sensor
        (4, 4) its pose.
    points
        (N, 3) points, m, sensor frame.
    viewpoints
        (V, 3) where the LiDAR was in each sweep, m, sensor frame.
    view_index
        (N,) the viewpoint that each point was measured from.
    far_points, far_view_index
        The same of points beyond ``MAX_RANGE``.
    up
        (3,) unit vector opposite to gravity in it, by the poses and the floor.
    noise
        Standard deviation of a point from its plane, m; ``None`` where no planes tell.
    is_seen_before
        Whether the LiDAR stood here in three windows already.
    """

    stamp_ns: int
    map_from_sensor: Transform
    points: Points
    viewpoints: Points
    view_index: IntArray
    far_points: Points
    far_view_index: IntArray
    up: Vector
    noise: float | None = None
    is_seen_before: bool = False

    def __post_init__(self) -> None:
        for name in ("map_from_sensor", "points", "viewpoints", "far_points", "up"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
        for name in ("view_index", "far_view_index"):
            object.__setattr__(self, name, readonly(getattr(self, name), np.int64))

    @property
    def num_sweeps(self) -> int:
        """How many sweeps there are."""
        return len(self.viewpoints)


@dataclass(frozen=True, slots=True)
class _Gathered:
    """A sweep of the window in progress: its stamp, its pose, and its points and viewpoint in the map."""

    stamp_ns: int
    map_from_sensor: Transform
    points: Points
    far_points: Points
    viewpoint: Vector


class WindowGatherer:
    """Makes windows of sweeps as they come."""

    def __init__(self) -> None:
        self._sweeps: list[_Gathered] = []
        self._planes = PlaneMap()
        self._corrections: list[Transform] = []
        self._places: list[Transform] = []

    def add(self, sweep: Sweep, trajectory: Trajectory) -> SweepWindow | None:
        """Take in a sweep; return the window that it completes.

        Parameters
        ----------
        sweep
            Newer than those before it. One without a pose is left out.
        trajectory
            ``map_from_sensor`` over its time at least.
        """
        window = None
        if self._sweeps and sweep.stamp_ns - self._sweeps[-1].stamp_ns > MAX_BREAK_NS:
            window = self.finish()
        if not trajectory.has_pose(np.array([sweep.stamp_ns]), max_gap_ns=MAX_POSE_GAP_NS)[0]:
            return window
        pose = trajectory.pose_at(sweep.stamp_ns, max_gap_ns=MAX_POSE_GAP_NS)
        near, far = near_and_far(sweep)
        points, _ = straightened(near, trajectory, max_gap_ns=MAX_POSE_GAP_NS)
        points = points[np.abs(points[:, 2] - pose[2, 3]) < MAX_HEIGHT]
        correction = self._planes.align(points, pose[:3, 3]) if self._sweeps else np.eye(4)
        points = transform_points(correction, points)
        self._planes.add(points)
        far_points, _ = straightened(far, trajectory, max_gap_ns=MAX_POSE_GAP_NS)
        far_points = transform_points(correction, far_points)
        self._corrections.append(correction)
        # A sweep of a tenth of a second is seen from where the LiDAR is in its middle.
        viewpoint = transform_points(correction, _middle_place(sweep, trajectory, pose))
        self._sweeps.append(_Gathered(sweep.stamp_ns, pose, points, far_points, viewpoint))
        return window or (self.finish() if self._is_full() else None)

    def finish(self) -> SweepWindow | None:
        """Return the window in progress, if it has enough sweeps, and begin another."""
        sweeps, corrections, planes = self._sweeps, self._corrections, self._planes
        self._sweeps, self._corrections, self._planes = [], [], PlaneMap()
        if len(sweeps) < MIN_SWEEPS:
            return None
        middle = sweeps[len(sweeps) // 2]
        # The first sweep's pose is no better than the others': by their mean the window lies in the map.
        shared = invert_transform(_mean_transform(np.array(corrections)))
        sensor_from_map = invert_transform(middle.map_from_sensor)
        window_from_gathered = sensor_from_map @ shared
        points = np.concatenate([sweep.points for sweep in sweeps])
        far_points = np.concatenate([sweep.far_points for sweep in sweeps])
        number = np.arange(len(sweeps))
        up_in_map = shared[:3, :3] @ find_up(planes, shared[:3, :3].T[:, 2])
        return SweepWindow(
            stamp_ns=middle.stamp_ns,
            map_from_sensor=middle.map_from_sensor,
            points=transform_points(window_from_gathered, points),
            viewpoints=transform_points(
                window_from_gathered, np.array([sweep.viewpoint for sweep in sweeps])
            ),
            view_index=np.repeat(number, [len(sweep.points) for sweep in sweeps]),
            far_points=transform_points(window_from_gathered, far_points),
            far_view_index=np.repeat(number, [len(sweep.far_points) for sweep in sweeps]),
            up=normalized(sensor_from_map[:3, :3] @ up_in_map),
            noise=planes.noise(),
            is_seen_before=self._is_seen_before(middle.map_from_sensor),
        )

    def _is_full(self) -> bool:
        first, last = self._sweeps[0], self._sweeps[-1]
        places = np.array([sweep.map_from_sensor[:3, 3] for sweep in self._sweeps])
        way = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
        num = len(self._sweeps)
        period_ns = (last.stamp_ns - first.stamp_ns) // (num - 1) if num > 1 else 0
        # A sweep ends when the next one begins.
        return last.stamp_ns + period_ns - first.stamp_ns >= MAX_DURATION_NS or way >= MAX_WAY

    def _is_seen_before(self, pose: Transform) -> bool:
        """Count this place, and tell whether the last windows were from here too."""
        self._places = [place for place in self._places if _is_same_place(place, pose)]
        if len(self._places) >= MAX_LOOKS:
            return True
        self._places.append(pose)
        return False


def near_and_far(sweep: Sweep) -> tuple[Sweep, Sweep]:
    """Return the points within ``MAX_RANGE``, at most ``MAX_POINTS``, and the others, at most ``MAX_FAR``."""
    is_near = np.einsum("ij,ij->i", sweep.points, sweep.points) < MAX_RANGE**2
    return _some_of(sweep, np.flatnonzero(is_near), MAX_POINTS), _some_of(
        sweep, np.flatnonzero(~is_near), MAX_FAR
    )


def _some_of(sweep: Sweep, chosen: IntArray, max_num: int) -> Sweep:
    """A sweep of at most so many of some points."""
    chosen = chosen[evenly(len(chosen), max_num)]
    offsets = None if sweep.offsets_ns is None else sweep.offsets_ns[chosen]
    return Sweep(stamp_ns=sweep.stamp_ns, points=sweep.points[chosen], offsets_ns=offsets)


def find_up(planes: PlaneMap, up: Vector) -> Vector:
    """Return up, corrected by what is level: floors and treads are built to a fraction of a degree.

    Parameters
    ----------
    planes
        Planes in the map.
    up
        (3,) up by the poses.
    """
    _, normals, is_plane = planes.planes()
    weights = planes.weights()
    cosine = normals @ up
    level = is_plane & (np.abs(cosine) > np.cos(MAX_LEVEL_ANGLE))
    if not level.any():
        return up
    upward = normals[level] * np.sign(cosine[level])[:, None]
    mean = up
    for _ in range(NUM_ROUNDS):
        angle = np.arccos(np.clip(upward @ mean, -1.0, 1.0))
        held = weights[level] * np.minimum(1.0, OUTLYING_ANGLE / np.maximum(angle, 1e-9))
        mean = normalized(np.average(upward, axis=0, weights=held))
    share = UP_STD**2 / (UP_STD**2 + GROUND_STD**2)
    return normalized(share * mean + (1 - share) * up)


def _middle_place(sweep: Sweep, trajectory: Trajectory, pose: Transform) -> Vector:
    """Where the LiDAR was in the middle of a sweep, (3,) map, m."""
    if sweep.offsets_ns is None or not len(sweep):
        return np.asarray(pose[:3, 3])
    middle_ns = sweep.stamp_ns + (int(sweep.offsets_ns[0]) + int(sweep.offsets_ns[-1])) // 2
    if not trajectory.has_pose(np.array([middle_ns]), max_gap_ns=MAX_POSE_GAP_NS)[0]:
        return np.asarray(pose[:3, 3])
    return np.asarray(trajectory.pose_at(middle_ns, max_gap_ns=MAX_POSE_GAP_NS)[:3, 3])


def _mean_transform(transforms: Float64Array) -> Transform:
    """Mean of (N, 4, 4) transforms that are nearly the same."""
    mean: Transform = transforms.mean(axis=0)
    left, _, right = np.linalg.svd(mean[:3, :3])
    mean[:3, :3] = left @ right
    return mean


def _is_same_place(one: Transform, other: Transform) -> bool:
    turn = np.arccos(np.clip((np.trace(one[:3, :3].T @ other[:3, :3]) - 1) / 2, -1.0, 1.0))
    return bool(np.linalg.norm(one[:3, 3] - other[:3, 3]) < SAME_PLACE and turn < SAME_HEADING)
