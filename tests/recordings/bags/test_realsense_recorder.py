"""Files of the RealSense recorder: the layout of ROS 1 and 2, the sensor's own unit, and no poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bag_files import Ros, write_bag
from command_line import check_refused, stairmap
from realsense_messages import ros1_messages
from stairmap.errors import TrajectoryError
from stairmap.recordings.image_folder import ImageFolderRecording
from stairmap.recordings.open import open_recording


def record_with_librealsense(path: Path, depths: list[np.ndarray]) -> None:
    """Feed images in millimetres through a device made of software into librealsense's recorder."""
    rs: Any = pytest.importorskip("pyrealsense2", exc_type=ImportError)
    height, width = depths[0].shape
    device = rs.software_device()
    sensor = device.add_sensor("Depth")
    stream = rs.video_stream()
    stream.type, stream.fmt, stream.index, stream.uid = rs.stream.depth, rs.format.z16, 0, 0
    stream.width, stream.height, stream.fps, stream.bpp = width, height, 30, 2
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy = width, height, 262.5, 262.5
    lens.ppx, lens.ppy, lens.model, lens.coeffs = 159.5, 119.5, rs.distortion.none, [0.0] * 5
    stream.intrinsics = lens
    profile = sensor.add_video_stream(stream).as_video_stream_profile()
    sensor.add_read_only_option(rs.option.depth_units, 0.001)
    recorder = rs.recorder(str(path), device)
    recorded = recorder.query_sensors()[0]
    frames = rs.frame_queue(len(depths))
    recorded.open(recorded.get_stream_profiles()[0])
    recorded.start(frames)
    for number, depth in enumerate(depths):
        frame = rs.software_video_frame()
        frame.pixels, frame.stride, frame.bpp = depth, width * 2, 2
        frame.timestamp, frame.domain = 33.0 * number, rs.timestamp_domain.system_time
        frame.frame_number, frame.profile, frame.depth_units = number, profile, 0.001
        sensor.on_video_frame(frame)
        frames.wait_for_frame()
    recorded.stop()
    recorded.close()
    del recorder, recorded


@pytest.mark.parametrize("option", ["Depth_Units", "Depth Units"])
def test_file_of_ros1_has_the_sensors_own_unit(
    tmp_path: Path, walk: ImageFolderRecording, option: str
) -> None:
    ros = Ros("ros1_lz4")
    messages = ros1_messages(ros, walk, depth_unit=0.0005, option=option)
    path = write_bag(tmp_path, "ros1_lz4", ros, messages)
    recording = open_recording(path)
    assert recording.camera == walk.camera
    for mine, true in zip(recording, walk, strict=True):
        np.testing.assert_allclose(mine.depth, true.depth, atol=1e-6)


def test_file_that_librealsense_records_gives_the_frames_that_it_saw(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    depths = [np.nan_to_num(frame.depth * 1000).round().astype(np.uint16) for frame in walk]
    path = tmp_path / "camera.db3"
    record_with_librealsense(path, depths)
    recording = open_recording(path)
    assert recording.num_frames == len(depths)
    assert (recording.camera.fx, recording.camera.cx, recording.camera.width) == (262.5, 159.5, 320)
    for frame, true in zip(recording, walk, strict=True):
        np.testing.assert_array_equal(frame.depth, true.depth)
    with pytest.raises(TrajectoryError, match="the RealSense recorder writes none"):
        recording.check_poses()


def test_detect_needs_no_poses_and_run_says_what_gives_them(
    tmp_path: Path, walk: ImageFolderRecording
) -> None:
    ros = Ros("ros1")
    messages = ros1_messages(ros, walk, depth_unit=0.001)
    path = write_bag(tmp_path, "ros1", ros, messages)
    outcome = stairmap("detect", path, "-o", tmp_path / "run", "--no-overlays")
    assert outcome.code == 0
    assert "stair edges detected in 4 (100.0 %)" in outcome.stdout
    check_refused(
        stairmap("run", path), "the RealSense recorder writes none", "--trajectory FILE", "stairmap detect"
    )
