"""Drives, frames and recordings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.recording import DEPTH_SCALE, write_simulation
from stairmap.simulation.robots import FRAME_PERIOD_NS, ROBOTS, drive_route
from stairmap.simulation.scene import Route
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation, simulate
from stairmap.simulation.visibility import measure_visibility
from stairmap.stairway import Stairway
from stairmap.trajectory import MAX_GAP_NS

SENSOR = make_sensor("kinect_v1", factor=0.25)


def test_equal_seeds_give_equal_frames_and_poses_bit_for_bit() -> None:
    scene = make_scene("b3", 4)
    for robot in ROBOTS.values():
        first, again = (list(simulate(scene, SENSOR, robot, seed=9, num_frames=3)) for _ in range(2))
        for a, b in zip(first, again, strict=True):
            assert a.frame.depth.tobytes() == b.frame.depth.tobytes()
            assert a.map_from_camera_odometry.tobytes() == b.map_from_camera_odometry.tobytes()
    other = next(simulate(scene, SENSOR, ROBOTS["packbot"], seed=10, num_frames=3))
    same = next(simulate(scene, SENSOR, ROBOTS["packbot"], seed=9, num_frames=3))
    assert other.frame.depth.tobytes() != same.frame.depth.tobytes()


def test_the_map_is_anchored_at_the_true_first_pose_and_odometry_drifts() -> None:
    simulation = Simulation(make_scene("b3", 0), SENSOR, ROBOTS["spot"], seed=0)
    np.testing.assert_array_equal(simulation.odometry_poses[0], simulation.true_poses[0])
    assert np.abs(simulation.odometry_poses[-1] - simulation.true_poses[-1]).max() > 1e-3
    perfect = Simulation(make_scene("b3", 0), SENSOR, ROBOTS["spot"], seed=0, odometry=PERFECT_ODOMETRY)
    np.testing.assert_allclose(perfect.odometry_poses, perfect.true_poses, atol=1e-9)


def test_frames_are_no_farther_apart_than_poses_are_interpolated() -> None:
    assert FRAME_PERIOD_NS <= MAX_GAP_NS


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_a_robots_camera_has_its_height_and_looks_down_by_its_pitch(name: str) -> None:
    robot = replace(ROBOTS[name], pitch_swing=0, roll_swing=0, bounce=0, sway=0)
    simulation = Simulation(make_scene("b3", 0), SENSOR, robot, seed=0, num_frames=5)
    np.testing.assert_allclose(simulation.true_poses[:, 2, 3], robot.camera_height, atol=1e-9)
    np.testing.assert_allclose(-simulation.true_poses[:, 2, 2], np.sin(robot.camera_pitch), atol=1e-9)


def test_a_drive_turns_first_and_ends_where_the_route_ends() -> None:
    route = Route(
        waypoints=np.array([[0, 0, 1.0], [2, 0, 1.0], [2, 3, 1.0]]), first_heading=-1.0, last_heading=3.0
    )
    robot = replace(ROBOTS["packbot"], sway=0)
    drive = drive_route(route, robot, random=np.random.default_rng(0))
    np.testing.assert_allclose(drive.planar[0], [0, 0, 1, -1.0], atol=1e-6)
    np.testing.assert_allclose(drive.planar[-1], [2, 3, 1, 3.0], atol=0.1)
    seconds = (1.0 + np.pi / 2 + (3 - np.pi / 2)) / robot.turn_rate + 5 / robot.speed
    assert len(drive) == pytest.approx(seconds * 10, abs=2)
    assert np.abs(np.diff(drive.planar[:, 3])).max() <= robot.turn_rate * 0.1 + 1e-9
    with pytest.raises(ValueError, match="two frames"):
        drive_route(route, robot, random=np.random.default_rng(0), num_frames=1)


def test_a_flight_seen_squarely_has_all_its_lower_nosings_in_view() -> None:
    simulation = Simulation(make_scene("free_standing", 0), SENSOR, ROBOTS["packbot"], seed=0)
    flight = simulation.scene.stairways[0].flights[0]
    visibility = measure_visibility(flight, simulation.caster, SENSOR.camera, simulation.true_poses, 5.0)
    assert visibility.num_nosings_seen == 8
    assert visibility.distance[0] == pytest.approx(4.55, abs=0.1)
    assert visibility.distance[-1] == pytest.approx(0.6, abs=0.05)
    assert not visibility.is_descending.any()
    assert visibility.view_angle.max() < np.radians(20)
    assert visibility.num_frames_within(3.0, np.radians(60)) >= 20


def test_stairs_that_lead_down_are_seen_descending_and_only_near_the_edge() -> None:
    simulation = Simulation(make_scene("descending", 0), SENSOR, ROBOTS["spot"], seed=0)
    flight = simulation.scene.stairways[0].flights[0]
    visibility = measure_visibility(flight, simulation.caster, SENSOR.camera, simulation.true_poses, 5.0)
    assert visibility.is_descending.all()
    # From afar the floor hides every nosing but the top one.
    assert visibility.num_visible_nosings[0] <= 1
    assert visibility.num_visible_nosings[-1] >= 3


def test_a_recording_holds_frames_odometry_and_truth(tmp_path: Path) -> None:
    scene = make_scene("davis_rear", 1)
    counts = []
    folder = write_simulation(
        tmp_path / "recording", scene, SENSOR, ROBOTS["packbot"], seed=1, num_frames=6,
        on_frame=lambda done, total: counts.append((done, total)),
    )  # fmt: skip
    assert counts[-1] == (6, 6)
    simulation = Simulation(scene, SENSOR, ROBOTS["packbot"], seed=1, num_frames=6)
    believed = load_tum_trajectory(folder / "groundtruth.txt")
    np.testing.assert_allclose(believed.map_from_camera, simulation.odometry_poses, atol=1e-8)
    truth = json.loads((folder / "truth.json").read_text())
    true = load_tum_trajectory(folder / truth["true_trajectory"])
    np.testing.assert_allclose(true.map_from_camera, simulation.true_poses, atol=1e-8)
    (stairway,) = [Stairway.from_dict(entry) for entry in truth["stairways"]]
    assert stairway.flights[0].rise == pytest.approx(scene.stairways[0].flights[0].rise, abs=1e-6)
    assert truth["stairways"][0]["flights"][0]["std"]["base"] == [0, 0, 0]
    assert len(truth["visibility"][0]["distance"]) == 6
    assert truth["optional_stairways"] == []
    image = cv2.imread(str(sorted((folder / "depth").iterdir())[3]), cv2.IMREAD_UNCHANGED)
    depth = list(simulation.frames())[3].frame.depth
    np.testing.assert_allclose(image / DEPTH_SCALE, np.nan_to_num(depth), atol=0.5001 / DEPTH_SCALE + 1e-6)


def test_recordings_of_equal_seeds_are_equal_files(tmp_path: Path) -> None:
    folders = [
        write_simulation(
            tmp_path / name, make_scene("random", 3), SENSOR, ROBOTS["go2"], seed=3, num_frames=3
        )
        for name in "ab"
    ]
    files = [
        sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file()) for folder in folders
    ]
    assert files[0] == files[1]
    for path in files[0]:
        assert (folders[0] / path).read_bytes() == (folders[1] / path).read_bytes()


def test_the_truth_tells_overhang_and_the_height_of_every_step(tmp_path: Path) -> None:
    for name, overhang, heights in (
        ("overhang_thin", 0.030, [0.17, 0.34, 0.51]),
        ("odd_riser", 0.0, [0.17, 0.34, 0.522]),
    ):
        folder = write_simulation(
            tmp_path / name, make_scene(name, 0), SENSOR, ROBOTS["go2"], seed=0, num_frames=2
        )
        (flight,) = json.loads((folder / "truth.json").read_text())["stairways"][0]["flights"]
        assert flight["overhang"] == overhang
        assert [step["nosing"][0][2] for step in flight["steps"][:3]] == pytest.approx(heights)
        assert flight["std"]["overhang"] == 0
