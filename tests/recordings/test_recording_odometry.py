"""A recording without poses gets some from its depth, and says how good they are."""

from __future__ import annotations

import numpy as np
import pytest

from depth_drives import CAMERA, PERIOD_NS, empty_frame, frames_at, poses_towards_stairs
from stairmap.errors import RecordingError, TrajectoryError
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.recordings.odometry import OdometryRecording, check_no_trajectory
from stairmap.recordings.odometry_pieces import DRIFT
from stairmap.recordings.open import open_recording

POSES = poses_towards_stairs(6)


@pytest.fixture
def make_opened(tmp_path):
    pytest.importorskip("small_gicp")

    def make(frames, *, up=None):
        with ImageFolderWriter(tmp_path / "walk", CAMERA, depth_scale=5000.0, up=up) as writer:
            for frame in frames:
                writer.write(frame)
        return open_recording(tmp_path / "walk")

    return make


def test_every_frame_of_a_drive_gets_a_pose(make_opened):
    seen = []
    recording = OdometryRecording(make_opened(frames_at(POSES)), on_frame=lambda: seen.append(1))
    assert len(seen) == 6
    trajectory = recording.check_poses()
    assert len(trajectory) == 6
    way = np.linalg.norm(trajectory.map_from_camera[-1, :3, 3])
    assert way == pytest.approx(np.linalg.norm(POSES[-1, :3, 3] - POSES[0, :3, 3]), abs=0.02)
    assert recording.odometry.drift == DRIFT
    assert "6 of 6 frames" in recording.problems.notes[0]


def test_without_up_the_floor_is_to_tell(make_opened):
    recording = OdometryRecording(make_opened(frames_at(POSES)))
    assert recording.up == "auto"
    assert all(frame.up is None for frame in recording)


def test_up_of_the_camera_file_levels_the_map(make_opened):
    recording = OdometryRecording(make_opened(frames_at(POSES), up=POSES[0, 2, :3]))
    assert recording.up is None
    ups = [frame.up for frame in recording]
    assert np.degrees(np.arccos(ups[0] @ POSES[0, 2, :3])) < 0.01
    assert np.degrees(np.arccos(ups[-1] @ POSES[-1, 2, :3])) < 1.0


def test_a_named_axis_is_one_of_the_first_camera(make_opened):
    recording = OdometryRecording(make_opened(frames_at(POSES)), up="-y")
    assert np.allclose(next(iter(recording)).up, [0, -1, 0])
    assert np.allclose(recording.map_from_recorded[:3, :3] @ [0, -1, 0], [0, 0, 1])


def test_a_frame_without_depth_is_without_pose_and_counted(make_opened):
    frames = frames_at(POSES)
    frames[3] = empty_frame(3 * PERIOD_NS)
    recording = OdometryRecording(make_opened(frames))
    assert recording.problems.num_frames_without_pose == 1
    assert "1 of 6 frames have no pose: 1 had too few points" in recording.problems.notes[1]


def test_a_recording_of_nothing_has_no_poses_and_says_what_helps(make_opened):
    frames = [empty_frame(index * PERIOD_NS) for index in range(4)]
    frames[0] = frames_at(POSES[:1])[0]
    with pytest.raises(TrajectoryError, match=r"of 4 frames 3 have too few points .* --trajectory"):
        OdometryRecording(make_opened(frames))


def test_poses_from_a_file_and_from_depth_are_not_both_taken():
    check_no_trajectory(False)
    with pytest.raises(RecordingError, match="--trajectory or --odometry, got both"):
        check_no_trajectory(True)


def test_a_single_image_has_no_motion(make_opened):
    with pytest.raises(TrajectoryError, match="at least 3 frames, got 1; look at single frames"):
        OdometryRecording(make_opened(frames_at(POSES[:1])))
