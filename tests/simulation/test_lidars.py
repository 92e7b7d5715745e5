"""Beams of LiDARs, drives with them, and the bags that are written of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from command_line import stairmap
from stairmap.recordings.bags.sweeps import MAX_POSE_GAP_NS, SweepRecording
from stairmap.simulation.lidars import LIDARS, MID_360, OS0_64, SWEEP_PERIOD_NS, VLP_16
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sweep_bag import START_NS, write_lidar_drive
from stairmap.simulation.sweep_visibility import MIN_RETURNS, ReturnCounter, count_returns
from stairmap.simulation.sweeps import LidarDrive
from stairmap.sweep import straightened


@pytest.fixture(scope="module")
def drive() -> LidarDrive:
    return LidarDrive(make_scene("free_standing", 0), MID_360, ROBOTS["go2"], seed=1, num_frames=12)


@pytest.mark.parametrize("name", sorted(LIDARS))
def test_beams_are_unit_vectors_in_the_order_of_their_times(name: str) -> None:
    beams = LIDARS[name].beams(3)
    np.testing.assert_allclose(np.linalg.norm(beams.directions, axis=1), 1.0)
    assert (np.diff(beams.offsets_ns) >= 0).all()
    assert beams.offsets_ns[0] >= 0
    assert beams.offsets_ns[-1] < SWEEP_PERIOD_NS
    assert set(beams.rings.tolist()) == set(range(LIDARS[name].num_rings))


def test_a_spinning_lidar_sends_each_laser_all_round_and_comes_back() -> None:
    for lidar, number in ((VLP_16, 16 * 1808), (OS0_64, 64 * 1024)):
        beams = lidar.beams(0)
        assert len(beams.directions) == number
        np.testing.assert_array_equal(beams.directions, lidar.beams(1).directions)
        elevation = np.arcsin(beams.directions[:, 2])
        for ring, expected in enumerate(lidar.elevations):
            np.testing.assert_allclose(elevation[beams.rings == ring], expected, atol=1e-9)
        azimuth = np.arctan2(beams.directions[:, 1], beams.directions[:, 0])
        assert np.diff(np.sort(np.unique(azimuth.round(9)))).max() < 2 * np.pi / lidar.num_columns + 1e-6


def test_a_rosette_fills_its_field_of_view_and_does_not_come_back() -> None:
    beams = [MID_360.beams(index) for index in range(20)]
    elevation = np.degrees(np.arcsin(np.concatenate([beam.directions[:, 2] for beam in beams])))
    assert elevation.min() == pytest.approx(-7, abs=0.5)
    assert elevation.max() == pytest.approx(52, abs=0.5)

    def cells(directions: np.ndarray) -> set[tuple[int, int]]:
        azimuth = np.degrees(np.arctan2(directions[:, 1], directions[:, 0])).astype(int)
        return set(zip(azimuth.tolist(), np.degrees(np.arcsin(directions[:, 2])).astype(int), strict=True))

    one, two = cells(beams[0].directions), cells(beams[1].directions)
    every = set().union(*(cells(beam.directions) for beam in beams))
    assert len(one) < 0.75 * len(every)
    assert len(one & two) < 0.8 * len(one)


def test_points_placed_by_their_own_time_lie_where_they_were_measured(drive: LidarDrive) -> None:
    for found in drive.sweeps():
        points, has_pose = straightened(found.sweep, drive.true_path, max_gap_ns=MAX_POSE_GAP_NS)
        assert has_pose.all()
        errors = np.linalg.norm(points - found.true_points, axis=1)
        near = np.linalg.norm(found.sweep.points, axis=1) < 5
        assert np.sqrt((errors[near] ** 2).mean()) == pytest.approx(MID_360.range_std, rel=0.25)


def test_a_sweep_taken_as_one_moment_is_bent(drive: LidarDrive) -> None:
    found = list(drive.sweeps())[5]
    pose = drive.true_path.pose_at(found.sweep.stamp_ns)
    at_once = found.sweep.points @ pose[:3, :3].T + pose[:3, 3]
    own, _ = straightened(found.sweep, drive.true_path, max_gap_ns=MAX_POSE_GAP_NS)
    late = found.sweep.offsets_ns > 80_000_000
    assert np.linalg.norm(at_once - own, axis=1)[late].mean() > 0.02


def test_equal_seeds_give_equal_sweeps(drive: LidarDrive) -> None:
    again = LidarDrive(drive.scene, MID_360, ROBOTS["go2"], seed=1, num_frames=12)
    other = LidarDrive(drive.scene, MID_360, ROBOTS["go2"], seed=2, num_frames=12)
    first, same, different = (next(item.sweeps()).sweep for item in (drive, again, other))
    assert first.points.tobytes() == same.points.tobytes()
    assert first.points.tobytes() != different.points.tobytes()


def test_returns_are_counted_on_risers_and_treads_only() -> None:
    (stairway,) = make_scene("free_standing", 0).stairways
    (flight,) = stairway.flights
    tread = [0.5 * flight.run + flight.run, 0.0, 2 * flight.rise]
    riser = [2 * flight.run, 0.1, 2.5 * flight.rise]
    beside, inside, floor = [0.5, flight.width, 0.0], [flight.run * 2.5, 0.0, 0.2], [-0.2, 0.0, 0.0]
    local = np.array([tread, riser, beside, inside, floor])
    points = local @ flight.map_from_flight[:3, :3].T + flight.base
    before = flight.base - 2.0 * flight.forward + [0.0, 0.0, 1.5]
    counts = count_returns(flight, points, before)
    assert counts[1] == counts[2] == 1
    assert counts.sum() == 2
    # From below a tread's underside is seen, and from behind a riser's back.
    assert count_returns(flight, points, before - [0.0, 0.0, 1.4]).tolist()[1:3] == [0, 1]
    behind = flight.base + 5.0 * flight.forward + [0.0, 0.0, 1.5]
    assert count_returns(flight, points, behind).tolist()[1:3] == [1, 0]


def test_the_face_beside_a_flight_is_no_return_of_its_steps() -> None:
    (stairway,) = make_scene("free_standing", 0).stairways
    (flight,) = stairway.flights
    side = [1.5 * flight.run, 0.5 * flight.width - 1e-9, 2 * flight.rise]
    point = np.array([side]) @ flight.map_from_flight[:3, :3].T + flight.base
    assert not count_returns(flight, point, flight.base + np.array([0.0, 0.0, 1.5])).any()


def test_a_flight_can_be_found_when_three_steps_gave_returns_from_near_by() -> None:
    (stairway,) = make_scene("free_standing", 0).stairways
    (flight,) = stairway.flights
    counter = ReturnCounter([flight])
    treads = np.array([[(k + 0.5) * flight.run, 0.0, (k + 1) * flight.rise] for k in range(3)])
    points = np.repeat(treads, MIN_RETURNS, axis=0) @ flight.map_from_flight[:3, :3].T + flight.base
    counter.add(points, flight.base - 3.0 * flight.forward + [0.0, 0.0, 1.5])
    (returns,) = counter.result()
    assert returns.can_be_found(4.0)
    assert not returns.can_be_found(2.0)
    assert returns.is_measured(4.0).tolist() == [True] * 3 + [False] * (flight.num_risers - 3)


@pytest.mark.parametrize("name", sorted(LIDARS))
def test_a_bag_of_each_driver_gives_back_the_sweeps_and_the_odometry(name: str, tmp_path: Path) -> None:
    drive = LidarDrive(make_scene("free_standing", 0), LIDARS[name], ROBOTS["spot"], seed=0, num_frames=4)
    folder = write_lidar_drive(tmp_path / "walk", drive, seed=0)
    recording = SweepRecording(folder)
    path = recording.check_poses()
    for found, sweep in zip(drive.sweeps(), recording, strict=True):
        assert sweep.stamp_ns == START_NS + found.sweep.stamp_ns
        np.testing.assert_array_equal(sweep.points, found.sweep.points)
        np.testing.assert_allclose(sweep.offsets_ns, found.sweep.offsets_ns, atol=300)
        np.testing.assert_allclose(
            path.pose_at(sweep.stamp_ns), drive.odometry_path.pose_at(found.sweep.stamp_ns), atol=1e-6
        )
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["sensor"] == name
    assert len(truth["visibility"][0]["num_returns"]) == truth["stairways"][0]["flights"][0]["num_risers"]


def test_the_command_writes_a_bag_for_a_lidar(tmp_path: Path) -> None:
    outcome = stairmap(
        "simulate", "free_standing", "--sensor", "vlp16", "--frames", "3", "-o", tmp_path / "walk"
    )
    assert outcome.code == 0, outcome.stderr
    assert SweepRecording(tmp_path / "walk").num_sweeps == 2
    refused = stairmap(
        "simulate", "free_standing", "--sensor", "vlp16", "--factor", "0.5", "-o", tmp_path / "b"
    )
    assert refused.code == 2
    assert "--factor is for cameras" in refused.stderr
