"""One stairway reported once: flights fitted to poor views of a better one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Mask
from stairmap.modeling.fitting import FittedFlight
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_points

MAX_TURN = np.radians(30.0)
"""Two flights in one place that head more than this apart are two."""

MARGIN = 0.25
"""How far outside the better flight's box, m, the nosings of a poor view of it may lie."""


def without_duplicates(fitted: Sequence[FittedFlight]) -> list[FittedFlight]:
    """Drop each flight most of whose nosings lie on a flight with more observations.

    Flights are told apart by dimension too, so a few frames that measured a step badly make a
    second flight in the same place; it is withdrawn here.
    """
    ranked = sorted(fitted, key=lambda candidate: -len(candidate.members))
    are_near = _find_near([item.flight for item in ranked])
    kept: list[int] = []
    for index, item in enumerate(ranked):
        rivals = (ranked[other].flight for other in kept if are_near[index, other])
        if not any(_lies_on(item.flight, rival) for rival in rivals):
            kept.append(index)
    return [ranked[index] for index in kept]


def _find_near(flights: Sequence[Flight]) -> Mask:
    """(F, F) which flights can have nosings on each other at all: most have not, and looking costs time."""
    base = np.array([flight.base for flight in flights]).reshape(-1, 3)
    rise, run, width, heading, num = np.array(
        [(flight.rise, flight.run, flight.width, flight.heading, flight.num_risers) for flight in flights]
    ).reshape(-1, 5).T  # fmt: skip
    half = np.stack([num * run, num * rise], axis=1) / 2
    center = base + np.stack([half[:, 0] * np.cos(heading), half[:, 0] * np.sin(heading), half[:, 1]], axis=1)
    radius = np.linalg.norm(half, axis=1) + width / 2 + run + rise + MARGIN
    apart = np.linalg.norm(center[:, None] - center, axis=2)
    return np.asarray(apart < radius[:, None] + radius)


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
