"""Odometry errs as much as its model says."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.simulation.odometry import (
    PERFECT_ODOMETRY,
    OdometryModel,
    close_loop,
    find_drift,
    sample_attitude,
    sample_odometry,
)
from stairmap.simulation.robots import ROBOTS, camera_poses

STRAIGHT = np.stack([np.linspace(0, 10, 101), *np.zeros((3, 101))], axis=1)
"""10 m in steps of 0.1 m along +x."""


def ends(model: OdometryModel, motion: np.ndarray = STRAIGHT, num: int = 400) -> np.ndarray:
    return np.array([sample_odometry(motion, model, np.random.default_rng(seed))[-1] for seed in range(num)])


def test_perfect_odometry_is_the_truth() -> None:
    random = np.random.default_rng(0)
    turning = (
        STRAIGHT + np.stack([np.zeros(101), np.sin(np.arange(101) / 9), np.zeros(101), np.arange(101) / 30]).T
    )
    np.testing.assert_allclose(sample_odometry(turning, PERFECT_ODOMETRY, random), turning, atol=1e-9)


def test_the_first_pose_is_true() -> None:
    np.testing.assert_array_equal(
        sample_odometry(STRAIGHT, OdometryModel(), np.random.default_rng(0))[0], STRAIGHT[0]
    )


def test_distance_errs_by_its_bias() -> None:
    model = OdometryModel(alphas=(0, 0, 0, 0), scale_bias=0.015, heading_bias=0)
    assert (ends(model)[:, 0] - 10).std() == pytest.approx(0.15, rel=0.12)


def test_heading_drifts_by_its_bias_per_metre() -> None:
    model = OdometryModel(alphas=(0, 0, 0, 0), scale_bias=0, heading_bias=np.radians(0.6))
    assert ends(model)[:, 3].std() == pytest.approx(np.radians(6.0), rel=0.12)


def test_noise_is_that_of_the_motion_model() -> None:
    model = OdometryModel(alphas=(0, 1e-3, 1e-3, 0), scale_bias=0, heading_bias=0)
    errors = ends(model)
    # Two rotations per step, each of variance α2 trans², over 100 steps of 0.1 m.
    assert errors[:, 3].std() == pytest.approx(np.sqrt(2 * 100 * 1e-3 * 0.01), rel=0.12)


def test_drift_per_metre_does_not_depend_on_the_frame_rate() -> None:
    model = OdometryModel(scale_bias=0, heading_bias=0)
    coarse = ends(model)[:, 3].std()
    fine = ends(model, np.stack([np.linspace(0, 10, 401), *np.zeros((3, 401))], axis=1), 200)[:, 3].std()
    assert fine == pytest.approx(coarse, rel=0.2)


def test_tilt_errs_by_its_std_and_starts_true() -> None:
    stamps = np.arange(4000, dtype=np.int64) * 100_000_000
    model = OdometryModel()
    error = sample_attitude(np.zeros((4000, 3)), stamps, model, np.random.default_rng(0))
    assert error[50:, 0].std() == pytest.approx(model.tilt_std, rel=0.15)
    np.testing.assert_array_equal(error[0], 0)
    np.testing.assert_array_equal(error[:, 2], 0)


def test_a_closed_loop_ends_at_the_truth_and_is_nearer_to_it_in_between() -> None:
    stamps = np.arange(101, dtype=np.int64) * 100_000_000
    level = np.zeros((101, 3))
    robot = ROBOTS["packbot"]
    true = camera_poses(STRAIGHT, level, robot)
    random = np.random.default_rng(3)
    odometry = camera_poses(sample_odometry(STRAIGHT, OdometryModel(), random), level, robot)
    corrected = close_loop(stamps, odometry, true)
    np.testing.assert_allclose(corrected[[0, -1]], true[[0, -1]], atol=1e-9)
    before = np.linalg.norm(odometry[:, :3, 3] - true[:, :3, 3], axis=1)
    after = np.linalg.norm(corrected[:, :3, 3] - true[:, :3, 3], axis=1)
    assert after.mean() < 0.7 * before.mean()
    np.testing.assert_allclose(np.linalg.det(corrected[:, :3, :3]), 1.0, atol=1e-9)


def test_drift_takes_true_points_to_where_odometry_sees_them() -> None:
    level, robot = np.zeros((101, 3)), ROBOTS["packbot"]
    true = camera_poses(STRAIGHT, level, robot)
    believed = sample_odometry(STRAIGHT, OdometryModel(), np.random.default_rng(3))
    odometry = camera_poses(believed, level, robot)
    drift = find_drift(odometry, true)
    np.testing.assert_allclose(drift[0], np.eye(4), atol=1e-9)
    point = np.array([12.0, 1.0, 0.5, 1.0])
    in_camera = np.linalg.inv(true[-1]) @ point
    np.testing.assert_allclose(drift[-1] @ point, odometry[-1] @ in_camera, atol=1e-9)
