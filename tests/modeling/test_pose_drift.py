"""Drift of the poses widens place and heading, and nothing that single frames measure."""

from __future__ import annotations

import numpy as np
import pytest

from ideal_observations import make_flight, observe_all, poses_before, the_only, trajectory_of
from stairmap.config import load_config
from stairmap.modeling.mapper import StairwayMapper
from stairmap.modeling.pose_drift import travelled_at, widened_by_drift
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
