"""Flights that belong to one stairway, and the landings between them.

A stairway joins two floors, so it ends where a landing is a floor. Flights alone tell that in two cases: a
flight rises by a storey and so does the next, as in scissor stairs; or a storey has been climbed and the
next flight stands over the one that it began with, as stairs repeat themselves from floor to floor. In all
other cases it is unknown, and the flights stay together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Vector
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight, Landing
from stairmap.transforms import invert_transform, transform_points

MAX_LANDING_STEP = 0.10
"""Largest difference between the top of one flight and the foot of the next, m ..."""

LANDING_STEP_SHARE = 0.6
"""... or this share of the rise, if that is more: a riser at either end may have been missed by half."""

STEP_COST = 5.0
"""Among flights that may follow, a metre of height counts as this many metres of way."""

MAX_LANDING_LENGTH = 3.0
"""Largest level distance between the end of one flight and the foot of the next, m."""

MIN_STOREY_RISE = 2.3
"""Floors are at least so far apart, m: no storey of a building is lower."""

MAX_PLAN_OFFSET = 1.0
"""A flight stands over another when their feet are no farther apart in plan, m: drift and floor finish ..."""

MAX_PLAN_TURN = float(np.radians(25))
"""... and their headings differ by no more, rad."""


def top_of(flight: Flight) -> Vector:
    """(3,) middle of a flight's last nosing, where the landing begins, m, map."""
    local = np.array([(flight.num_risers - 1) * flight.run, 0.0, flight.num_risers * flight.rise])
    return np.asarray(transform_points(flight.map_from_flight, local))


def join_flights(flights: Sequence[Flight]) -> list[list[int]]:
    """Chain flights that a landing joins, each chain from the lowest flight up to the next floor.

    A flight follows another when its foot is as high as the other's top and near it, and the landing between
    them is no floor (``find_storeys``).

    Returns
    -------
    Indices of the flights of each stairway.
    """
    following: dict[int, int] = {}
    taken: set[int] = set()
    for below, above in _find_neighbours(flights):
        if below not in following and above not in taken and not _reaches(following, above, below):
            following[below] = above
            taken.add(above)
    chains = []
    for start in range(len(flights)):
        if start not in taken:
            chain = [start]
            while chain[-1] in following:
                chain.append(following[chain[-1]])
            begins = find_storeys([flights[index] for index in chain])
            chains += [chain[low:high] for low, high in zip(begins, [*begins[1:], len(chain)], strict=True)]
    return chains


def _find_neighbours(flights: Sequence[Flight]) -> list[tuple[int, int]]:
    """Pairs (below, above) of flights of which one begins where the other ends, the nearest first."""
    if len(flights) < 2:
        return []
    feet = np.array([flight.base for flight in flights])
    length = np.array([(flight.num_risers - 1) * flight.run for flight in flights])
    height = np.array([flight.num_risers * flight.rise for flight in flights])
    heading = np.array([flight.heading for flight in flights])
    tops = feet + np.stack([length * np.cos(heading), length * np.sin(heading), height], axis=1)
    between = tops[:, None] - feet
    level, step = np.hypot(between[..., 0], between[..., 1]), np.abs(between[..., 2])
    limit = np.maximum(MAX_LANDING_STEP, LANDING_STEP_SHARE * np.array([flight.rise for flight in flights]))
    follows = (step < limit[:, None]) & (level < MAX_LANDING_LENGTH)
    below, above = np.nonzero(follows)
    cost = level[below, above] + STEP_COST * step[below, above]
    order = np.lexsort((above, below, cost))
    return list(zip(below[order].tolist(), above[order].tolist(), strict=True))


def find_storeys(flights: Sequence[Flight]) -> list[int]:
    """Tell which flights of a chain begin on a floor.

    Parameters
    ----------
    flights
        From the lowest up, joined by landings.

    Returns
    -------
    Indices in ascending order, the first of them 0.
    """
    begins = [0]
    for index in range(1, len(flights)):
        below, above = flights[index - 1], flights[index]
        first = flights[begins[-1]]
        climbed = sum(flight.num_risers * flight.rise for flight in flights[begins[-1] : index])
        # The last flight may have been seen in part.
        needed = MIN_STOREY_RISE / 2 if index == len(flights) - 1 else MIN_STOREY_RISE
        are_storeys = (
            below.num_risers * below.rise >= MIN_STOREY_RISE and above.num_risers * above.rise >= needed
        )
        if are_storeys or (climbed >= MIN_STOREY_RISE and _stands_over(above, first)):
            begins.append(index)
    return begins


def _stands_over(upper: Flight, lower: Flight) -> bool:
    offset = float(np.hypot(*(upper.base - lower.base)[:2]))
    turn = abs(wrapped_angle(upper.heading - lower.heading))
    return offset <= MAX_PLAN_OFFSET and turn <= MAX_PLAN_TURN


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
    local = transform_points(flight_from_map, np.concatenate([upper.edges()[0], lower.edges()[-1]]))
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
