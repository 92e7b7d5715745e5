"""Carry flights whose ends nobody saw on to the floors that they must reach.

A flight that was seen in part ends at the last nosing seen. The floor it leads to is often known otherwise:
the robot stood there, or saw its edge. Then the missing risers are added, so that nothing that is built on
the end, a mask or a staging pose, lies on steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stairmap.drop import Drop
from stairmap.modeling.landings import top_of
from stairmap.navigation.floors import FloorStack
from stairmap.stairway import Flight, Stairway

OPEN_MARGIN = 1.2
"""Stairs may go on so far beyond an end that nobody saw where nothing tells of their floor, m: four runs."""

MAX_RISE_LEFT = 0.35
"""A drop is the edge of the floor that a flight leads to when it lies within this of its height, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CarriedStairway:
    """A stairway that reaches its floors, as far as they are known.

    Attributes
    ----------
    stairway
        With the risers that its ends lacked.
    unknown_below, unknown_above
        How far beyond its lower and upper end it may go on, m: nothing where the end was seen, a run where
        risers were added, and ``OPEN_MARGIN`` where the floor is not known.
    """

    stairway: Stairway
    unknown_below: float = 0.0
    unknown_above: float = 0.0


def carry_to_floors(stairway: Stairway, floors: FloorStack, drops: Sequence[Drop] = ()) -> CarriedStairway:
    """Return a stairway with the risers that its unseen ends lack.

    Parameters
    ----------
    stairway
        Its lower end is carried down, its upper end up.
    floors
        Which floors it joins.
    drops
        Edges of the ground: one that belongs to the stairway at its upper floor tells where it ends.
    """
    lower, upper = (floors.floor(level) for level in floors.levels[stairway.id])
    flights = list(stairway.flights)
    below = above = 0.0
    if flights[0].is_open_below:
        flight = flights[0]
        missing = 0 if lower.is_open else _num_missing(float(flight.base[2]) - lower.height, flight)
        flights[0] = _with_risers_below(flight, missing)
        below = _unknown(flight, missing, is_open=lower.is_open)
    last = flights[-1]
    if last.is_open_above:
        top = float(top_of(last)[2])
        edge = _find_edge(stairway.id, last, upper.height, drops)
        missing = 0 if upper.is_open else _num_missing(upper.height - top, last)
        above = _unknown(last, missing, is_open=upper.is_open)
        if edge is not None:
            # The edge of the floor was seen, though not as a nosing of these stairs.
            missing = max(round(edge / last.run) + 1 - last.num_risers, 0)
            above = 0.5 * last.run
        flights[-1] = replace(last, num_risers=last.num_risers + missing)
    return CarriedStairway(
        stairway=replace(stairway, flights=tuple(flights)), unknown_below=below, unknown_above=above
    )


def _num_missing(height: float, flight: Flight) -> int:
    """How many risers make up a height, at least none."""
    return max(round(height / flight.rise), 0)


def _unknown(flight: Flight, missing: int, *, is_open: bool) -> float:
    """How far a flight may go on beyond its carried end, m: one riser more than was reckoned, or unknown."""
    if is_open:
        return OPEN_MARGIN
    return flight.run if missing else 0.0


def _with_risers_below(flight: Flight, missing: int) -> Flight:
    base = flight.base - missing * (flight.run * flight.forward + np.array([0.0, 0.0, flight.rise]))
    return replace(flight, base=base, num_risers=flight.num_risers + missing)


def _find_edge(stairway_id: int, flight: Flight, height: float, drops: Sequence[Drop]) -> float | None:
    """How far along a flight the edge of its upper floor was seen, m; ``None`` where it was not."""
    places = [
        float((drop.center - flight.base) @ flight.forward)
        for drop in drops
        if drop.stairway_id == stairway_id and abs(float(drop.center[2]) - height) < MAX_RISE_LEFT
    ]
    return max(places, default=None)
