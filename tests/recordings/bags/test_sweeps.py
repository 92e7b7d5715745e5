"""Bags with the sweeps of a LiDAR."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bag_files import Messages, Ros, write_bag
from cloud_bags import CLOUD_TOPIC, cloud_message, livox_message, ros_cloud
from stairmap.errors import RecordingError, TrajectoryError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.sweeps import MAX_POSE_GAP_NS, SweepRecording
from stairmap.recordings.open import open_recording
from stairmap.sweep import straightened
from stairmap.transforms import rotation_from_vector, transform_from_parts

START_NS = 1_000_000_000
SWEEP_NS = 100_000_000
NUM_SWEEPS = 4
BASE_FROM_LIDAR = transform_from_parts(np.eye(3), [0.2, 0.0, 0.4])
WALL = np.random.default_rng(0).uniform([3, -1, 0], [3, 1, 2], (200, 3))
OFFSETS_NS = np.linspace(0, 99_000_000, len(WALL)).astype(np.int64)


def pose_at(stamp_ns: float) -> np.ndarray:
    """A robot that turns by 1 rad/s while it drives."""
    seconds = (stamp_ns - START_NS) * 1e-9
    return transform_from_parts(rotation_from_vector([0, 0, seconds]), [0.5 * seconds, 0.0, 0.0])


def seen(stamp_ns: int) -> np.ndarray:
    """The wall as the LiDAR sees each of its points at that point's time."""
    points = np.empty((len(WALL), 3))
    for index, (point, offset) in enumerate(zip(WALL, OFFSETS_NS, strict=True)):
        lidar = pose_at(stamp_ns + offset) @ BASE_FROM_LIDAR
        points[index] = lidar[:3, :3].T @ (point - lidar[:3, 3])
    return points.astype(np.float32)


def sweep_messages(ros: Ros, *, is_livox: bool = False, with_times: bool = True) -> Messages:
    messages: Messages = []
    for index in range(NUM_SWEEPS):
        stamp_ns = START_NS + index * SWEEP_NS
        points = seen(stamp_ns)
        if is_livox:
            message = livox_message(ros, points, OFFSETS_NS, stamp_ns)
        else:
            columns = {axis: points[:, column] for column, axis in enumerate("xyz")}
            columns |= {"t": OFFSETS_NS} if with_times else {}
            cloud = cloud_message(columns, kinds={"t": "u4"})
            message = ros_cloud(ros, cloud, stamp_ns, "livox_frame")
        messages.append((stamp_ns + SWEEP_NS, CLOUD_TOPIC, message))
    return messages


def transform_messages(ros: Ros) -> Messages:
    messages: Messages = [(0, "/tf_static", ros.tf(0, ("base_link", "livox_frame", BASE_FROM_LIDAR)))]
    for step in range(NUM_SWEEPS * 10 + 1):
        stamp_ns = START_NS + step * SWEEP_NS // 10
        messages.append((stamp_ns, "/tf", ros.tf(stamp_ns, ("odom", "base_link", pose_at(stamp_ns)))))
    return messages


@pytest.mark.parametrize("is_livox", [False, True], ids=["PointCloud2", "CustomMsg"])
@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_wall_that_was_measured_while_turning_is_straight(
    tmp_path: Path, kind: str, is_livox: bool
) -> None:
    ros = Ros(kind)
    messages = [*transform_messages(ros), *sweep_messages(ros, is_livox=is_livox)]
    recording = SweepRecording(write_bag(tmp_path, kind, ros, messages))
    path = recording.check_poses()
    sweeps = list(recording)
    assert [sweep.stamp_ns for sweep in sweeps] == recording.stamps_ns.tolist()
    assert len(sweeps) == recording.num_sweeps == NUM_SWEEPS
    assert recording.frame_id == "odom"
    assert not recording.problems
    for sweep in sweeps:
        points, has_pose = straightened(sweep, path, max_gap_ns=MAX_POSE_GAP_NS)
        assert has_pose.all()
        # A point shares its pose with those of its millisecond, in which 3 m of lever turn by 3 mm.
        np.testing.assert_allclose(points, WALL, atol=0.003)


