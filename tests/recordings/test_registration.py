"""Poses from depth: right where the view tells them, and none where it does not."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from depth_drives import PERIOD_NS, empty_frame, frames_at, poses_towards_stairs, wall_frames
from stairmap.errors import MissingPackageError
from stairmap.recordings.registration import DepthOdometry, TrackState, points_from_frame
from stairmap.transforms import invert_transform, vector_from_rotation


@pytest.fixture
def odometry():
    pytest.importorskip("small_gicp")
    return DepthOdometry()


def check_follows(tracked, poses, *, tolerance=0.03, tolerance_deg=1.0):
    first = invert_transform(poses[0])
    for found, pose in zip(tracked, poses, strict=True):
        error = invert_transform(first @ pose) @ found.piece_from_camera
        assert np.linalg.norm(error[:3, 3]) < tolerance
        assert np.degrees(np.linalg.norm(vector_from_rotation(error[:3, :3]))) < tolerance_deg


def test_a_drive_towards_stairs_is_followed(odometry):
    poses = poses_towards_stairs()
    tracked = [odometry.track(frame) for frame in frames_at(poses)]
    assert [frame.state for frame in tracked] == [TrackState.START] + 9 * [TrackState.TRACKED]
    assert {frame.piece for frame in tracked} == {0}
    check_follows(tracked, poses)


def test_poses_stay_rigid_over_many_frames(odometry):
    frames = frames_at(poses_towards_stairs(6))
    poses = []
    for index in range(36):
        frame = frames[index % 6] if index % 12 < 6 else frames[5 - index % 6]
        later = type(frame)(stamp_ns=index * PERIOD_NS, depth=frame.depth, camera=frame.camera)
        poses.append(odometry.track(later).piece_from_camera)
    rotation = poses[-1][:3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.norm(poses[-1][:3, 3]) < 0.05  # it came back to where it began


def test_a_camera_that_stands_still_does_not_drift(odometry):
    poses = np.repeat(poses_towards_stairs(1), 12, axis=0)
    tracked = [odometry.track(frame) for frame in frames_at(poses)]
    check_follows(tracked, poses, tolerance=0.01, tolerance_deg=0.3)


def test_a_frame_without_depth_has_no_pose_and_the_next_one_has(odometry):
    poses = poses_towards_stairs(5)
    frames = frames_at(poses)
    frames[2] = empty_frame(2 * PERIOD_NS)
    tracked = [odometry.track(frame) for frame in frames]
    assert tracked[2].state is TrackState.TOO_FEW_POINTS
    assert tracked[2].piece_from_camera is None
    check_follows(tracked[:2] + tracked[3:], poses[[0, 1, 3, 4]])


def test_a_floor_alone_does_not_determine_the_motion(odometry):
    poses = poses_towards_stairs(4)
    frames = frames_at(poses, stairs=None, has_walls=False)
    states = [odometry.track(frame).state for frame in frames]
    assert states == [TrackState.START] + 3 * [TrackState.UNDETERMINED]


def test_a_camera_carried_elsewhere_is_lost_and_begins_a_new_piece(odometry):
    after = poses_towards_stairs(14)
    for frame in wall_frames(3, distance=1.5):
        odometry.track(frame)
    tracked = [odometry.track(frame) for frame in frames_at(after, first_ns=3 * PERIOD_NS)]
    states = [frame.state for frame in tracked]
    assert states[0] is TrackState.LOST
    assert tracked[0].piece_from_camera is None
    begin = states.index(TrackState.START)
    assert states[:begin] == begin * [TrackState.LOST]
    assert tracked[begin].piece == 1
    check_follows(tracked[begin:], after[begin:])


def test_a_pause_in_the_recording_begins_a_new_piece(odometry):
    frames = frames_at(poses_towards_stairs(2)) + frames_at(poses_towards_stairs(2), first_ns=5_000_000_000)
    assert [odometry.track(frame).piece for frame in frames] == [0, 0, 1, 1]


def test_points_lie_where_the_frame_has_them():
    frame = frames_at(poses_towards_stairs(1))[0]
    points = points_from_frame(frame)
    measured = frame.points()[frame.depth < 6.0]
    assert 1000 < len(points) <= len(measured)
    distance = np.linalg.norm(measured[None] - points[::200, None], axis=2).min(axis=1)
    assert distance.max() < 1e-4


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "small_gicp", None)
    with pytest.raises(MissingPackageError, match=r"small_gicp.*stairmap\[odometry\]"):
        DepthOdometry()
