"""Whether a robot can climb a stairway, and how sure that is.

A verdict is ``passable`` when all limits are kept with a probability of at least 0.977 even if the
errors of rise, run, pitch and width conspire, ``impassable`` when one of them is broken as surely,
and else ``unknown``: because the stairway is too near a limit, or was not seen well enough, or because
the robot's limit was never published.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from stairmap.navigation.limits import (
    Limit,
    LimitCheck,
    Verdict,
    check_limit,
    joint_probability,
    limiting_check,
    measure_flight,
    verdict_from_probability,
)
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.stairway import Flight, Stairway

STRAIGHT = math.radians(30)
"""Flights that turn by less have a landing whose length was measured between their ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """What a robot can do with a stairway.

    Attributes
    ----------
    stairway_id
        Which stairway.
    robot
        Name of the robot.
    verdict
        ``passable``, ``impassable`` or ``unknown``.
    probability
        Lowest and highest probability that it is passable.
    checks
        Every limit against every flight, lowest flight first.
    limiting
        The check that decides: the broken limit, or the one with the least to spare.
    unchecked
        Measures whose limit was never published and that another limit stands in for.
    """

    stairway_id: int
    robot: str
    verdict: Verdict
    probability: tuple[float, float]
    checks: tuple[LimitCheck, ...]
    limiting: LimitCheck
    unchecked: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the assessment as JSON types."""
        return {
            "stairway": self.stairway_id,
            "robot": self.robot,
            "verdict": self.verdict,
            "probability": list(self.probability),
            "limiting": self.limiting.to_dict(),
            "unchecked": list(self.unchecked),
            "checks": [check.to_dict() for check in self.checks],
        }


def assess(stairway: Stairway, robot: RobotProfile) -> Assessment:
    """Tell whether a robot can climb a stairway.

    For a verdict better than *unknown*, the robot must have published limits of the rise, the width, and the
    run or the pitch. One of the last two is enough, because rise and either of them bound the other. If it
    has neither, a limit on the slope of ramps stands in for them; it can only speak for a stairway, never
    against it.

    Parameters
    ----------
    stairway
        Its flights have at least one riser; a flight of one riser is judged by the limit for a single step.
    robot
        What it can do; see ``load_robot``.
    """
    checks: list[LimitCheck] = []
    unchecked: set[str] = set()
    for number, flight in enumerate(stairway.flights, start=1):
        for limit in robot.limits():
            if not _applies(limit, flight) or (
                limit.measure == "landing length" and number == len(stairway.flights)
            ):
                continue
            if _is_dispensable(limit, robot):
                unchecked.add(limit.measure)
            elif limit.measure == "landing length":
                checks += _check_landing(stairway, number, limit)
            else:
                measured, std, is_lower_bound = measure_flight(flight, limit.measure)
                checks.append(
                    check_limit(limit, measured, std, flight_number=number, is_lower_bound=is_lower_bound)
                )
    probability = joint_probability(checks)
    verdict = verdict_from_probability(probability)
    limiting = limiting_check(checks, verdict)
    if limiting is None:
        raise ValueError(f"stairway {stairway.id} has no flights")
    return Assessment(
        stairway_id=stairway.id,
        robot=robot.name,
        verdict=verdict,
        probability=probability,
        checks=tuple(checks),
        limiting=limiting,
        unchecked=tuple(sorted(unchecked)),
    )


def _applies(limit: Limit, flight: Flight) -> bool:
    if flight.num_risers == 1:
        return limit.measure in ("single rise", "width", "landing length")
    return limit.measure != "single rise"


def _is_dispensable(limit: Limit, robot: RobotProfile) -> bool:
    """Tell whether nothing is lost by leaving a limit out: unpublished or loose, and another bounds it."""
    if limit.value is not None and limit.is_binding:
        return False
    if limit.measure == "run":
        return robot.max_pitch_deg is not None or robot.max_slope_deg is not None
    return limit.measure == "landing length" or (limit.measure == "pitch" and robot.min_run is not None)


def _check_landing(stairway: Stairway, number: int, limit: Limit) -> list[LimitCheck]:
    """Check the landing after a flight; the far side of one that turns was never measured."""
    if number > len(stairway.landings):
        return []
    lower, upper = stairway.flights[number - 1], stairway.flights[number]
    turn = abs((upper.heading - lower.heading + math.pi) % (2 * math.pi) - math.pi)
    std = math.nan
    if turn < STRAIGHT:
        std = math.hypot(*lower.std.base[:2], *upper.std.base[:2])
    length = stairway.landings[number - 1].size[0]
    return [check_limit(limit, length, std, flight_number=number)]
