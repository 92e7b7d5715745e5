"""Covariances in messages agree with the deviations that a flight states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ideal_observations import make_flight
from stairmap.stairway import FlightStd
from stairmap_ros.covariances import measures_covariance, pose_covariance

STD = FlightStd(
    rise=0.003, run=0.004, width=0.02, pitch=0.012, heading=0.01, base=np.array([0.01, 0.02, 0.03])
)
FLIGHT = replace(make_flight(), std=STD)


def test_the_variance_of_pitch_is_that_of_many_flights() -> None:
    random = np.random.default_rng(0)
    rise, run = random.normal([FLIGHT.rise, FLIGHT.run], [STD.rise, STD.run], (200_000, 2)).T
    sampled = np.cov(np.stack([rise, run, np.arctan2(rise, run)]))
    stated = measures_covariance(FLIGHT)[np.ix_([0, 1, 3], [0, 1, 3])]
    np.testing.assert_allclose(stated, sampled, rtol=0.03, atol=1e-7)


def test_deviations_are_on_the_diagonals() -> None:
    np.testing.assert_allclose(np.sqrt(np.diag(measures_covariance(FLIGHT))[:3]), [0.003, 0.004, 0.02])
    np.testing.assert_allclose(np.sqrt(np.diag(pose_covariance(FLIGHT))), [0.01, 0.02, 0.03, 0, 0, 0.01])
