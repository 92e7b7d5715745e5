"""Flights of the stairways found so far as links between levels, with identities that stay.

A stairway may turn on landings. While a robot explores it knows some of its flights first and others later,
so each flight is a link of its own, and a landing is a level like others until it is told apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from stairmap.arrays import Points
from stairmap.exploration.levels import LevelBook
from stairmap.exploration.state_file import State
from stairmap.geometry import wrapped_angle
from stairmap.modeling.landings import top_of
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.footprints import EDGE_MARGIN, HEADROOM, Rectangle
from stairmap.navigation.portals import Portal, make_portal
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.traversability import assess
from stairmap.stairway import Flight, Stairway

MAX_TURN = math.radians(25)
"""Flights whose headings differ by more are not the same."""

MIN_PROBABILITY = 0.25
"""Stairs whose verdict stays unknown are tried if they are passable with at least this probability, however
their errors conspire: the robot feels each riser and turns back when they are too high."""

MAX_FAILURES = 2
"""Stairs on which so many climbs failed are given up: the robot may have stood askew the first time."""

UNEXPLORED = 1000
"""Numbers of levels that only stairs tell of begin here."""

LinkState = Literal["open", "climbed", "failed"]


@dataclass(slots=True, kw_only=True)
class Link:
    """A flight between two levels.

    Attributes
    ----------
    number
        From 1; it stays.
    flight
        Its newest model.
    stairway
        The stairway that it belongs to, with all its flights.
    portal
        What a planner sees of it.
    lower, upper
        Numbers of its levels; from ``UNEXPLORED`` on where the robot never stood.
    state
        Whether it was climbed, or why not.
    reason
        Why it failed.
    allow_unknown
        Whether it is also tried where the robot's limits are not known.
    num_failures
        How many climbs failed.
    looks
        How often the robot looked at it from its end.
    """

    number: int
    flight: Flight
    stairway: Stairway
    portal: Portal
    lower: int
    upper: int
    state: LinkState = "open"
    reason: str = ""
    looks: dict[int, int] = field(default_factory=dict)
    allow_unknown: bool = False
    num_failures: int = 0

    @property
    def probability(self) -> float:
        """Lowest probability that the robot can climb it."""
        return self.portal.assessment.probability[0]

    @property
    def is_climbable(self) -> bool:
        """Whether the robot goes there: passable, or not known and likely enough."""
        if self.state == "failed" or self.portal.verdict == "impassable":
            return False
        if self.portal.verdict == "passable" or self.probability >= MIN_PROBABILITY:
            return True
        # Nobody knows a limit, or it was not seen well: whoever asked for it takes the risk.
        return self.allow_unknown and self.portal.assessment.probability[1] >= MIN_PROBABILITY

    @property
    def fingerprint(self) -> tuple[object, ...]:
        """All that decides what can be done with it; another one where something of that changed."""
        measures = [*self.flight.base, self.flight.heading, self.flight.rise, self.flight.width]
        return (
            self.number, self.lower, self.upper, self.state, self.portal.verdict, self.flight.num_risers,
            sum(self.looks.values()), self.is_climbable, *np.round(measures, 2),
        )  # fmt: skip

    def note_failure(self, reason: str) -> None:
        """Note a climb that failed; risers that are too high, or a second failure, close the stairs."""
        self.num_failures += 1
        self.reason = reason
        if "riser" in reason or self.num_failures >= MAX_FAILURES:
            self.state = "failed"

    def footprint(self, level: int, height: float) -> Rectangle:
        """Return the ground that it takes on a level of a height, m."""
        flight = self.flight
        num, margin = flight.num_risers, 0.0
        if level == self.lower:
            num = min(num, max(1, int((height + HEADROOM - flight.base[2]) / flight.rise)))
        else:
            margin = EDGE_MARGIN / 2
        length = max(num - 1, 1) * flight.run + margin
        middle = flight.base + flight.forward * length / 2
        return Rectangle(
            center=(float(middle[0]), float(middle[1])),
            heading=flight.heading,
            length=length,
            width=flight.width,
        )


class StairBook:
    """All links so far.

    Parameters
    ----------
    profile
        What the robot can climb.
    allow_unknown
        Whether stairs are also tried where nobody knows that.
    """

    def __init__(self, profile: RobotProfile, *, allow_unknown: bool = False) -> None:
        self.links: list[Link] = []
        self._profile, self._allow_unknown = profile, allow_unknown
        self._num_made = 0

    def update(self, stairways: Sequence[Stairway], levels: LevelBook) -> None:
        """Take in the newest stairways: links move with their flights, and those that are gone go."""
        left = list(self.links)
        found: list[Link] = []
        for stairway in stairways:
            for flight in stairway.flights:
                same = [link for link in left if _is_same(link.flight, flight)]
                known = min(same, key=lambda link: _distance(link.flight, flight), default=None)
                if known is not None:
                    left.remove(known)
                found.append(self._link(known, flight, stairway, levels))
        # What was climbed stays: it was there.
        found += [link for link in left if link.state == "climbed"]
        self.links = sorted(found, key=lambda link: link.number)

    def refresh(self, levels: LevelBook) -> None:
        """Find anew which levels the links join, after a level was entered."""
        self.links = [self._link(link, link.flight, link.stairway, levels) for link in self.links]

    def state(self) -> State:
        """Return the links with what is known of them, to go on from."""
        links = [
            {
                "number": link.number,
                "flight": link.flight.to_dict(),
                "stairway": link.stairway.to_dict(),
                "state": link.state,
                "reason": link.reason,
                "looks": sorted(link.looks.items()),
                "num_failures": link.num_failures,
            }
            for link in self.links
        ]
        return {"num_made": self._num_made, "links": links}

    def restore(self, state: State, levels: LevelBook) -> None:
        """Go on from a state, with the levels of then.

        Raises
        ------
        ValueError, KeyError, TypeError
            If it is none.
        """
        self.links = []
        for saved in state["links"]:
            if saved["state"] not in get_args(LinkState):
                raise ValueError(f"a link is {saved['state']}")
            self._num_made = int(saved["number"]) - 1
            flight, stairway = Flight.from_dict(saved["flight"]), Stairway.from_dict(saved["stairway"])
            link = self._link(None, flight, stairway, levels)
            link.state, link.reason = saved["state"], str(saved["reason"])
            link.looks = {int(level): int(num) for level, num in saved["looks"]}
            link.num_failures = int(saved["num_failures"])
            self.links.append(link)
        self._num_made = int(state["num_made"])

    def link(self, number: int) -> Link | None:
        """Return a link by its number; ``None`` if it is gone."""
        return next((link for link in self.links if link.number == number), None)

    def _link(self, known: Link | None, flight: Flight, stairway: Stairway, levels: LevelBook) -> Link:
        if known is None:
            self._num_made += 1
        number = self._num_made if known is None else known.number
        lower = _level_of_end(float(flight.base[2]), levels, is_open=flight.is_open_below, side=-1)
        upper = _level_of_end(float(top_of(flight)[2]), levels, is_open=flight.is_open_above, side=1)
        portal = _make_portal(number, flight, stairway, (lower, upper), levels, self._profile)
        if known is None:
            return Link(
                number=number, flight=flight, stairway=stairway, portal=portal, lower=lower, upper=upper,
                allow_unknown=self._allow_unknown,
            )  # fmt: skip
        known.flight, known.stairway, known.portal = flight, stairway, portal
        known.lower, known.upper = lower, upper
        return known


def staging_points(link: Link) -> tuple[Points, Points]:
    """Return the (3,) staging places at its lower and upper end."""
    return link.portal.lower.position, link.portal.upper.position


def _make_portal(
    number: int,
    flight: Flight,
    stairway: Stairway,
    ends: tuple[int, int],
    levels: LevelBook,
    profile: RobotProfile,
) -> Portal:
    alone = Stairway(
        id=number,
        flights=(flight,),
        num_observations=stairway.num_observations,
        first_seen_ns=stairway.first_seen_ns,
        last_seen_ns=stairway.last_seen_ns,
    )
    heights = {level.number: level.height for level in levels.levels}
    low = heights.get(ends[0], float(flight.base[2]))
    high = heights.get(ends[1], float(top_of(flight)[2]))
    floors = FloorStack(
        floors=tuple(
            Floor(level=end, height=height, is_explored=end < UNEXPLORED)
            for end, height in sorted(
                zip(ends, (low, max(high, low + 0.31)), strict=True), key=lambda e: e[1]
            )
        ),
        levels={number: ends},
        open_ends={number: (flight.is_open_below, flight.is_open_above)},
    )
    portal = make_portal(alone, floors, profile)
    # Whoever cannot climb the second flight need not climb the first.
    whole = assess(stairway, profile)
    if whole.probability[1] < portal.assessment.probability[1] and whole.verdict == "impassable":
        object.__setattr__(portal, "assessment", whole)
    return portal


def _level_of_end(height: float, levels: LevelBook, *, is_open: bool, side: int) -> int:
    known = levels.find(height)
    if known is not None:
        return known.number
    return UNEXPLORED + round(height * 10) if height >= 0 else 2 * UNEXPLORED + round(-height * 10)


def _is_same(first: Flight, second: Flight) -> bool:
    if abs(wrapped_angle(first.heading - second.heading)) > MAX_TURN:
        return False
    offset = second.base - first.base
    along, lateral = float(offset @ first.forward), float(offset[:2] @ first.map_from_flight[:2, 1])
    if abs(lateral) > max(first.width, second.width) / 2 + 0.2:
        return False
    # Both lie on one inclined plane, and one goes on where the other does.
    if abs(offset[2] - along * first.rise / first.run) > 2 * first.rise:
        return False
    low, high = first.base[2], top_of(first)[2]
    return bool(second.base[2] < high + first.rise and top_of(second)[2] > low - first.rise)


def _distance(first: Flight, second: Flight) -> float:
    return float(np.linalg.norm(first.base - second.base))
