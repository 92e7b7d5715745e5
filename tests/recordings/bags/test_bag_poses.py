"""Where the camera was, from transforms, odometry or stamped poses; what is missing is said by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bag_files import (
    OPTICAL,
    Messages,
    Ros,
    base_poses,
    depth_messages,
    robot_messages,
    static_messages,
    transform_messages,
    write_bag,
)
from small_recordings import write_recording
from stairmap.errors import TrajectoryError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.base import Recording
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording
from stairmap.transforms import transform_from_parts

ROS = Ros("mcap")


def opened(folder: Path, messages: Messages, **options: str) -> Recording:
    return open_recording(write_bag(folder, "mcap", ROS, messages), bag=BagOptions(**options))


def check_poses(recording: Recording, walk: ImageFolderRecording) -> None:
    np.testing.assert_allclose(
        recording.check_poses().map_from_camera, walk.check_poses().map_from_camera, atol=1e-6
    )
    assert recording.problems.num_frames_without_pose == 0


def odometry_messages(walk: ImageFolderRecording, *, topic: str = "/odom", parent: str = "odom") -> Messages:
    return [
        (stamp_ns, topic, ROS.odometry(stamp_ns, parent, "base_link", pose))
        for stamp_ns, pose in base_poses(walk)
    ]


def refusal(recording: Recording) -> str:
    with pytest.raises(TrajectoryError) as caught:
        recording.check_poses()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_odometry_gives_poses_of_the_base_and_the_mount_those_of_the_camera(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    messages = [*odometry_messages(walk), *static_messages(ROS), *depth_messages(ROS, walk)]
    recording = opened(tmp_path, messages)
    check_poses(recording, walk)
    assert recording.frame_id == "odom"


def test_odometry_of_the_camera_itself_needs_no_mount(tmp_path: Path, walk: ImageFolderRecording) -> None:
    trajectory = walk.check_poses()
    poses = zip(trajectory.stamps_ns.tolist(), trajectory.map_from_camera, strict=True)
    messages = [
        (stamp_ns, "/vio", ROS.odometry(stamp_ns, "world", f"/{OPTICAL}", pose)) for stamp_ns, pose in poses
    ]
    recording = opened(tmp_path, [*messages, *depth_messages(ROS, walk)])
    check_poses(recording, walk)
    assert recording.frame_id == "world"


def test_transforms_are_preferred_and_a_topic_can_be_chosen(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    messages = [*odometry_messages(walk, parent="wheels"), *robot_messages(ROS, walk)]
    assert opened(tmp_path / "a", messages).frame_id == "map"
    chosen = opened(tmp_path / "b", messages, pose_topic="/odom")
    check_poses(chosen, walk)
    assert chosen.frame_id == "wheels"
    check_poses(opened(tmp_path / "c", messages, pose_topic="/tf"), walk)


def test_stamped_poses_are_those_of_what_the_camera_is_fixed_to(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    messages = [
        (stamp_ns, "/pose", ROS.pose_stamped(stamp_ns, "map", pose)) for stamp_ns, pose in base_poses(walk)
    ]
    recording = opened(tmp_path, [*messages, *static_messages(ROS), *depth_messages(ROS, walk)])
    check_poses(recording, walk)
    assert "/pose does not say whose poses it has; they are taken for those of base_link" in (
        recording.problems.notes
    )


def test_stamped_poses_without_transforms_are_the_cameras(tmp_path: Path, walk: ImageFolderRecording) -> None:
    trajectory = walk.check_poses()
    poses = zip(trajectory.stamps_ns.tolist(), trajectory.map_from_camera, strict=True)
    messages = [(stamp_ns, "/pose", ROS.pose_stamped(stamp_ns, "map", pose)) for stamp_ns, pose in poses]
    recording = opened(tmp_path, [*messages, *depth_messages(ROS, walk)])
    check_poses(recording, walk)
    assert f"taken for those of {OPTICAL}" in recording.problems.notes[0]


def test_two_topics_with_poses_must_be_chosen_from(tmp_path: Path, walk: ImageFolderRecording) -> None:
    messages = [
        *odometry_messages(walk),
        *odometry_messages(walk, topic="/wheels"),
        *static_messages(ROS),
        *depth_messages(ROS, walk),
    ]
    text = refusal(opened(tmp_path, messages))
    assert "several topics have poses: /odom, /wheels; pass one of them with --pose-topic" in text


def test_joints_that_do_not_carry_the_camera_do_not_matter(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    legs = [
        (stamp_ns, "/tf", ROS.tf(stamp_ns, ("base_link", f"leg_{leg}", np.eye(4))))
        for stamp_ns in range(0, 300_000_000, 10_000_000)
        for leg in range(4)
    ]
    recording = opened(tmp_path, [*legs, *robot_messages(ROS, walk)])
    check_poses(recording, walk)


def test_bag_without_poses_can_be_looked_at_and_run_says_what_gives_them(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    recording = opened(tmp_path, depth_messages(ROS, walk))
    assert recording.trajectory is None
    assert recording.problems.num_frames_without_pose == 4
    assert [frame.up for frame in recording] == [None] * 4
    text = refusal(recording)
    assert "the bag has neither transforms nor odometry nor stamped poses" in text
    assert "pass --trajectory FILE (TUM format), or --odometry to find them from the depth" in text


def test_missing_mount_is_told_with_the_coordinate_frames_there_are(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    messages = [*transform_messages(ROS, walk), *depth_messages(ROS, walk)]
    text = refusal(opened(tmp_path / "a", messages))
    assert f"no transform names the depth images' coordinate frame {OPTICAL}" in text
    assert "the coordinate frames are: base_link, map, odom, and there is no /tf_static" in text
    text = refusal(opened(tmp_path / "b", [*messages, *odometry_messages(walk)], pose_topic="/odom"))
    assert "/odom has poses of base_link, but no transform tells where on it the camera" in text


def test_mount_without_anything_that_moves_is_told(tmp_path: Path, walk: ImageFolderRecording) -> None:
    text = refusal(opened(tmp_path, [*static_messages(ROS), *depth_messages(ROS, walk)]))
    assert f"{OPTICAL} is fixed to base_link, and nothing tells where that moves" in text
    assert "the coordinate frames are: base_link, camera_depth_optical_frame, camera_link" in text


def test_map_that_is_not_there_is_told_with_those_that_are(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    with pytest.raises(TrajectoryError) as caught:
        opened(tmp_path, robot_messages(ROS, walk), map_frame="world")
    assert (
        "--map-frame world: there is no such coordinate frame; the coordinate frames are: base_link,"
        in str(caught.value)
    )


def test_map_that_is_not_connected_is_told(tmp_path: Path, walk: ImageFolderRecording) -> None:
    other = (0, "/tf_static", ROS.tf(0, ("world", "tower", np.eye(4))))
    text = refusal(opened(tmp_path, [*robot_messages(ROS, walk), other], map_frame="world"))
    assert f"the coordinate frames world and {OPTICAL} are not connected" in text


def test_map_may_be_another_thing_that_moves(tmp_path: Path, walk: ImageFolderRecording) -> None:
    others = [
        (stamp_ns, "/tf", ROS.tf(stamp_ns, ("map", "cart", transform_from_parts(np.eye(3), [1, 2, 3]))))
        for stamp_ns in walk._stamps_ns.tolist()
    ]
    recording = opened(tmp_path, [*others, *robot_messages(ROS, walk)], map_frame="cart")
    shift = walk.check_poses().map_from_camera[:, :3, 3] - recording.check_poses().map_from_camera[:, :3, 3]
    np.testing.assert_allclose(shift, [[1, 2, 3]] * 4, atol=1e-6)


def test_fixed_camera_has_the_pose_of_its_tripod(tmp_path: Path, walk: ImageFolderRecording) -> None:
    tripod = (0, "/tf_static", ROS.tf(0, ("map", "base_link", transform_from_parts(np.eye(3), [7, 0, 0]))))
    recording = opened(tmp_path, [*static_messages(ROS), tripod, *depth_messages(ROS, walk)])
    assert recording.check_poses().map_from_camera[:, 0, 3] == pytest.approx([7.1] * 4)


def test_gap_in_the_transforms_costs_the_frames_in_it(tmp_path: Path) -> None:
    walk = ImageFolderRecording(write_recording(tmp_path / "images", num_frames=8))

    def is_kept(message: tuple[int, str, object]) -> bool:
        return message[1] != "/tf" or not 100_000_000 <= message[0] <= 600_000_000

    recording = opened(tmp_path, list(filter(is_kept, robot_messages(ROS, walk))))
    assert recording.problems.num_frames_without_pose == 6
    assert "6 of 8 frames have no pose: 6 between poses more than 0.1 s apart" in recording.problems.notes
    assert (
        "no transform from base_link to odom at 0.100 s: there is a gap of 0.700 s around it"
        in (recording.problems.notes[1])
    )
    assert [frame.stamp_ns for frame in recording] == walk._stamps_ns.tolist()


def test_transforms_at_5_hz_give_every_frame_its_pose(tmp_path: Path) -> None:
    walk = ImageFolderRecording(write_recording(tmp_path / "images", num_frames=7))

    def is_kept(message: tuple[int, str, object]) -> bool:
        return message[1] != "/tf" or message[0] % 200_000_000 == 0

    recording = opened(tmp_path, list(filter(is_kept, robot_messages(ROS, walk))))
    assert recording.problems.num_frames_without_pose == 0


def test_transforms_that_stop_half_way_cost_the_frames_after(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    messages = [one for one in robot_messages(ROS, walk) if one[1] != "/tf" or one[0] < 200_000_000]
    recording = opened(tmp_path, messages)
    assert "2 of 4 frames have no pose: 2 after the last pose" in recording.problems.notes
    assert len(recording.check_poses()) == 2


def test_poses_that_are_no_rotation_are_left_out_and_counted(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    message = ROS.tf(150_000_000, ("odom", "base_link", np.eye(4)))
    message.transforms[0].transform.rotation.w = 0.0
    recording = opened(tmp_path, [*robot_messages(ROS, walk), (150_000_000, "/tf", message)])
    check_poses(recording, walk)
    assert "1 transforms are not used: their quaternion is not of unit length" in recording.problems.notes


def test_two_publishers_of_one_transform_are_noted(tmp_path: Path, walk: ImageFolderRecording) -> None:
    other = (50_000_000, "/tf", ROS.tf(50_000_000, ("vicon", "base_link", np.eye(4))))
    recording = opened(tmp_path, [*robot_messages(ROS, walk), other])
    assert "base_link has more than one parent, odom and vicon" in recording.problems.notes[0]
    assert recording.problems.num_frames_without_pose == 0
