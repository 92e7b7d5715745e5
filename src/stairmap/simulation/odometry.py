"""What a robot believes about its motion: odometry with noise and bias, and its correction.

Truth, odometry and the corrected trajectory share the first pose: the map is anchored
there, so everything that differs later is drift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.transforms import interpolate_poses, invert_transform

_NOISE_STEP = 0.1
"""Length of the step that the motion model's α are given for, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryModel:
    """Error of odometry: sample_motion_model_odometry of Probabilistic Robotics, table 5.6, plus bias.

    A step turns by ``rot1``, drives ``trans``, turns by ``rot2``. Each is disturbed with variance
    ``α1 rot² + α2 trans²``, and ``α3 trans² + α4 (rot1² + rot2²)`` for ``trans``.

    Attributes
    ----------
    alphas
        α1 to α4 for steps of 0.1 m. For shorter steps the variances shrink with the step, not
        with its square, so that the drift per metre does not depend on the frame rate.
    scale_bias
        Standard deviation of the constant relative error of distance; 1-2 % is usual.
    heading_bias
        Standard deviation of the constant heading drift, rad/m; 0.3-1 deg/m is usual.
    tilt_std
        Standard deviation of roll and pitch, rad; 0.3-0.5 deg with an IMU.
    tilt_memory
        Time over which an IMU's tilt error persists, s (ours).
    """

    alphas: tuple[float, float, float, float] = (5e-3, 1e-3, 1e-3, 5e-4)
    scale_bias: float = 0.015
    heading_bias: float = float(np.radians(0.6))
    tilt_std: float = float(np.radians(0.4))
    tilt_memory: float = 0.5


PERFECT_ODOMETRY = OdometryModel(alphas=(0, 0, 0, 0), scale_bias=0, heading_bias=0, tilt_std=0)
"""Odometry without error."""


def sample_odometry(planar: Float64Array, model: OdometryModel, random: np.random.Generator) -> Float64Array:
    """Return the (N, 4) x, y, floor height and heading that odometry gives for a true (N, 4) motion.

    The first row is the true one; heights are taken as they are.
    """
    a1, a2, a3, a4 = model.alphas
    scale = 1 + model.scale_bias * random.standard_normal()
    drift = model.heading_bias * random.standard_normal()
    believed = planar.copy()
    for index in range(1, len(planar)):
        (x, y, _, heading), (next_x, next_y, _, next_heading) = planar[index - 1], planar[index]
        trans = float(np.hypot(next_x - x, next_y - y))
        turn = next_heading - heading
        # On the spot the direction of motion means nothing: all of the turn is the second one.
        rot1 = float(_wrapped(np.arctan2(next_y - y, next_x - x) - heading)) if trans > 1e-6 else 0.0
        rot2 = turn - rot1
        noise = random.standard_normal(3)
        trans_square = trans * _NOISE_STEP
        std1 = np.sqrt(a1 * rot1**2 + a2 * trans_square)
        std2 = np.sqrt(a1 * rot2**2 + a2 * trans_square)
        std_trans = np.sqrt(a3 * trans_square + a4 * (rot1**2 + rot2**2))
        rot1 += std1 * noise[0] + drift * trans / 2
        rot2 += std2 * noise[1] + drift * trans / 2
        trans = trans * scale + std_trans * noise[2]
        last = believed[index - 1]
        believed[index, 0] = last[0] + trans * np.cos(last[3] + rot1)
        believed[index, 1] = last[1] + trans * np.sin(last[3] + rot1)
        believed[index, 3] = last[3] + rot1 + rot2
    return believed


def sample_attitude(
    attitude: Float64Array, stamps_ns: IntArray, model: OdometryModel, random: np.random.Generator
) -> Float64Array:
    """Return the (N, 3) roll, pitch and bounce that an IMU gives for the true (N, 3) ones.

    The tilt error is a first-order Gauss-Markov process that starts at zero, because the map is
    anchored at the true first pose.
    """
    believed = attitude.copy()
    error = np.zeros(2)
    for index in range(1, len(attitude)):
        seconds = (stamps_ns[index] - stamps_ns[index - 1]) * 1e-9
        keep = np.exp(-seconds / model.tilt_memory)
        error = keep * error + model.tilt_std * np.sqrt(1 - keep**2) * random.standard_normal(2)
        believed[index, :2] += error
    return believed


def close_loop(stamps_ns: IntArray, odometry: Float64Array, true_poses: Float64Array) -> Float64Array:
    """Return the (N, 4, 4) trajectory after a loop closure has corrected it.

    The last pose becomes the true one, as if the robot had recognised the place; the
    correction is spread evenly over time, as a pose graph of equal edges would.

    Parameters
    ----------
    stamps_ns
        (N,) stamps.
    odometry, true_poses
        (N, 4, 4) ``map_from_camera``, equal in the first pose.
    """
    corrections = np.array(
        [true_poses[index] @ invert_transform(odometry[index]) for index in (0, len(odometry) - 1)]
    )
    spread = interpolate_poses(stamps_ns[[0, -1]], corrections, stamps_ns)
    return np.asarray(spread @ odometry)


def find_drift(odometry: Float64Array, true_poses: Float64Array) -> Float64Array:
    """Return for each frame the (N, 4, 4) ``odometry_map_from_true_map``.

    It takes a true point to where a method that trusts the odometry must put it when it sees it
    in that frame: the part of an error in place that is no fault of the method.

    Parameters
    ----------
    odometry, true_poses
        (N, 4, 4) ``map_from_camera``.
    """
    return np.array(
        [believed @ invert_transform(true) for believed, true in zip(odometry, true_poses, strict=True)]
    )


def _wrapped(angle: float) -> float:
    return (angle + np.pi) % (2 * np.pi) - np.pi
