from __future__ import annotations

import numpy as np
import pytest
from flight_views import View, make_flight, make_view

from stairmap.arrays import Points
from stairmap.detection.observation import Detection, Rejection
from stairmap.stairway import Flight, Landing, Stairway
from stairmap.trajectory import Trajectory
from stairmap.transforms import transform_points


@pytest.fixture(scope="session")
def flight() -> Flight:
    return make_flight()


@pytest.fixture(scope="session")
def stairway(flight: Flight) -> Stairway:
    return Stairway(id=1, flights=(flight,), num_observations=57, first_seen_ns=0, last_seen_ns=5)


@pytest.fixture(scope="session")
def turning_stairway() -> Stairway:
    """Two flights with a half-turn landing, the second one unbounded to its right."""
    first = make_flight(heading=0.0, num_risers=6)
    top = first.base + np.array([5 * first.run, 0.0, 6 * first.rise])
    landing = Landing(center=top + np.array([0.6, 0.7, 0.0]), size=(1.2, 2.6), heading=0.0)
    second = make_flight(
        base=top + np.array([0.0, 1.4, 0.0]), heading=np.pi, num_risers=5, right_bounded=False, width=0.9
    )
    return Stairway(
        id=2, flights=(first, second), landings=(landing,), num_observations=31,
        first_seen_ns=0, last_seen_ns=9,
    )  # fmt: skip


@pytest.fixture(scope="session")
def views(flight: Flight) -> list[View]:
    return [make_view(flight, distance=3.2 - 0.12 * i, stamp_ns=i * 100_000_000, seed=i) for i in range(12)]


@pytest.fixture(scope="session")
def trajectory(views: list[View]) -> Trajectory:
    return Trajectory(
        stamps_ns=np.array([view.frame.stamp_ns for view in views]),
        map_from_camera=np.array([view.map_from_camera for view in views]),
    )


@pytest.fixture
def rejected() -> Detection:
    return Detection(
        stamp_ns=7,
        observations=(),
        rejections=(
            Rejection(rule="min_steps", measured=2, limit=3, unit="1"),
            Rejection(rule="max_rise", measured=0.45, limit=0.26, unit="m"),
            Rejection(rule="min_width", measured=0.31, limit=0.5, unit="m"),
            Rejection(rule="up", measured=float("nan"), limit=6, unit="deg"),
        ),
    )


@pytest.fixture(scope="session")
def nosings(views: list[View]) -> Points:
    return np.concatenate(
        [
            transform_points(view.map_from_camera, np.array([edge.nosing for edge in observation.edges]))
            for view in views
            for observation in view.detection.observations
        ]
    )
