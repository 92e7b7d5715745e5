"""Flights that belong to one stairway, and the landings between them."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Vector
from stairmap.stairway import Flight, Landing
from stairmap.transforms import invert_transform, transform_points

MAX_LANDING_STEP = 0.10
"""Largest difference between the top of one flight and the foot of the next, m."""

MAX_LANDING_LENGTH = 3.0
"""Largest level distance between the end of one flight and the foot of the next, m."""


def top_of(flight: Flight) -> Vector:
    """(3,) middle of a flight's last nosing, where the landing begins, m, map."""
    local = np.array([(flight.num_risers - 1) * flight.run, 0.0, flight.num_risers * flight.rise])
    return np.asarray(transform_points(flight.map_from_flight, local))


def join_flights(flights: list[Flight]) -> list[list[int]]:
    """Chain flights that a landing joins, each chain from the lowest flight up.

    A flight follows another when its foot is as high as the other's top and near it.

    Returns
    -------
    Indices of the flights of each stairway.
    """
    following: dict[int, int] = {}
    taken: set[int] = set()
    pairs = []
    for below, lower in enumerate(flights):
        for above, upper in enumerate(flights):
            if below != above:
                top, foot = top_of(lower), upper.base
                level = float(np.hypot(*(top - foot)[:2]))
                step = abs(float(top[2] - foot[2]))
                if step < max(MAX_LANDING_STEP, 0.6 * lower.rise) and level < MAX_LANDING_LENGTH:
                    pairs.append((level + 5.0 * step, below, above))
    for _, below, above in sorted(pairs):
        if below not in following and above not in taken and not _reaches(following, above, below):
            following[below] = above
            taken.add(above)
    chains = []
    for start in range(len(flights)):
        if start not in taken:
            chain = [start]
            while chain[-1] in following:
                chain.append(following[chain[-1]])
            chains.append(chain)
    return chains


def _reaches(following: dict[int, int], start: int, goal: int) -> bool:
    """Whether following the chain from one flight leads to another."""
    while start in following:
        start = following[start]
        if start == goal:
            return True
    return start == goal


def make_landing(lower: Flight, upper: Flight) -> Landing:
    """Return the landing between two flights: the level rectangle, along the lower one's
    heading, that both ends share.

    Where the flights turn, its far side was not measured; a landing is at least as deep as
    the wider flight (building codes ask for it), so that is what it gets.
    """
    flight_from_map = invert_transform(lower.map_from_flight)
    foot = upper.edges()[0].copy()
    foot[:, 2] -= upper.rise
    local = transform_points(flight_from_map, np.concatenate([foot, lower.edges()[-1]]))
    begin = (lower.num_risers - 1) * lower.run
    straight = abs((upper.heading - lower.heading + np.pi) % (2 * np.pi) - np.pi) < np.radians(30)
    end = (
        float(local[:2, 0].mean())
        if straight
        else max(float(local[:, 0].max()), begin + max(lower.width, upper.width))
    )
    end = max(end, begin + 0.1)
    low, high = float(local[:, 1].min()), float(local[:, 1].max())
    height = lower.num_risers * lower.rise
    center = transform_points(lower.map_from_flight, np.array([(begin + end) / 2, (low + high) / 2, height]))
    return Landing(center=center, size=(end - begin, high - low), heading=lower.heading)
