"""A bag gives the frames and poses that were put into it, whatever its format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bag_files
from bag_files import DEPTH_TOPIC, OPTICAL, Ros, robot_messages, write_bag
from small_recordings import write_recording
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.recording import BagRecording
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording

NUM_FRAMES = 4


def make_bag(folder: Path, kind: str, walk: ImageFolderRecording, **options: Any) -> Path:
    ros = Ros(kind)
    return write_bag(folder, kind, ros, robot_messages(ros, walk, **options))


def check_same(path: Path, walk: ImageFolderRecording, *, options: BagOptions | None = None) -> None:
    recording = open_recording(path, bag=options)
    frames = list(recording)
    assert len(frames) == recording.num_frames == NUM_FRAMES
    assert recording.camera == walk.camera
    assert recording.time_range_ns == walk.time_range_ns
    assert recording.problems.num_frames_without_pose == 0
    assert recording.problems.to_lines() == ()
    trajectory = recording.check_poses()
    for mine, true in zip(frames, walk, strict=True):
        assert mine.stamp_ns == true.stamp_ns
        np.testing.assert_array_equal(mine.depth, true.depth)
        assert mine.up == pytest.approx(true.up, abs=1e-6)
    np.testing.assert_allclose(trajectory.map_from_camera, walk.check_poses().map_from_camera, atol=1e-6)


@pytest.mark.parametrize("kind", bag_files.KINDS)
def test_every_format_gives_what_was_put_in(tmp_path: Path, kind: str, walk: ImageFolderRecording) -> None:
    path = make_bag(tmp_path, kind, walk)
    check_same(path, walk)
    recording = open_recording(path)
    assert recording.name == "walk"
    assert recording.frame_id == "map"


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
@pytest.mark.parametrize(
    "options",
    [{"is_bigendian": True}, {"padding": 6}, {"encoding": "mono16"}, {"encoding": "32FC1"}],
    ids=str,
)
def test_every_encoding_gives_the_same_depth(
    tmp_path: Path, kind: str, options: dict[str, Any], walk: ImageFolderRecording
) -> None:
    check_same(make_bag(tmp_path, kind, walk, **options), walk)


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1"])
def test_compressed_depth_gives_the_same_up_to_its_quantisation(
    tmp_path: Path, encoding: str, walk: ImageFolderRecording
) -> None:
    ros = Ros("mcap")
    messages = [
        (stamp_ns, f"{DEPTH_TOPIC}/compressedDepth", ros.compressed(frame.depth, stamp_ns, encoding=encoding))
        for frame in walk
        for stamp_ns in [frame.stamp_ns]
    ]
    others = [message for message in robot_messages(ros, walk) if message[1] != DEPTH_TOPIC]
    recording = open_recording(write_bag(tmp_path, "mcap", ros, [*messages, *others]))
    for mine, true in zip(recording, walk, strict=True):
        limit = 0.0 if encoding == "16UC1" else np.nanmax(true.depth) ** 2 / (100 * 101)
        np.testing.assert_allclose(mine.depth, true.depth, atol=limit, rtol=0)
    assert recording.problems.num_frames_without_pose == 0


def test_frames_can_be_read_again_and_again(tmp_path: Path, walk: ImageFolderRecording) -> None:
    recording = open_recording(make_bag(tmp_path, "sqlite", walk))
    first = [frame.stamp_ns for frame in recording]
    half = [frame.stamp_ns for frame, _ in zip(recording, range(2), strict=False)]
    assert half == first[:2]
    assert [frame.stamp_ns for frame in recording] == first


def test_metadata_file_stands_for_its_folder(tmp_path: Path, walk: ImageFolderRecording) -> None:
    check_same(make_bag(tmp_path, "sqlite", walk) / "metadata.yaml", walk)


def test_own_trajectory_replaces_the_bags_poses(tmp_path: Path, walk: ImageFolderRecording) -> None:
    path = make_bag(tmp_path, "mcap", walk)
    poses = tmp_path / "slam.tum"
    poses.write_text("".join(f"{index / 10} 0 0 5 0 0 0 1\n" for index in range(NUM_FRAMES)))
    recording = open_recording(path, trajectory=poses)
    assert recording.check_poses().map_from_camera[:, 2, 3].tolist() == [5.0] * NUM_FRAMES
    turned = open_recording(path, trajectory=poses, up="-y")
    assert turned.check_poses().map_from_camera[0, :3, 3].tolist() == [0, 5, 0]
    assert next(iter(open_recording(path, up="auto"))).up is None


def test_results_are_in_the_coordinate_frame_that_is_asked_for(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    path = make_bag(tmp_path, "mcap", walk)
    recording = open_recording(path, bag=BagOptions(map_frame="/odom"))
    assert recording.frame_id == "odom"
    shift = walk.check_poses().map_from_camera[:, :3, 3] - recording.check_poses().map_from_camera[:, :3, 3]
    np.testing.assert_allclose(shift[:, 0], 1.0, atol=1e-6)


def test_camera_file_stands_in_for_camera_info(tmp_path: Path, walk: ImageFolderRecording) -> None:
    ros = Ros("mcap")
    messages = [message for message in robot_messages(ros, walk) if "camera_info" not in message[1]]
    path = write_bag(tmp_path, "mcap", ros, messages)
    camera_file = tmp_path / "images" / "camera.json"
    write_recording(camera_file.parent, num_frames=1)
    check_same(path, walk, options=BagOptions(camera_file=camera_file))


def test_a_camera_file_of_another_scale_is_used_and_noted(tmp_path: Path, walk: ImageFolderRecording) -> None:
    path = make_bag(tmp_path, "mcap", walk)
    values = '"width": 320, "height": 240, "fx": 300, "fy": 300, "cx": 160, "cy": 120'
    camera_file = tmp_path / "camera.json"
    camera_file.write_text(f'{{{values}, "depth_scale": 5000}}')
    recording = open_recording(path, bag=BagOptions(camera_file=camera_file))
    (note,) = (note for note in recording.problems.notes if "depth_scale" in note)
    assert "5000 values per metre" in note
    assert "write 1000 if depths are 0.2 times what they should be" in note
    camera_file.write_text(f'{{{values}, "depth_scale": 1000}}')
    assert not open_recording(path, bag=BagOptions(camera_file=camera_file)).problems.notes


def test_topics_are_chosen_by_name(tmp_path: Path, walk: ImageFolderRecording) -> None:
    ros = Ros("mcap")
    messages = robot_messages(ros, walk)
    other = [(stamp, topic.replace("/camera", "/rear"), message) for stamp, topic, message in messages]
    path = write_bag(tmp_path, "mcap", ros, [*messages, *(one for one in other if "/rear" in one[1])])
    check_same(path, walk, options=BagOptions(depth_topic=DEPTH_TOPIC))
    options = BagOptions(depth_topic="rear/depth/image_rect_raw", camera_info_topic=bag_files.INFO_TOPIC)
    check_same(path, walk, options=options)


def test_contents_tell_what_was_taken_and_what_there_is(tmp_path: Path, walk: ImageFolderRecording) -> None:
    recording = open_recording(make_bag(tmp_path, "mcap", walk))
    assert isinstance(recording, BagRecording)
    contents = recording.contents
    assert (contents.depth.topic, contents.depth.camera_info) == (DEPTH_TOPIC, bag_files.INFO_TOPIC)
    assert contents.depth.frame_id == OPTICAL
    assert contents.coordinate_frames == ("base_link", OPTICAL, "camera_link", "map", "odom")
    assert recording.pose_source == f"transforms, map to {OPTICAL}"
    counts = {topic.name: topic.num_messages for topic in contents.topics}
    assert counts == {
        DEPTH_TOPIC: NUM_FRAMES,
        bag_files.INFO_TOPIC: NUM_FRAMES,
        "/chatter": 1,
        "/tf": 2 * NUM_FRAMES,
        "/tf_static": 1,
    }
