"""What looks like stairs and is none gives no observation: simulated look-alikes and real recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Rejection
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.simulation.look_alikes import LOOK_ALIKES
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation

NUM_FRAMES = 6
NOISY_SENSORS = ("kinect_v1", "kinect_v2", "d435", "phone_lidar")
FACTORS = {"phone_lidar": 1.0, "kinect_v2": 0.625}

REAL_NEGATIVES = (
    "no_stairs_kitchen_kinect_v1",
    "no_stairs_lab_floor_realsense",
    "no_stairs_objects_realsense",
)


def frames_of_drive(
    scene: str, sensor_name: str, *, seed: int, num_frames: int = NUM_FRAMES
) -> list[DepthFrame]:
    """Frames evenly spread over a robot's drive up to a scene, each with its true up."""
    sensor = make_sensor(sensor_name, factor=FACTORS.get(sensor_name, 0.5))
    simulation = Simulation(
        make_scene(scene, seed), sensor, ROBOTS[sorted(ROBOTS)[seed % len(ROBOTS)]], seed=seed
    )
    random = np.random.default_rng(seed)
    frames = []
    for index in np.linspace(0, len(simulation) - 1, num_frames).astype(int):
        pose = simulation.true_poses[index]
        depth = sensor.measure(simulation.caster.render(sensor.camera, pose), random)
        frames.append(DepthFrame(stamp_ns=int(index), depth=depth, camera=sensor.camera, up=pose[2, :3]))
    return frames


def false_frames(frames: list[DepthFrame]) -> list[int]:
    """Stamps of the frames with an observation."""
    detector = StairEdgeDetector(Config())
    return [frame.stamp_ns for frame in frames if detector.detect(frame)]


@pytest.mark.parametrize("scene", sorted(LOOK_ALIKES))
def test_a_look_alike_gives_no_observation_without_noise(scene: str) -> None:
    assert false_frames(frames_of_drive(scene, "ideal", seed=sorted(LOOK_ALIKES).index(scene))) == []


@pytest.mark.parametrize("scene", sorted(LOOK_ALIKES))
def test_a_look_alike_gives_no_observation_with_a_noisy_sensor(scene: str) -> None:
    # The sensors take turns, so that each look-alike is seen by one of them.
    index = sorted(LOOK_ALIKES).index(scene)
    sensor = NOISY_SENSORS[index % len(NOISY_SENSORS)]
    assert false_frames(frames_of_drive(scene, sensor, seed=20 + index)) == []


@pytest.mark.parametrize(
    ("scene", "sensor", "seed"),
    [
        ("bookshelf", "kinect_v1", 202),
        ("pallets", "ideal", 208),
        ("pallets", "kinect_v2", 108),
        ("bleachers", "phone_lidar", 300),
        ("stacked_boxes", "phone_lidar", 112),
    ],
)
def test_a_look_alike_that_was_taken_for_stairs_once_is_none(scene: str, sensor: str, seed: int) -> None:
    assert false_frames(frames_of_drive(scene, sensor, seed=seed, num_frames=10)) == []


@pytest.mark.parametrize("scene", sorted(LOOK_ALIKES)[::4])
def test_every_frame_of_a_look_alike_says_why_there_is_none(scene: str) -> None:
    detector = StairEdgeDetector(Config())
    for frame in frames_of_drive(scene, "ideal", seed=3):
        detection = detector.detect(frame)
        assert detection or detection.rejections
        for rejection in detection.rejections:
            check_breaks_its_limit(rejection)


def test_corners_in_a_row_that_no_profile_explains_are_no_steps() -> None:
    """Bleachers, 0.4 m high, once gave ``min_steps: 5, limit 3`` as the reason against them."""
    rejections = [
        rejection
        for frame in frames_of_drive("bleachers", "d435", seed=1)
        for rejection in StairEdgeDetector(Config()).detect(frame).rejections
    ]
    assert rejections
    for rejection in rejections:
        check_breaks_its_limit(rejection)


def check_breaks_its_limit(rejection: Rejection) -> None:
    """A reason against stairs is a measure on the wrong side of its limit."""
    if rejection.rule.startswith("min_"):
        assert not rejection.measured >= rejection.limit, rejection
    if rejection.rule.startswith("max_"):
        assert not rejection.measured <= rejection.limit, rejection


@pytest.mark.parametrize("folder", REAL_NEGATIVES)
def test_false_detections_in_real_recordings_are_at_most_2_percent(shared_data: Path, folder: str) -> None:
    if not (shared_data / "real" / folder).is_dir():
        pytest.skip(f"no real recording {folder}")
    recording = open_recording(shared_data / "real" / folder)
    detector = StairEdgeDetector(Config())
    every = 1 if recording.num_frames <= 10 else 5
    false, num_looked_at = [], 0
    for index, frame in enumerate(recording):
        if index % every == 0:
            num_looked_at += 1
            # The poses' world is not level: up comes from each frame's own floor.
            if detector.detect(replace(frame, up=None)):
                false.append(index)
    assert num_looked_at >= 5
    assert len(false) <= 0.02 * num_looked_at, false


def test_the_real_test_stairs_are_measured(shared_data: Path) -> None:
    folder = shared_data / "real" / "kinect_v2_test_stairs"
    if not folder.is_dir():
        pytest.skip("no real recording kinect_v2_test_stairs")
    (frame,) = open_recording(folder)
    (observation,) = StairEdgeDetector(Config()).detect(frame).observations
    assert 4 <= observation.num_steps <= 5
    assert 0.085 <= observation.rise <= 0.115
    assert 0.26 <= observation.run <= 0.30
    assert 0.70 <= observation.width <= 0.90


def test_the_real_test_stairs_are_found_without_an_imu(shared_data: Path) -> None:
    folder = shared_data / "real" / "kinect_v2_test_stairs"
    if not folder.is_dir():
        pytest.skip("no real recording kinect_v2_test_stairs")
    (frame,) = open_recording(folder)
    (observation,) = StairEdgeDetector(Config()).detect(replace(frame, up=None)).observations
    assert 0.085 <= observation.rise <= 0.115
    assert 0.26 <= observation.run <= 0.30
