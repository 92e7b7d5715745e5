"""Windows of sweeps: when they end, what they hold, and what a robot that stands still gives."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.sweep import Sweep, in_sensor, straightened
from stairmap.sweep_window import (
    MAX_FAR,
    MAX_LOOKS,
    MAX_RANGE,
    MIN_SWEEPS,
    SweepWindow,
    WindowGatherer,
    near_and_far,
)
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, rotation_from_vector, transform_from_parts, transform_points

SWEEP_NS = 100_000_000
HEIGHT = 0.5


def drive(num: int, speed: float, *, turn_rate: float = 0.0, start_ns: int = 0) -> Trajectory:
    """A LiDAR half a metre above the floor."""
    poses = [
        transform_from_parts(rotation_from_vector([0, 0, turn_rate * k * 0.1]), [speed * k * 0.1, 0, HEIGHT])
        for k in range(num)
    ]
    return Trajectory(stamps_ns=start_ns + np.arange(num) * SWEEP_NS, map_from_camera=np.array(poses))


def floor(random: np.random.Generator, num: int = 2000) -> np.ndarray:
    points = random.uniform([-4, -4, 0], [4, 4, 0], (num, 3))
    wall = random.uniform([3, -4, 0], [3, 4, 2], (num, 3))
    return np.concatenate([points, wall]) + random.normal(0, 0.01, (2 * num, 3))


def windows_of(path: Trajectory, *, believed: Trajectory | None = None) -> list[SweepWindow]:
    random, gatherer = np.random.default_rng(0), WindowGatherer()
    found = []
    for stamp_ns, pose in zip(path.stamps_ns, path.map_from_camera, strict=True):
        points = in_sensor(floor(random), pose).astype(np.float32)
        sweep = Sweep(stamp_ns=int(stamp_ns), points=points)
        found.append(gatherer.add(sweep, believed or path))
    found.append(gatherer.finish())
    return [window for window in found if window is not None]


def test_a_window_ends_after_a_second_or_a_metre() -> None:
    assert [window.num_sweeps for window in windows_of(drive(30, 0.2))] == [10, 10, 10]
    # At 2 m/s, six poses are one metre apart.
    assert [window.num_sweeps for window in windows_of(drive(18, 2.0))] == [6, 6, 6]


def test_the_last_window_is_used_if_it_has_sweeps_enough() -> None:
    assert [window.num_sweeps for window in windows_of(drive(10 + MIN_SWEEPS, 0.2))] == [10, MIN_SWEEPS]
    assert [window.num_sweeps for window in windows_of(drive(10 + MIN_SWEEPS - 1, 0.2))] == [10]


def test_a_break_ends_a_window_and_no_point_is_in_two() -> None:
    before, after = drive(5, 0.2), drive(6, 0.2, start_ns=2_000_000_000)
    path = Trajectory(
        stamps_ns=np.concatenate([before.stamps_ns, after.stamps_ns]),
        map_from_camera=np.concatenate([before.map_from_camera, after.map_from_camera]),
    )
    first, second = windows_of(path)
    assert (first.num_sweeps, second.num_sweeps) == (5, 6)
    assert len(first.points) == 5 * 4000
    assert len(second.points) == 6 * 4000
    np.testing.assert_array_equal(np.bincount(first.view_index), 4000)


def test_the_points_of_a_window_lie_where_the_poses_put_them() -> None:
    (window,) = windows_of(drive(10, 0.2, turn_rate=0.3))
    points = transform_points(window.map_from_sensor, window.points)
    near_floor = points[np.abs(points[:, 2]) < 0.1]
    assert np.abs(near_floor[:, 2].mean()) < 0.003
    wall = points[(points[:, 2] > 0.2)]
    assert wall[:, 0].mean() == pytest.approx(3.0, abs=0.005)
    viewpoints = transform_points(window.map_from_sensor, window.viewpoints)
    np.testing.assert_allclose(viewpoints[:, 2], HEIGHT, atol=0.01)
    np.testing.assert_allclose(viewpoints[:, 0], np.arange(10) * 0.02, atol=0.01)


def test_poses_that_shake_do_not_blur_a_window() -> None:
    true = drive(10, 0.2)
    random = np.random.default_rng(5)
    shaken = np.array(
        [
            pose @ transform_from_parts(rotation_from_vector(random.normal(0, 0.007, 3)), np.zeros(3))
            for pose in true.map_from_camera
        ]
    )
    believed = Trajectory(stamps_ns=true.stamps_ns, map_from_camera=shaken)
    (window,) = windows_of(true, believed=believed)
    points = transform_points(window.map_from_sensor, window.points)
    low = points[(points[:, 2] < 0.15) & (points[:, 0] < 2.8)]
    plane, *_ = np.linalg.lstsq(np.column_stack([low[:, :2], np.ones(len(low))]), low[:, 2], rcond=None)
    off = low[:, 2] - np.column_stack([low[:, :2], np.ones(len(low))]) @ plane
    # 0.4 degrees at 3 m are 21 mm.
    assert off.std() < 0.013
    # Up is the floor's normal, however the middle pose leans.
    normal = np.array([-plane[0], -plane[1], 1.0]) / np.linalg.norm([-plane[0], -plane[1], 1.0])
    assert np.degrees(np.arccos(window.map_from_sensor[:3, :3] @ window.up @ normal)) < 0.2


def test_the_floor_corrects_an_up_that_all_poses_have_wrong() -> None:
    true = drive(10, 0.2)
    lean = transform_from_parts(rotation_from_vector([0.0, np.radians(0.6), 0.0]), np.zeros(3))
    believed = Trajectory(stamps_ns=true.stamps_ns, map_from_camera=true.map_from_camera @ lean)
    (window,) = windows_of(true, believed=believed)
    # The middle pose's own lean is that of the points, and the floor's normal in it is up.
    up_of_poses = window.map_from_sensor[2, :3]
    floor_normal = true.map_from_camera[5, 2, :3]
    angle = np.degrees(np.arccos(np.clip(window.up @ floor_normal, -1, 1)))
    assert np.degrees(np.arccos(up_of_poses @ floor_normal)) == pytest.approx(0.6, abs=0.01)
    assert angle < 0.2


def test_a_robot_that_stands_still_counts_three_times() -> None:
    seen = [window.is_seen_before for window in windows_of(drive(70, 0.0))]
    assert seen == [False] * MAX_LOOKS + [True] * (7 - MAX_LOOKS)
    assert not any(window.is_seen_before for window in windows_of(drive(50, 0.2)))
    assert not any(window.is_seen_before for window in windows_of(drive(50, 0.0, turn_rate=0.3)))


def test_sweeps_without_a_pose_are_left_out() -> None:
    path, gatherer = drive(5, 0.2), WindowGatherer()
    late = Sweep(stamp_ns=10_000_000_000, points=np.ones((10, 3)))
    assert gatherer.add(late, path) is None
    assert gatherer.finish() is None


def test_far_points_are_told_apart_and_more_than_a_window_holds_are_left_out_evenly() -> None:
    points = np.zeros((100_000, 3), dtype=np.float32)
    points[:, 0] = np.linspace(0.1, 2 * MAX_RANGE, len(points))
    near, far = near_and_far(Sweep(stamp_ns=0, points=points, offsets_ns=np.arange(len(points))))
    assert near.points[:, 0].max() < MAX_RANGE <= far.points[:, 0].min()
    assert 20_000 < len(near) <= 40_000
    assert len(far) == MAX_FAR
    for kept in (near, far):
        np.testing.assert_array_equal(kept.points, points[kept.offsets_ns])


def test_a_point_without_a_pose_at_its_time_is_left_out() -> None:
    path = drive(3, 1.0)
    sweep = Sweep(stamp_ns=100_000_000, points=np.ones((3, 3)), offsets_ns=[0, 50_000_000, 500_000_000])
    points, has_pose = straightened(sweep, path, max_gap_ns=SWEEP_NS)
    assert has_pose.tolist() == [True, True, False]
    np.testing.assert_allclose(points[:, 0], 1 + np.array([0.1, 0.15]), atol=0.001)
    np.testing.assert_allclose(in_sensor(points[:1], path.map_from_camera[1]), [[1, 1, 1]], atol=0.001)
    assert np.allclose(invert_transform(path.map_from_camera[1]) @ path.map_from_camera[1], np.eye(4))


def test_as_many_times_as_points_are_asked_for() -> None:
    with pytest.raises(ValueError, match="3 points have 2 times"):
        Sweep(stamp_ns=0, points=np.ones((3, 3)), offsets_ns=[1, 2])
