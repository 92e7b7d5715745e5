"""A map from a camera without poses: level by the accelerometer or by the floor, its drift known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA
from depth_drives import STAIRS, frames_at, poses_towards_stairs
from stairmap import odometry_session
from stairmap.config import Config
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.odometry_session import OdometrySession
from stairmap.recordings.registration import TrackedFrame, TrackState
from stairmap.transforms import invert_transform

pytest.importorskip("small_gicp")

POSES = poses_towards_stairs(6)
FRAMES = frames_at(POSES, camera=KINECT_CAMERA)


def session_of(frames, config=None):
    session = OdometrySession(config)
    for frame in frames:
        session.add(frame)
    return session


def with_up(frame, pose):
    return DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=pose[2, :3])


def test_the_map_holds_the_stairs_and_is_level_by_the_accelerometer():
    found = session_of([with_up(frame, pose) for frame, pose in zip(FRAMES, POSES, strict=True)]).find_map()
    (stairway,) = found.stairways
    assert stairway.flights[0].rise == pytest.approx(STAIRS.rise, abs=0.008)
    assert stairway.num_observations == 6
    up_seen = found.trajectory.map_from_camera[0, 2, :3]
    assert np.degrees(np.arccos(up_seen @ POSES[0, 2, :3])) < 0.5
    assert "level by the accelerometer in 6 frames" in found.notes[0]


def test_the_drift_of_the_poses_widens_the_place_unless_it_is_configured():
    measured = session_of(FRAMES).find_map()
    assert measured.config.modeling.pose_drift >= 0.04
    config = Config.model_validate({"modeling": {"pose_drift": 0.0, "pose_heading_drift_deg": 0.0}})
    configured = session_of(FRAMES, config).find_map()
    assert configured.config.modeling.pose_drift == 0.0
    (wide,), (narrow,) = measured.stairways, configured.stairways
    assert (wide.flights[0].std.base > narrow.flights[0].std.base).any()


class ForgetfulOdometry:
    """The true way, but for one frame that it cannot place."""

    lost = 3

    def track(self, frame):
        index = frame.stamp_ns // 40_000_000
        state = {0: TrackState.START, self.lost: TrackState.LOST}.get(index, TrackState.TRACKED)
        pose = None if index == self.lost else invert_transform(POSES[0]) @ POSES[index]
        return TrackedFrame(stamp_ns=frame.stamp_ns, state=state, piece=0, piece_from_camera=pose)


FRAMES_CLOSE = [
    replace(with_up(frame, POSES[index]), stamp_ns=40_000_000 * index) for index, frame in enumerate(FRAMES)
]
"""Two frames apart, a pose may still be interpolated."""


def test_a_frame_that_fits_nowhere_is_looked_at_and_not_mapped(monkeypatch):
    monkeypatch.setattr(odometry_session, "DepthOdometry", ForgetfulOdometry)
    session = OdometrySession()
    detections = [session.add(frame) for frame in FRAMES_CLOSE]
    assert all(detections)
    found = session.find_map()
    assert len(found.trajectory) == 5
    assert found.trajectory.has_pose(np.array([FRAMES_CLOSE[3].stamp_ns])).all()
    (stairway,) = found.stairways
    assert stairway.num_observations == 5


def test_the_last_frame_knows_up_from_the_floor_of_those_before():
    session = session_of(FRAMES[:2])
    assert session.last_frame is not None
    assert FRAMES[1].up is None
    assert np.degrees(np.arccos(session.last_frame.up @ POSES[1, 2, :3])) < 1.5


def test_two_frames_make_no_map():
    with pytest.raises(TrajectoryError, match="at least 3 frames, got 2"):
        session_of(FRAMES[:2]).find_map()
