"""Where the odometry put a true flight: truth moved into the drifted map.

The map drifts while a stairway is seen, and a method that trusts its poses must drift along. So a
true flight is moved by the mean drift over the frames in which the method observed it: each of
those frames takes the flight's base and heading to where an observation without error puts them,
and their mean is what an average over the observations would give. What is left is the method's own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform
from stairmap.detection.observation import StairObservation
from stairmap.stairway import Flight
from stairmap.transforms import transform_points

ON_FLIGHT_SIDE = 0.3
"""An edge's middle may lie this far beside a flight, m."""

ON_FLIGHT_HEIGHT = 0.75
"""An edge may lie this much above or below the line of nosings, in rises."""

ON_FLIGHT_SHARE = 0.5
"""Share of an observation's edges that must lie on a flight for it to be one of that flight."""


def move_flight(flight: Flight, drifts: Float64Array) -> Flight:
    """Return a flight where the mean of (N, 4, 4) drifts, N at least 1, puts it; its steps go along."""
    bases = drifts[:, :3, :3] @ flight.base + drifts[:, :3, 3]
    forwards = (drifts[:, :3, :3] @ flight.forward).mean(axis=0)
    base, heading = bases.mean(axis=0), float(np.arctan2(forwards[1], forwards[0]))
    moved = replace(flight, base=base, heading=heading, steps=())
    map_from_map = moved.map_from_flight @ np.linalg.inv(flight.map_from_flight)
    steps = tuple(replace(step, nosing=transform_points(map_from_map, step.nosing)) for step in flight.steps)
    return replace(moved, steps=steps)


def find_drift_spread(flight: Flight, drifts: Float64Array) -> float:
    """Return the standard deviation of a flight's base over (N, 4, 4) drifts, horizontal, m."""
    bases = drifts[:, :3, :3] @ flight.base + drifts[:, :3, 3]
    return float(np.sqrt(bases[:, :2].var(axis=0).sum()))


def find_observed_flight(
    observation: StairObservation, true_map_from_camera: Transform, flights: tuple[Flight, ...]
) -> int | None:
    """Return which true flight an observation is of, if any.

    At least half of its edges must have their middle on the flight: over its plan, with a margin
    of ``ON_FLIGHT_SIDE``, and near the line of its nosings.

    Parameters
    ----------
    observation
        In the camera frame.
    true_map_from_camera
        (4, 4) true pose.
    flights
        True flights in the true map.
    """
    middles = np.array([edge.nosing.mean(axis=0) for edge in observation.edges]).reshape(-1, 3)
    if len(middles) == 0 or not flights:
        return None
    points = transform_points(true_map_from_camera, middles)
    shares = [_is_on_flight(points, flight).mean() for flight in flights]
    best = int(np.argmax(shares))
    return best if shares[best] >= ON_FLIGHT_SHARE else None


def frames_of_flight(observed: list[list[int | None]], flight_index: int) -> IntArray:
    """Return the frames in which a flight was observed, given what each frame's observations were of."""
    return np.array([frame for frame, found in enumerate(observed) if flight_index in found], dtype=np.int64)


def _is_on_flight(points: Points, flight: Flight) -> Mask:
    local = (points - flight.base) @ flight.map_from_flight[:3, :3]
    end = (flight.num_risers - 1) * flight.run
    line = flight.rise * (1 + local[:, 0] / flight.run)
    return np.asarray(
        (local[:, 0] >= -0.75 * flight.run)
        & (local[:, 0] <= end + 0.75 * flight.run)
        & (np.abs(local[:, 1]) <= flight.width / 2 + ON_FLIGHT_SIDE)
        & (np.abs(local[:, 2] - line) <= ON_FLIGHT_HEIGHT * flight.rise)
    )
