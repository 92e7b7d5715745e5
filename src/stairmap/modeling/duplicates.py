"""One stairway reported once: flights fitted to poor views of a better one."""

from __future__ import annotations

import numpy as np

from stairmap.modeling.fitting import FittedFlight
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_points

MAX_TURN = np.radians(30.0)
"""Two flights in one place that head more than this apart are two."""

MARGIN = 0.25
"""How far outside the better flight's box, m, the nosings of a poor view of it may lie."""


def without_duplicates(fitted: list[FittedFlight]) -> list[FittedFlight]:
    """Drop each flight most of whose nosings lie on a flight with more observations.

    Flights are told apart by dimension too, so a few frames that measured a step badly make a
    second flight in the same place; it is withdrawn here.
    """
    kept: list[FittedFlight] = []
    for item in sorted(fitted, key=lambda candidate: -len(candidate.members)):
        if not any(_lies_on(item.flight, other.flight) for other in kept):
            kept.append(item)
    return kept


def _lies_on(flight: Flight, other: Flight) -> bool:
    """Whether most nosings of a flight lie along the other's nosing line and between its sides."""
    turn = abs((flight.heading - other.heading + np.pi) % (2 * np.pi) - np.pi)
    if turn > MAX_TURN:
        return False
    middles = flight.edges().mean(axis=1)
    x, y, z = transform_points(invert_transform(other.map_from_flight), middles).T
    offset = z - other.rise - x * other.rise / other.run
    length = (other.num_risers - 1) * other.run
    on = (
        (x > -other.run - MARGIN)
        & (x < length + other.run + MARGIN)
        & (np.abs(y) < other.width / 2)
        & (np.abs(offset) < MARGIN)
    )
    return bool(np.count_nonzero(on) > 0.5 * len(on))
