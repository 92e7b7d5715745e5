"""What a live camera has shown, for the table and the results of the command."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA
from depth_drives import PERIOD_NS, STAIRS, empty_frame, frames_at, poses_towards_stairs
from stairmap.cli.live_session import LiveSession
from stairmap.config import Config
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.recordings.realsense import LiveFrame

pytest.importorskip("small_gicp")

POSES = poses_towards_stairs(6)
FRAMES = frames_at(POSES, camera=KINECT_CAMERA)


def session_of(frames, *, method="stairmap", num_skipped=0):
    session = LiveSession(Config(), method=method, with_odometry=True)
    for frame in frames:
        session.process(LiveFrame(frame=frame, num_skipped=num_skipped))
    return session


def with_up(frame, pose):
    return DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=pose[2, :3])


def test_the_accelerometer_levels_the_map():
    session = session_of([with_up(frame, pose) for frame, pose in zip(FRAMES, POSES, strict=True)])
    live_map = session.find_map()
    (stairway,) = live_map.stairways
    assert stairway.flights[0].rise == pytest.approx(STAIRS.rise, abs=0.008)
    up_seen = live_map.trajectory.map_from_camera[0, 2, :3]
    assert np.degrees(np.arccos(up_seen @ POSES[0, 2, :3])) < 0.5
    assert "level by the accelerometer in 6 frames" in live_map.notes[0]


def test_without_accelerometer_the_floor_levels_the_map():
    live_map = session_of(FRAMES).find_map()
    assert len(live_map.stairways) == 1
    up_seen = live_map.trajectory.map_from_camera[0, 2, :3]
    assert np.degrees(np.arccos(up_seen @ POSES[0, 2, :3])) < 1.5
    assert "level by the floor in 2 frames" in live_map.notes[0]


def test_skipped_frames_are_counted():
    assert session_of(FRAMES[:3], num_skipped=2).num_skipped == 6


def test_the_last_frame_with_stairs_is_remembered():
    session = session_of([*FRAMES[:3], empty_frame(3 * PERIOD_NS)])
    assert session.last_seen is not None
    assert session.last_seen.stamp_ns == FRAMES[2].stamp_ns
    assert session.collector.num_frames == 4


def test_two_frames_make_no_map():
    with pytest.raises(TrajectoryError, match="at least 3 frames, got 2"):
        session_of(FRAMES[:2]).find_map()


def test_a_map_without_floor_says_what_it_needs():
    close = [DepthFrame(stamp_ns=f.stamp_ns, depth=f.depth[::-1], camera=f.camera) for f in FRAMES]
    with pytest.raises(TrajectoryError, match=r"the floor told up in 0 of 6 frames.* let the camera see"):
        session_of(close).find_map()


def test_the_reports_method_works_live_too():
    session = session_of(FRAMES, method="delmerico2013")
    assert session.find_map().odometry.num_frames == 6
