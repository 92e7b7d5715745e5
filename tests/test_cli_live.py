"""``stairmap live --realsense`` on a recorder file: all of librealsense and of the command line."""

from __future__ import annotations

import os
import signal
import threading
import time

import pytest

from analytic_stairs import KINECT_CAMERA
from command_line import check_refused, stairmap
from depth_drives import STAIRS, frames_at, poses_towards_stairs
from stairmap.export.loading import load_detections, load_stairways
from stairmap.recordings.open import open_recording

pytest.importorskip("pyrealsense2", exc_type=ImportError)

from software_realsense import SoftwareRealSense

NUM_FRAMES = 14


@pytest.fixture(scope="module")
def playback(tmp_path_factory):
    """A walk towards stairs, 4 Hz, as the RealSense recorder writes it."""
    path = tmp_path_factory.mktemp("recordings") / "walk.db3"
    frames = frames_at(poses_towards_stairs(NUM_FRAMES, step=0.05), camera=KINECT_CAMERA)
    return SoftwareRealSense(KINECT_CAMERA).record(path, frames, period=0.25)


def live(*arguments):
    return stairmap("live", "--realsense", *arguments)


def test_each_frame_is_looked_at_and_written(playback, tmp_path):
    outcome = live("--playback", playback, "-o", tmp_path / "out")
    assert outcome.code == 0, outcome.stderr
    assert outcome.last_line == str(tmp_path / "out")
    detections = list(load_detections(tmp_path / "out"))
    assert 3 <= len(detections) <= NUM_FRAMES
    assert sum(bool(detection.observations) for detection in detections) >= len(detections) - 1
    assert "the last frame with stairs:" in outcome.stdout
    assert "ascending" in outcome.stdout


def test_with_odometry_a_map_is_written_at_the_end(playback, tmp_path):
    pytest.importorskip("small_gicp")
    outcome = live("--playback", playback, "--odometry", "--record", tmp_path / "rec", "-o", tmp_path / "out")
    assert outcome.code == 0, outcome.stderr
    (stairway,) = load_stairways(tmp_path / "out").stairways
    assert stairway.flights[0].rise == pytest.approx(STAIRS.rise, abs=0.008)
    assert stairway.flights[0].run == pytest.approx(STAIRS.run, abs=0.010)
    assert "poses come from the registration of depth" in outcome.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"trajectory.tum", "stairways.ply", "report.html", "summary.txt", "config.yaml"} <= names
    recorded = open_recording(tmp_path / "rec")
    assert recorded.num_frames == len(list(load_detections(tmp_path / "out")))
    assert recorded.camera == KINECT_CAMERA


def test_ctrl_c_writes_what_was_found(playback, tmp_path):
    thread = threading.Thread(
        target=interrupt_after_first_line, args=(tmp_path / "out" / "detections.jsonl",)
    )
    thread.start()
    outcome = live("--playback", playback, "-o", tmp_path / "out")
    thread.join()
    assert outcome.code == 0
    num_frames = len(list(load_detections(tmp_path / "out")))
    assert 1 <= num_frames < NUM_FRAMES
    assert outcome.stdout.startswith(f"{num_frames} frame")
    assert (tmp_path / "out" / "summary.txt").is_file()


def interrupt_after_first_line(path):
    for _ in range(1000):
        if path.is_file() and path.stat().st_size > 0:
            os.kill(os.getpid(), signal.SIGINT)
            return
        time.sleep(0.01)


def test_it_ends_after_the_wanted_number_of_frames(playback, tmp_path):
    outcome = live("--playback", playback, "--frames", "2", "-o", tmp_path / "out")
    assert outcome.code == 0
    assert len(list(load_detections(tmp_path / "out"))) == 2


def test_no_camera_is_one_clear_line(tmp_path):
    check_refused(live("-o", tmp_path / "out"), "expected a RealSense camera, found none")
    assert not (tmp_path / "out").exists()


def test_another_kind_of_camera_is_wrong_usage():
    assert stairmap("live").code == 2
