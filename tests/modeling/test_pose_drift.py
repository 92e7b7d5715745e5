"""Drift of the poses widens place and heading, and nothing that single frames measure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ideal_observations import make_flight, observe_all, poses_before, the_only, trajectory_of
from stairmap.config import load_config
from stairmap.modeling.mapper import StairwayMapper
from stairmap.modeling.pose_drift import CameraWay, travelled_at, widened_by_drift
from stairmap.trajectory import Trajectory

FLIGHT = make_flight()
POSES = poses_before(FLIGHT, 12)


def straight_way(num_poses, *, step, shake=0.0):
    poses = np.tile(np.eye(4), (num_poses, 1, 1))
    poses[:, 0, 3] = step * np.arange(num_poses)
    poses[:, 1, 3] = shake * (-1.0) ** np.arange(num_poses)
    return Trajectory(stamps_ns=np.arange(num_poses) * 100, map_from_camera=poses)


def stairway_with(*overrides):
    mapper = StairwayMapper(load_config(None, overrides))
    for observation in observe_all(FLIGHT, POSES):
        mapper.add(observation)
    return the_only(mapper.stairways(trajectory_of(POSES)))


def test_the_way_is_counted_from_the_first_pose():
    way = travelled_at(straight_way(11, step=0.2), np.array([0, 500, 1000]))
    assert way == pytest.approx([0.0, 1.0, 2.0])


def test_shaking_adds_little_to_the_way():
    way = travelled_at(straight_way(101, step=0.02, shake=0.01), np.array([10_000]))
    assert way[0] == pytest.approx(2.0, rel=0.05)


def test_a_camera_that_stands_has_no_way():
    assert travelled_at(straight_way(1, step=0.0), np.array([0]))[0] == 0.0


def test_a_way_of_short_hops_is_counted_from_where_the_last_long_one_ended():
    # 0.09 m there and back is shaking; 0.11 m is a hop.
    for hop, expected in ((0.09, 0.09), (0.11, 0.44)):
        poses = np.tile(np.eye(4), (5, 1, 1))
        poses[:, 0, 3] = [0.0, hop, 0.0, hop, 0.0]
        there_and_back = Trajectory(stamps_ns=np.arange(5) * 100, map_from_camera=poses)
        assert travelled_at(there_and_back, np.array([400]))[0] == pytest.approx(expected)


def test_a_trajectory_that_goes_on_has_the_way_of_the_whole():
    whole = straight_way(101, step=0.03, shake=0.02)
    stamps = np.array([0, 1234, 5000, 10_000])
    way = CameraWay()
    for num in (1, 7, 8, 50, 101):
        part = Trajectory(stamps_ns=whole.stamps_ns[:num], map_from_camera=whole.map_from_camera[:num])
        way.follow(part, goes_on=num > 1)
    np.testing.assert_array_equal(way.until(stamps), travelled_at(whole, stamps))
    way.follow(straight_way(11, step=0.2), goes_on=False)
    assert way.until(np.array([1000]))[0] == pytest.approx(2.0)


def test_drift_adds_to_what_is_known_of_place_and_heading_by_squares():
    flight = make_flight(std=replace(FLIGHT.std, base=np.array([0.3, 0.4, 0.0]), heading=0.03))
    widened = widened_by_drift(flight, 10.0, drift=0.04, heading_drift=0.004)
    assert widened.std.base == pytest.approx([0.5, np.hypot(0.4, 0.4), 0.4])
    assert widened.std.heading == pytest.approx(0.05)


def test_place_and_heading_are_as_uncertain_as_the_drift():
    widened = widened_by_drift(FLIGHT, 10.0, drift=0.03, heading_drift=0.01)
    assert np.all(widened.std.base >= 0.3)
    assert widened.std.heading >= 0.1
    assert (widened.std.rise, widened.std.run, widened.std.width) == (
        FLIGHT.std.rise,
        FLIGHT.std.run,
        FLIGHT.std.width,
    )
    assert np.array_equal(widened.base, FLIGHT.base)


def test_configured_drift_widens_a_stairway_in_proportion_to_the_way():
    plain = stairway_with().flights[0]
    drifted = stairway_with("modeling.pose_drift=0.1", "modeling.pose_heading_drift_deg=2").flights[0]
    stamps = trajectory_of(POSES).stamps_ns
    way = travelled_at(trajectory_of(POSES), stamps).mean()
    assert drifted.std.base == pytest.approx(np.hypot(plain.std.base, 0.1 * way), rel=0.05)
    assert drifted.std.heading == pytest.approx(np.hypot(plain.std.heading, np.radians(2) * way), rel=0.05)
    assert (drifted.rise, drifted.run, drifted.std.rise) == (plain.rise, plain.run, plain.std.rise)
