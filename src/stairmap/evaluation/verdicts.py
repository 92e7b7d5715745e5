"""Whether what is said of a robot and a flight is true.

The model's flight is assessed for every robot profile, as ``stairmap check`` does, and each verdict is
held against the true flight. A flight is *clear* of a robot's limits when the measures keep all of them, or
break one, by more than two of their deviations; a width with an end that was not seen may be any amount
larger, so it is clear only where it keeps its limit. *Truly clear* is the same with the true measures.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, TypeAlias

from stairmap.navigation.limits import LimitCheck, Verdict, check_limit, measure_flight
from stairmap.navigation.robot_profile import RobotProfile, load_robot, robot_names
from stairmap.navigation.traversability import assess
from stairmap.stairway import Flight, Stairway

CLEAR = 2.0
"""Deviations from a limit beyond which a verdict is expected."""

TRUTH_ROUNDING = 1e-4
"""Truth is known to so much, m or rad: stairs of buildings are measured in their meshes."""

Answer: TypeAlias = Literal["right", "unknown", "wrong"]


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedVerdict:
    """The verdict on one flight for one robot, and the truth.

    Attributes
    ----------
    robot
        Name of the profile.
    verdict
        What was said.
    truth
        ``passable``, ``impassable``, or ``unknown``: the robot's published limits leave it open.
    distance
        Estimated measures' distance from the deciding limit in their stated deviations: negative beyond it.
    true_distance
        The same of the true measures, in the deviations that the estimate states.
    measure
        The measure whose limit decides in truth.
    """

    robot: str
    verdict: Verdict
    truth: Verdict
    distance: float
    true_distance: float
    measure: str

    @property
    def answer(self) -> Answer:
        """Whether the verdict is right; ``unknown`` is neither right nor wrong, unless nobody can know."""
        if self.verdict == self.truth:
            return "right"
        return "unknown" if self.verdict == "unknown" else "wrong"

    @property
    def is_clear(self) -> bool:
        """Whether the measures are farther than two deviations from the limits."""
        return abs(self.distance) > CLEAR

    @property
    def is_truly_clear(self) -> bool:
        """Whether the true measures are."""
        return abs(self.true_distance) > CLEAR

    @property
    def is_dangerous(self) -> bool:
        """Whether an impassable flight was called passable."""
        return self.truth == "impassable" and self.verdict == "passable"


@dataclass(frozen=True, slots=True, kw_only=True)
class VerdictCounts:
    """How verdicts turned out, of those where the robots' published limits settle the truth.

    Attributes
    ----------
    num
        Number of pairs of a flight and a robot.
    right, unknown, wrong
        Of those that are clear of the limits.
    near_right, near_unknown, near_wrong
        Of those that are not.
    truly_clear_right, truly_clear_unknown, truly_clear_wrong
        Of those whose true measures are.
    num_dangerous
        Impassable flights that were called passable, near or far.
    num_overclaimed
        Verdicts other than unknown where the published limits leave the truth open; not among ``num``.
    """

    num: int
    right: int
    unknown: int
    wrong: int
    near_right: int
    near_unknown: int
    near_wrong: int
    truly_clear_right: int
    truly_clear_unknown: int
    truly_clear_wrong: int
    num_dangerous: int
    num_overclaimed: int


def judge_verdicts(estimate: Flight, truth: Flight) -> tuple[JudgedVerdict, ...]:
    """Return the verdicts on a flight for each robot that comes with stairmap.

    Parameters
    ----------
    estimate
        The flight that a method reports.
    truth
        The true one; its deviations are not used.
    """
    return tuple(judge_verdict(estimate, truth, robot) for robot in _all_robots())


def judge_verdict(estimate: Flight, truth: Flight, robot: RobotProfile) -> JudgedVerdict:
    """Return the verdict on a flight for one robot; see ``judge_verdicts``."""
    stairway = Stairway(id=1, flights=(estimate,), num_observations=1, first_seen_ns=0, last_seen_ns=0)
    assessment = assess(stairway, robot)
    true_checks = [_true_check(check, truth) for check in assessment.checks]
    distance, _ = _distance(assessment.checks, estimate)
    true_distance, measure = _distance(true_checks, None)
    return JudgedVerdict(
        robot=robot.name,
        verdict=assessment.verdict,
        truth=_true_verdict(true_checks),
        distance=distance,
        true_distance=true_distance,
        measure=measure,
    )


def count_verdicts(verdicts: Iterable[JudgedVerdict]) -> VerdictCounts:
    """Return how verdicts turned out."""
    every = list(verdicts)
    settled = [verdict for verdict in every if verdict.truth != "unknown"]

    def count(answer: Answer, chosen: Iterable[JudgedVerdict]) -> int:
        return sum(verdict.answer == answer for verdict in chosen)

    clear = [verdict for verdict in settled if verdict.is_clear]
    near = [verdict for verdict in settled if not verdict.is_clear]
    truly = [verdict for verdict in settled if verdict.is_truly_clear]
    return VerdictCounts(
        num=len(settled),
        right=count("right", clear),
        unknown=count("unknown", clear),
        wrong=count("wrong", clear),
        near_right=count("right", near),
        near_unknown=count("unknown", near),
        near_wrong=count("wrong", near),
        truly_clear_right=count("right", truly),
        truly_clear_unknown=count("unknown", truly),
        truly_clear_wrong=count("wrong", truly),
        num_dangerous=sum(verdict.is_dangerous for verdict in settled),
        num_overclaimed=sum(verdict.truth == "unknown" and verdict.verdict != "unknown" for verdict in every),
    )


@lru_cache(maxsize=1)
def _all_robots() -> tuple[RobotProfile, ...]:
    return tuple(load_robot(name) for name in robot_names())


def _true_check(check: LimitCheck, truth: Flight) -> LimitCheck:
    """Return a check of the true measure, with the deviation that the estimate states."""
    measured, _, _ = measure_flight(truth, check.limit.measure)
    return check_limit(check.limit, measured, check.std, flight_number=check.flight_number)


def _true_verdict(checks: Iterable[LimitCheck]) -> Verdict:
    """Return what exact measures and the published limits settle; a measure at its limit keeps it."""
    verdict: Verdict = "passable"
    for check in checks:
        if check.limit.value is None or check.margin < -TRUTH_ROUNDING:
            if check.limit.value is not None and check.limit.is_binding:
                return "impassable"
            verdict = "unknown"
    return verdict


def _distance(checks: Iterable[LimitCheck], estimate: Flight | None) -> tuple[float, str]:
    """Return the distance from the deciding limit in deviations, and its measure.

    The limit decides that is broken most, or kept least. With an ``estimate``, a width of which an end
    was not seen lies at its limit unless it clearly keeps it.
    """
    is_open = estimate is not None and not (estimate.left_bounded and estimate.right_bounded)
    distances = [(math.inf, "")]
    for check in checks:
        if check.limit.value is None:
            continue
        measure = check.limit.measure
        distance = check.margin / check.std if check.std > 0 else math.nan
        is_bound = not check.limit.is_binding or (is_open and measure == "width")
        if math.isnan(distance) or (is_bound and distance < CLEAR):
            distance = 0.0
        distances.append((distance, measure))
    return min(distances)
