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


def travelled_at(trajectory: Trajectory, stamps_ns: IntArray) -> Float64Array:
    """Return the way of the camera from the first pose until each of (N,) stamps, m."""
    places = trajectory.map_from_camera[:, :3, 3]
    way = np.zeros(len(places))
    last = 0
    for index in range(1, len(places)):
        hop = float(np.linalg.norm(places[index] - places[last]))
        way[index] = way[last] + hop
        if hop >= MIN_HOP:
            last = index
    return np.asarray(np.interp(stamps_ns, trajectory.stamps_ns, np.maximum.accumulate(way)))


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
