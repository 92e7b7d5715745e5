"""``stairmap run --odometry``: a map of a recording without poses."""

from __future__ import annotations

import json

import pytest

from analytic_stairs import KINECT_CAMERA
from command_line import check_refused, stairmap
from depth_drives import STAIRS, frames_at, poses_towards_stairs
from stairmap.config import load_config
from stairmap.export.loading import load_stairways
from stairmap.export.recording_reference import load_recording_reference
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.recordings.tum_trajectory import load_tum_trajectory

pytest.importorskip("small_gicp")


@pytest.fixture(scope="module")
def without_poses(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings") / "walk"
    with ImageFolderWriter(folder, KINECT_CAMERA, depth_scale=5000.0) as writer:
        for frame in frames_at(poses_towards_stairs(8), camera=KINECT_CAMERA):
            writer.write(frame)
    return folder


@pytest.fixture(scope="module")
def outcome(without_poses, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    return folder, stairmap("run", without_poses, "--odometry", "--no-report", "-o", folder)


def test_stairs_are_measured_without_given_poses(outcome):
    folder, printed = outcome
    assert printed.code == 0, printed.stderr
    (stairway,) = load_stairways(folder).stairways
    (flight,) = stairway.flights
    assert flight.rise == pytest.approx(STAIRS.rise, abs=0.008)
    assert flight.run == pytest.approx(STAIRS.run, abs=0.010)
    assert flight.width == pytest.approx(STAIRS.width, abs=0.05)


def test_the_run_says_where_its_poses_come_from(outcome):
    _, printed = outcome
    assert "the map was turned by" in printed.stderr
    assert "poses come from the registration of depth: 8 of 8 frames" in printed.stderr


def test_the_poses_are_kept_and_the_drift_stands_in_the_configuration(outcome):
    folder, _ = outcome
    assert len(load_tum_trajectory(folder / "trajectory.tum")) == 8
    modeling = load_config(folder / "config.yaml").modeling
    assert modeling.pose_drift >= 0.04
    assert modeling.pose_heading_drift_deg > 0


def test_a_drift_that_the_user_sets_stays(without_poses, tmp_path):
    printed = stairmap(
        "run", without_poses, "--odometry", "--no-report", "--json", "-o", tmp_path / "run",
        "--set", "modeling.pose_drift=0.01",
    )  # fmt: skip
    assert printed.code == 0
    assert len(json.loads(printed.stdout)["stairways"]) == 1
    modeling = load_config(tmp_path / "run" / "config.yaml").modeling
    assert modeling.pose_drift == 0.01
    assert modeling.pose_heading_drift_deg > 0


def test_without_odometry_the_message_names_it(without_poses):
    check_refused(stairmap("run", without_poses), "expected poses", "--trajectory", "--odometry")


def test_two_sources_of_poses_are_refused(without_poses, tmp_path):
    check_refused(
        stairmap("run", without_poses, "--odometry", "--trajectory", tmp_path / "any.tum"),
        "--trajectory or --odometry",
    )


def test_the_run_can_be_looked_at_again_with_its_poses(outcome):
    folder, _ = outcome
    reference = load_recording_reference(folder)
    assert reference is not None
    assert len(reference.open().check_poses()) == 8


def test_a_batch_finds_the_same_poses_and_stairways_and_its_folder_can_be_viewed(
    without_poses, outcome, tmp_path
):
    folder, _ = outcome
    pytest.importorskip("distributed")
    batch = stairmap("batch", without_poses, "--odometry", "-o", tmp_path / "fleet", "--workers", "0")
    assert batch.code == 0, batch.stderr
    for name in ("stairways.json", "detections.jsonl", "trajectory.tum", "config.yaml", "recording.json"):
        assert (tmp_path / "fleet" / "walk" / name).read_bytes() == (folder / name).read_bytes(), name
    assert load_recording_reference(tmp_path / "fleet" / "walk").open().trajectory is not None
