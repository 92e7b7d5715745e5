"""A bag that lacks something, or holds something strange: one clear line, and what can be used is used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bag_files import DEPTH_TOPIC, INFO_TOPIC, Messages, Ros, robot_messages, write_bag, write_ordered_bag
from stairmap.errors import CalibrationError, RecordingError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.base import Recording
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording

ROS = Ros("mcap")
SECOND = 1_000_000_000


def opened(folder: Path, messages: Messages, **options: str) -> Recording:
    return open_recording(write_bag(folder, "mcap", ROS, messages), bag=BagOptions(**options))


def refusal(folder: Path, messages: Messages, **options: str) -> str:
    with pytest.raises(RecordingError) as caught:
        opened(folder, messages, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def without(walk: ImageFolderRecording, *topics: str) -> Messages:
    return [message for message in robot_messages(ROS, walk) if message[1] not in topics]


def shifted(messages: Messages, seconds: float, *topics: str) -> Messages:
    """The same again, recorded later; stamps stay."""
    return [(at + int(seconds * SECOND), topic, one) for at, topic, one in messages if topic in topics]


def test_bag_without_images_is_refused_with_its_topics(tmp_path: Path, walk: ImageFolderRecording) -> None:
    text = refusal(tmp_path, without(walk, DEPTH_TOPIC))
    assert text.startswith("no topic has depth images; there are: ")
    assert "/chatter (std_msgs/msg/String)" in text


def test_bag_with_colour_only_is_refused_with_the_encodings(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    colour = ROS.image(np.ones((4, 6)), 0)
    colour.encoding, colour.width = "rgb8", 4
    text = refusal(tmp_path, [*without(walk, DEPTH_TOPIC), (0, "/camera/color/image_raw", colour)])
    assert "there are images on: /camera/color/image_raw (rgb8)" in text
    text = refusal(
        tmp_path / "asked",
        [*without(walk), (0, "/camera/color/image_raw", colour)],
        depth_topic="/camera/color/image_raw",
    )
    assert text.startswith("topic /camera/color/image_raw: expected depth with encoding 16UC1 (mm)")
    assert "got 'rgb8'; is it a colour image?" in text


def test_several_depth_topics_must_be_chosen_from(tmp_path: Path, walk: ImageFolderRecording) -> None:
    messages = without(walk)
    text = refusal(tmp_path, [*messages, (0, "/rear/depth", messages[-1][2])])
    assert text.endswith(f"pass one of them with --depth-topic: {DEPTH_TOPIC}, /rear/depth")


def test_compressed_copy_of_the_depth_topic_is_no_second_one(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    frame = next(iter(walk))
    copy = (0, f"{DEPTH_TOPIC}/compressedDepth", ROS.compressed(frame.depth, 0))
    recording = opened(tmp_path, [*without(walk), copy])
    assert recording.num_frames == 4


def test_infrared_of_16_bits_is_not_taken_for_depth(tmp_path: Path, walk: ImageFolderRecording) -> None:
    infrared = ROS.image(np.ones((4, 4)), 0, encoding="mono16")
    recording = opened(tmp_path, [*without(walk), (0, "/camera/infra1/image_raw", infrared)])
    assert recording.num_frames == 4


def test_misspelt_topic_is_refused_with_the_nearest(tmp_path: Path, walk: ImageFolderRecording) -> None:
    text = refusal(tmp_path, without(walk), depth_topic="/camera/depth/image_rect")
    assert f"there is no such topic; did you mean {DEPTH_TOPIC}?" in text


def test_topic_of_another_type_is_refused_with_its_type(tmp_path: Path, walk: ImageFolderRecording) -> None:
    text = refusal(tmp_path, without(walk), depth_topic="/chatter")
    assert "expected a topic of type sensor_msgs/msg/Image or sensor_msgs/msg/CompressedImage, it is" in text


def test_bag_without_camera_info_is_refused_with_what_to_do(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    text = refusal(tmp_path, without(walk, INFO_TOPIC))
    assert text.startswith(f"topic {DEPTH_TOPIC} has no CameraInfo, nor has any other")
    assert "--camera camera.json" in text


def test_camera_info_that_could_be_either_must_be_chosen(tmp_path: Path, walk: ImageFolderRecording) -> None:
    infos = [(0, f"/{name}/camera_info", ROS.camera_info(walk.camera, 0)) for name in ("a", "b")]
    text = refusal(tmp_path, [*without(walk, INFO_TOPIC), *infos])
    assert text.endswith("pass one of them with --camera-info-topic: /a/camera_info, /b/camera_info")


def test_camera_info_of_another_camera_is_refused_with_both_sizes(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    info = ROS.camera_info(replace(walk.camera, width=1280, height=720), 0)
    with pytest.raises(CalibrationError) as caught:
        opened(tmp_path, [*without(walk, INFO_TOPIC), (0, INFO_TOPIC, info)])
    assert "is for images of 1280x720, but the depth images are 320x240" in str(caught.value)


def test_metres_that_are_millimetres_are_refused(tmp_path: Path, walk: ImageFolderRecording) -> None:
    frame = next(iter(walk))
    image = ROS.image(frame.depth * np.float32(1000), 0, encoding="32FC1")
    with pytest.raises(CalibrationError, match=r"expected a median depth of 0\.1 to 50 m, got"):
        opened(tmp_path, [*without(walk, DEPTH_TOPIC), (0, DEPTH_TOPIC, image)])


def test_images_of_another_size_are_skipped_and_named(tmp_path: Path, walk: ImageFolderRecording) -> None:
    small = ROS.image(np.full((120, 160), 2.0), 150_000_000)
    recording = opened(tmp_path, [*without(walk), (155_000_000, DEPTH_TOPIC, small)])
    assert sum(1 for _ in recording) == 4
    assert recording.num_frames == 5
    (skipped,) = recording.problems.skipped
    assert skipped.stamp_ns == 150_000_000
    assert skipped.reason == "the image is 160x120, the first one and its camera are 320x240"


def test_damaged_image_is_skipped_and_named(tmp_path: Path, walk: ImageFolderRecording) -> None:
    broken = ROS.image(np.full((240, 320), 2.0), 150_000_000)
    broken.data = broken.data[:1000]
    recording = opened(tmp_path, [*without(walk), (155_000_000, DEPTH_TOPIC, broken)])
    assert sum(1 for _ in recording) == 4
    assert "cannot have 1000 bytes" in recording.problems.skipped[0].reason


def test_image_whose_stamp_repeats_or_goes_back_a_little_is_skipped(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    late = ROS.image(np.full((240, 320), 2.0), 150_000_000)
    again = ROS.image(np.full((240, 320), 2.0), 300_000_000)
    messages = [*without(walk), (290_000_000, DEPTH_TOPIC, late), (400_000_000, DEPTH_TOPIC, again)]
    recording = opened(tmp_path, [*messages, (225_000_000, DEPTH_TOPIC, late)])
    frames = list(recording)
    assert [frame.stamp_ns for frame in frames] == [0, 100_000_000, 200_000_000, 300_000_000]
    assert recording.num_frames == 7
    assert all("its stamp is not after" in skipped.reason for skipped in recording.problems.skipped)
    assert recording.problems.num_frames_without_pose == 0


def test_clock_that_is_set_back_leaves_the_longest_stretch_with_its_own_poses(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    """A simulator that is reset: the second run's transforms must not move the first run's frames."""
    messages = without(walk)
    before = [
        (8 * SECOND, "/tf", ROS.tf(8 * SECOND, ("odom", "base_link", np.eye(4)))),
        (9 * SECOND, DEPTH_TOPIC, ROS.image(np.full((240, 320), 2.0), 9 * SECOND)),
    ]
    after = shifted(messages, 10.0, DEPTH_TOPIC, INFO_TOPIC, "/tf")
    static = [message for message in messages if message[1] == "/tf_static"]
    recording = opened(tmp_path, [*static, (0, INFO_TOPIC, ROS.camera_info(walk.camera, 0)), *before, *after])
    assert [frame.stamp_ns for frame in recording] == [0, 100_000_000, 200_000_000, 300_000_000]
    np.testing.assert_allclose(
        recording.check_poses().map_from_camera, walk.check_poses().map_from_camera, atol=1e-6
    )
    assert (
        f"the clock of {DEPTH_TOPIC} was set back 1 time; of its 5 images the 4 of the longest stretch are "
        "used" in recording.problems.notes
    )


@pytest.mark.parametrize("kind", ["ros1", "sqlite", "mcap"])
def test_clock_set_back_is_told_where_messages_are_filed_under_simulated_time(
    tmp_path: Path, walk: ImageFolderRecording, kind: str
) -> None:
    """The index sorts two drives into each other; the order in the file tells them apart."""
    ros = Ros(kind)
    before = []
    for stamp_ns in (SECOND // 10, 12 * SECOND // 10):
        before.append((stamp_ns, "/tf", ros.tf(stamp_ns, ("odom", "base_link", np.eye(4)))))
        before.append((stamp_ns, DEPTH_TOPIC, ros.image(np.full((240, 320), 2.0), stamp_ns)))
    messages = robot_messages(ros, walk)
    static = [one for one in messages if one[1] == "/tf_static"]
    after = sorted((one for one in messages if one[1] != "/tf_static"), key=lambda one: one[0])
    path = write_ordered_bag(tmp_path, kind, ros, [*static, *before, *after])
    recording = open_recording(path)
    assert [frame.stamp_ns for frame in recording] == [0, 100_000_000, 200_000_000, 300_000_000]
    np.testing.assert_allclose(
        recording.check_poses().map_from_camera, walk.check_poses().map_from_camera, atol=1e-6
    )
    assert any("was set back 1 time; of its 6 images the 4" in note for note in recording.problems.notes)


def test_depth_that_stops_half_way_is_noted(tmp_path: Path, walk: ImageFolderRecording) -> None:
    later = (5 * SECOND, "/tf", ROS.tf(5 * SECOND, ("odom", "base_link", np.eye(4))))
    recording = opened(tmp_path, [*without(walk), later])
    assert f"{DEPTH_TOPIC} ends 4.7 s before the bag does" in recording.problems.notes
    assert sum(1 for _ in recording) == 4


def test_up_needs_poses_and_trajectory_replaces_them(tmp_path: Path, walk: ImageFolderRecording) -> None:
    path = write_bag(tmp_path, "mcap", ROS, without(walk, "/tf"))
    with pytest.raises(RecordingError, match=r"--up -y names an axis of the map, but .* has no poses"):
        open_recording(path, up="-y")
    with pytest.raises(RecordingError, match="leave --pose-topic and --map-frame out"):
        open_recording(path, trajectory=tmp_path / "a.tum", bag=BagOptions(map_frame="map"))


def test_options_of_bags_are_refused_for_image_folders(walk: ImageFolderRecording) -> None:
    with pytest.raises(RecordingError, match="topics and coordinate frames are those of bags"):
        open_recording(walk._folder, bag=BagOptions(depth_topic="/depth"))


def test_folder_of_several_ros1_bags_is_refused_with_their_names(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    ros = Ros("ros1")
    path = write_bag(tmp_path, "ros1", ros, robot_messages(ros, walk))
    path.with_name("other.bag").write_bytes(path.read_bytes())
    with pytest.raises(RecordingError, match=r"has 2: other\.bag, walk\.bag; pass one of them"):
        open_recording(tmp_path)
