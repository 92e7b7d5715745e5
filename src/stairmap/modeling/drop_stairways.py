"""Tell which drops are the edges of stairways: the floor above a flight ends at its last nosing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stairmap.drop import Drop
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import invert_transform, transform_points

MAX_BEFORE = 0.40
"""A drop is of a flight from so far beyond its ends, m: a riser more or less of the model, drift."""

MAX_BESIDE = 0.30
"""... and so far beside its steps, m."""

MAX_ABOVE = 0.35
"""... and so far above or below the line of its nosings, m: two risers that nobody saw."""

MIN_AGREEMENT = 0.8
"""Cosine of the largest angle between the fall of the edge and the way down the stairs."""


def assign_drops(drops: Sequence[Drop], stairways: Sequence[Stairway]) -> tuple[Drop, ...]:
    """Return the drops, each with the number of the stairway that it is an edge of."""
    return tuple(replace(drop, stairway_id=_find_stairway(drop, stairways)) for drop in drops)


def _find_stairway(drop: Drop, stairways: Sequence[Stairway]) -> int | None:
    for stairway in stairways:
        if any(is_edge_of(drop, flight) for flight in stairway.flights):
            return stairway.id
    return None


def is_edge_of(drop: Drop, flight: Flight) -> bool:
    """Tell whether a drop is the edge at which the steps of a flight begin to lead down."""
    if -(drop.outward @ flight.forward) < MIN_AGREEMENT:
        return False
    along, across, above = transform_points(invert_transform(flight.map_from_flight), drop.center)
    length = (flight.num_risers - 1) * flight.run
    reach = MAX_BEFORE + (flight.run if flight.is_open_above else 0.0)
    if not -MAX_BEFORE <= along <= length + reach or abs(across) > flight.width / 2 + MAX_BESIDE:
        return False
    nosing = flight.rise + float(np.clip(along, 0.0, length)) * flight.rise / flight.run
    return bool(abs(above - nosing) <= MAX_ABOVE)
