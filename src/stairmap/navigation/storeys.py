"""Stairways cut where a landing is a floor.

The model joins flights whose ends meet at a landing, also where that landing is the floor of a storey, as in
a scissor stair with one long flight a storey. A planner wants a link for each storey.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from stairmap.stairway import Flight, Stairway

MIN_STOREY_RISE = 2.3
"""A flight that rises by so much joins two floors by itself, m: no storey of a building is lower."""


def split_at_floors(stairways: Sequence[Stairway]) -> tuple[Stairway, ...]:
    """Cut stairways at landings that are floors: between flights that each rise by a storey.

    Parameters
    ----------
    stairways
        As the model gives them.

    Returns
    -------
    The same, or their parts. The lowest part keeps the id; the others get new ones, counted on from
    the largest. Observations and stamps stay those of the whole.
    """
    next_id = max((stairway.id for stairway in stairways), default=0) + 1
    result: list[Stairway] = []
    for stairway in stairways:
        begins = _storey_begins(stairway.flights)
        for number, (begin, end) in enumerate(zip(begins, [*begins[1:], len(stairway.flights)], strict=True)):
            part_id = stairway.id
            if number:
                part_id, next_id = next_id, next_id + 1
            result.append(
                replace(
                    stairway,
                    id=part_id,
                    flights=stairway.flights[begin:end],
                    landings=stairway.landings[begin : end - 1],
                )
            )
    return tuple(result)


def _storey_begins(flights: Sequence[Flight]) -> list[int]:
    """Index of the first flight of each storey."""
    begins = [0]
    for index, (below, above) in enumerate(pairwise(flights), start=1):
        # The top flight may have been seen in part.
        needed = MIN_STOREY_RISE / 2 if index == len(flights) - 1 else MIN_STOREY_RISE
        if below.num_risers * below.rise >= MIN_STOREY_RISE and above.num_risers * above.rise >= needed:
            begins.append(index)
    return begins
