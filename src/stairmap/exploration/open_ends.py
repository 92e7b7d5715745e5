"""Ends of modelled flights that nobody saw and that may lie on the level where the robot is.

A flight whose lowest steps were hidden is modelled from higher up. No level is known at its end, so it is no
way anywhere until a look shows where it begins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stairmap.arrays import Vector, readonly
from stairmap.exploration.levels import SAME_LEVEL, Level
from stairmap.exploration.stair_links import Link
from stairmap.modeling.landings import top_of

MAX_UNSEEN = 1.2
"""Steps between an end and the level that nobody saw are at most so high together, m: more are another
flight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenEnd:
    """Where a flight meets a level if it goes on as it is.

    Attributes
    ----------
    link
        The flight.
    place
        (2,) middle of its first riser or last nosing there, m, map.
    is_up
        Whether it leads up from there.
    unseen
        Height of the steps that nobody saw, m.
    """

    link: Link
    place: Vector
    is_up: bool
    unseen: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "place", readonly(self.place))


def find_open_ends(links: Sequence[Link], level: Level) -> list[OpenEnd]:
    """Return the open ends of flights that may lie on a level; closed ends and those on it already do not."""
    found = []
    for link in links:
        if link.state != "open" or level.number in (link.lower, link.upper):
            continue
        flight = link.flight
        for is_up, is_open, end in (
            (True, flight.is_open_below, flight.base),
            (False, flight.is_open_above, top_of(flight)),
        ):
            unseen = float(end[2] - level.height) * (1 if is_up else -1)
            if not is_open or not SAME_LEVEL <= unseen <= MAX_UNSEEN:
                continue
            way = unseen * flight.run / flight.rise * (-1 if is_up else 1)
            place = (end + way * flight.forward)[:2]
            found.append(OpenEnd(link=link, place=place, is_up=is_up, unseen=unseen))
    return found