def test_without_times_a_sweep_is_used_as_it_is_and_that_is_said(tmp_path: Path) -> None:
    ros = Ros("mcap")
    messages = [*transform_messages(ros), *sweep_messages(ros, with_times=False)]
    recording = SweepRecording(write_bag(tmp_path, "mcap", ros, messages))
    assert "carry no times" in recording.problems.notes[0]
    sweep = next(iter(recording))
    points, _ = straightened(sweep, recording.check_poses(), max_gap_ns=MAX_POSE_GAP_NS)
    assert np.abs(points - WALL).max() > 0.05


def test_poses_may_be_odometry_of_the_base(tmp_path: Path) -> None:
    ros = Ros("mcap")
    static = transform_messages(ros)[:1]
    odometry = [
        (stamp_ns, "/odom", ros.odometry(stamp_ns, "odom", "base_link", pose_at(stamp_ns)))
        for stamp_ns in range(START_NS, START_NS + NUM_SWEEPS * SWEEP_NS + 1, SWEEP_NS // 5)
    ]
    recording = SweepRecording(write_bag(tmp_path, "mcap", ros, [*static, *odometry, *sweep_messages(ros)]))
    points, _ = straightened(next(iter(recording)), recording.check_poses(), max_gap_ns=MAX_POSE_GAP_NS)
    np.testing.assert_allclose(points, WALL, atol=0.003)


def test_without_poses_the_message_says_what_gives_them(tmp_path: Path) -> None:
    ros = Ros("mcap")
    recording = SweepRecording(write_bag(tmp_path, "mcap", ros, sweep_messages(ros)))
    with pytest.raises(TrajectoryError, match=r"neither transforms nor odometry.*pass --trajectory"):
        recording.check_poses()


def test_of_several_clouds_the_user_names_one(tmp_path: Path) -> None:
    ros = Ros("mcap")
    messages = [*transform_messages(ros), *sweep_messages(ros)]
    messages += [(stamp, "/other", message) for stamp, topic, message in messages if topic == CLOUD_TOPIC]
    bag = write_bag(tmp_path, "mcap", ros, messages)
    with pytest.raises(RecordingError, match=r"2 topics with point clouds.*--cloud-topic: /other, /points"):
        SweepRecording(bag)
    assert SweepRecording(bag, options=BagOptions(cloud_topic=CLOUD_TOPIC)).num_sweeps == NUM_SWEEPS
    with pytest.raises(RecordingError, match="did you mean /points"):
        SweepRecording(bag, options=BagOptions(cloud_topic="/pints"))


def test_who_asks_for_depth_in_a_bag_of_clouds_is_told_what_reads_them(tmp_path: Path) -> None:
    ros = Ros("mcap")
    bag = write_bag(tmp_path, "mcap", ros, [*transform_messages(ros), *sweep_messages(ros)])
    with pytest.raises(RecordingError, match=r"no topic has depth images.* with --cloud-topic$"):
        open_recording(bag)


def test_a_damaged_sweep_is_skipped_with_its_reason(tmp_path: Path) -> None:
    ros = Ros("mcap")
    messages = [*transform_messages(ros), *sweep_messages(ros)]
    messages[-2][2].data = messages[-2][2].data[:100]
    recording = SweepRecording(write_bag(tmp_path, "mcap", ros, messages))
    assert len(list(recording)) == NUM_SWEEPS - 1
    assert "it was cut off" in recording.problems.skipped[0].reason


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_livox_message_that_is_cut_off_is_skipped(tmp_path: Path, kind: str) -> None:
    ros = Ros(kind)
    messages = [*transform_messages(ros), *sweep_messages(ros, is_livox=True)]
    recording = SweepRecording(write_bag(tmp_path, kind, ros, messages))
    message = next(recording._messages())
    for length in (10, 40, len(message.data) - 10):
        with pytest.raises(RecordingError):
            recording._decode(replace(message, data=message.data[:length]))


def test_a_livox_without_a_synchronised_clock_begins_at_its_stamp(tmp_path: Path) -> None:
    ros = Ros("mcap")
    points = seen(START_NS)
    message = livox_message(ros, points, OFFSETS_NS, 10**18, timebase=123)
    bag = write_bag(tmp_path, "mcap", ros, [(START_NS, CLOUD_TOPIC, message)])
    (sweep,) = SweepRecording(bag)
    np.testing.assert_array_equal(sweep.offsets_ns, OFFSETS_NS)


def test_up_from_the_floor_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="--up auto asks the floor in depth images"):
        SweepRecording(tmp_path, up="auto")
