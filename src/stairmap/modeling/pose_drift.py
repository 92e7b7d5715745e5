"""How far poses may have drifted until a flight was seen, in the uncertainty of its place.

Drift grows with the way of the camera. What single frames measure (rise, run, width, pitch) does not
feel it; place and heading in the map do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.stairway import Flight
from stairmap.trajectory import Trajectory

MIN_HOP = 0.1
"""The way is counted in hops of at least this length, m: shaking does not add to it."""


class CameraWay:
    """The way of the camera along a trajectory; one that goes on from the last costs what is new of it."""

    def __init__(self) -> None:
        self._way: list[float] = []
        self._last = 0
        self._stamps_ns: IntArray = np.zeros(0, dtype=np.int64)
        self._longest: Float64Array = np.zeros(0)

    def follow(self, trajectory: Trajectory, *, goes_on: bool) -> None:
        """Follow a trajectory; ``goes_on``: it has all poses of the one before, and perhaps more."""
        if not goes_on:
            self._way, self._last = [], 0
        places = trajectory.map_from_camera[:, :3, 3]
        for index in range(len(self._way), len(places)):
            hop = float(np.linalg.norm(places[index] - places[self._last])) if index else 0.0
            self._way.append((self._way[self._last] if index else 0.0) + hop)
            if hop >= MIN_HOP:
                self._last = index
        self._stamps_ns = trajectory.stamps_ns
        self._longest = np.maximum.accumulate(self._way)

    def until(self, stamps_ns: IntArray) -> Float64Array:
        """Return the way from the first pose until each of (N,) stamps, m."""
        return np.asarray(np.interp(stamps_ns, self._stamps_ns, self._longest))


def travelled_at(trajectory: Trajectory, stamps_ns: IntArray) -> Float64Array:
    """Return the way of the camera from the first pose until each of (N,) stamps, m."""
    way = CameraWay()
    way.follow(trajectory, goes_on=False)
    return way.until(stamps_ns)


def widened_by_drift(flight: Flight, travelled: float, *, drift: float, heading_drift: float) -> Flight:
    """Return a flight whose place and heading are as uncertain as poses are after some way.

    Parameters
    ----------
    flight
        As fitted.
    travelled
        Way from the map's origin until it was seen, m.
    drift
        Standard deviation of the drift, m per m.
    heading_drift
        The same of the heading, rad per m.
    """
    std = replace(
        flight.std,
        base=np.hypot(flight.std.base, drift * travelled),
        heading=float(np.hypot(flight.std.heading, heading_drift * travelled)),
    )
    return replace(flight, std=std)
