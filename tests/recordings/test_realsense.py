"""Live frames through librealsense itself: a software device plays the camera."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from depth_drives import CAMERA, PERIOD_NS, frames_at, poses_towards_stairs
from stairmap.errors import CalibrationError, MissingPackageError, RecordingError
from stairmap.frame import DepthFrame
from stairmap.recordings.realsense import RealSenseCamera, depth_from_counts, open_realsense

pytest.importorskip("pyrealsense2", exc_type=ImportError)

from software_realsense import DEPTH_UNIT, SoftwareRealSense

FRAMES = frames_at(poses_towards_stairs(5))


@pytest.fixture
def source():
    return SoftwareRealSense(CAMERA)


def flat_frame(index: int, *, depth: float = 2.0) -> DepthFrame:
    values = np.full((CAMERA.height, CAMERA.width), depth, dtype=np.float32)
    return DepthFrame(stamp_ns=(index + 1) * PERIOD_NS, depth=values, camera=CAMERA)


def test_a_frame_arrives_as_it_was_sent(source):
    camera = RealSenseCamera(source.device)
    assert camera.camera == CAMERA
    assert (camera.name, camera.rate, camera.depth_unit) == ("Software D435i", 30.0, pytest.approx(0.001))
    sent = FRAMES[3]
    live = take_after_sending(camera, source, [sent])
    assert live.frame.stamp_ns == sent.stamp_ns
    assert np.allclose(live.frame.depth, sent.depth, atol=DEPTH_UNIT, equal_nan=True)
    assert live.frame.up is None


def test_only_the_newest_frame_is_seen_and_the_others_are_counted(source):
    frames = RealSenseCamera(source.device).frames()
    # Starting happens at the first step, and frames sent before that are nobody's.
    threading.Timer(0.3, lambda: source.send(flat_frame(0))).start()
    assert next(frames).frame.stamp_ns == PERIOD_NS
    for index in range(1, 6):
        source.send(flat_frame(index, depth=2.0 + 0.1 * index))
    newest = next(frames)
    assert newest.frame.stamp_ns == 6 * PERIOD_NS
    assert newest.num_skipped == 4
    assert np.nanmedian(newest.frame.depth) == pytest.approx(2.5, abs=DEPTH_UNIT)
    frames.close()


def test_a_clock_that_was_set_back_gives_no_frame(source):
    frames = RealSenseCamera(source.device).frames()
    threading.Timer(0.3, lambda: source.send(flat_frame(5))).start()
    assert next(frames).frame.stamp_ns == 6 * PERIOD_NS
    source.send(flat_frame(1))
    threading.Timer(0.3, lambda: source.send(flat_frame(7))).start()
    assert next(frames).frame.stamp_ns == 8 * PERIOD_NS
    frames.close()


def test_up_comes_from_the_accelerometer():
    source = SoftwareRealSense(CAMERA, has_accelerometer=True)
    camera = RealSenseCamera(source.device)
    assert camera.has_accelerometer
    frames = camera.frames()
    threading.Timer(0.3, lambda: source.send(flat_frame(0))).start()
    assert next(frames).frame.up is None
    source.send_acceleration([0.0, -9.81 * np.cos(0.3), -9.81 * np.sin(0.3)])
    source.send(flat_frame(1))
    assert np.allclose(next(frames).frame.up, [0, -np.cos(0.3), -np.sin(0.3)], atol=1e-6)
    frames.close()


def test_stopping_ends_the_frames(source):
    assert list(RealSenseCamera(source.device).frames(should_stop=lambda: True)) == []


def test_a_camera_that_falls_silent_is_an_error(source):
    with pytest.raises(RecordingError, match=r"none came for 0.2 s; is it still plugged in"):
        next(RealSenseCamera(source.device).frames(max_silence=0.2))


def test_a_camera_can_be_started_again(source):
    camera = RealSenseCamera(source.device)
    for index in (0, 1):
        assert take_after_sending(camera, source, [flat_frame(index)]).frame.stamp_ns > 0


def test_distorted_depth_is_refused():
    source = SoftwareRealSense(CAMERA, distortion=0.1)
    with pytest.raises(CalibrationError, match="without distortion"):
        RealSenseCamera(source.device)


def test_a_recorded_file_is_played_to_its_end(source, tmp_path):
    path = source.record(tmp_path / "walk.db3", [flat_frame(index) for index in range(8)], period=0.03)
    camera = open_realsense(playback=path)
    assert camera.name == "walk"
    stamps = [live.frame.stamp_ns for live in camera.frames()]
    assert stamps == sorted(stamps)
    assert stamps[-1] == 8 * PERIOD_NS


def test_a_playback_that_is_none_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="there is no"):
        open_realsense(playback=tmp_path / "missing.db3")
    (tmp_path / "text.bag").write_text("no bag")
    with pytest.raises(RecordingError, match=r"cannot play .*text\.bag"):
        open_realsense(playback=tmp_path / "text.bag")


def test_without_a_camera_one_line_says_what_to_do():
    with pytest.raises(RecordingError, match=r"found none; plug it into a USB 3 port.* --playback"):
        open_realsense()
    with pytest.raises(RecordingError, match="serial number 99, found: none"):
        open_realsense(serial="99")


def test_zero_and_the_largest_count_are_not_measured():
    depth = depth_from_counts(np.array([[0, 1500, 65535]], dtype=np.uint16), 0.001)
    assert np.allclose(depth, [[np.nan, 1.5, np.nan]], equal_nan=True)


def test_without_the_package_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(MissingPackageError, match=r"pyrealsense2.*stairmap\[realsense\]"):
        open_realsense(playback=Path("any"))


def take_after_sending(camera, source, frames):
    """First live frame of a stream into which frames are sent once it has started."""
    stream = camera.frames()

    def send() -> None:
        time.sleep(0.3)
        for frame in frames:
            source.send(frame)

    thread = threading.Thread(target=send)
    thread.start()
    live = next(stream)
    thread.join()
    stream.close()
    return live
