"""Limits that a stairway may keep or break, and how sure that is.

A measure is taken as Gaussian with the standard deviation that the model gives. Each comparison
gives a probability as an interval: both ends are equal where measure and limit are known, and
[0, 1] where either is not. A width whose ends were not both seen is a lower bound, so it can prove
that a robot fits, never that it does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from stairmap.stairway import Flight

Measure: TypeAlias = Literal[
    "rise", "single rise", "run", "pitch", "width", "height", "2 rise + run", "risers", "landing length"
]
"""What is compared: of a flight, or the length of the landing that follows it.

``single rise`` is the rise of a flight of one riser, ``height`` that of a whole flight, ``risers`` their
number.
"""

Sense: TypeAlias = Literal["max", "min"]

Verdict: TypeAlias = Literal["passable", "impassable", "unknown"]

SURE = 0.5 * math.erfc(-2.0 / math.sqrt(2.0))
"""Probability from which a verdict is given, either way: two standard deviations, one-sided; 0.977."""

STEP_STD = 0.0025
"""What the model's deviations of rise and run do not cover, m: biases of a sensor, tilt, and nosings that are
taken for their neighbours. Over 174 simulated flights 5 % of the rises were more than two stated deviations
too low; with this on top, 1 % (docs/navigation.md)."""

WIDTH_STD = 0.05
"""What the model's deviation of a width does not cover, m: stringers, skirtings and rails that pass for the
end of a step made it up to 0.10 m too large in architects' buildings (docs/navigation.md)."""

RISERS_STD = 0.6
"""Deviation of a number of risers: one too many or too few is common where an end was seen from afar."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """One limit of a robot or a building code.

    Attributes
    ----------
    measure
        What it limits.
    sense
        ``max``: at most ``value``; ``min``: at least.
    value
        The limit, m or rad; ``None``: there is one, but nobody published it.
    source
        Where it stands.
    is_binding
        Whether what is beyond it fails. A ramp's slope is none: stairs that are steeper may still do.
    """

    measure: Measure
    sense: Sense
    value: float | None
    source: str = ""
    is_binding: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitCheck:
    """One measure of one flight against one limit.

    Attributes
    ----------
    flight_number
        Number of the flight in its stairway, from 1 at the bottom.
    limit
        What it was compared with.
    measured, std
        The measure and its standard deviation, m or rad; NaN where unknown.
    probability
        Lowest and highest probability that the limit is kept.
    """

    flight_number: int
    limit: Limit
    measured: float
    std: float
    probability: tuple[float, float]

    @property
    def margin(self) -> float:
        """How far the measure is inside of the limit, m or rad; negative: beyond it; NaN: unknown."""
        return _margin(self.limit, self.measured)

    @property
    def unit(self) -> Literal["m", "rad", ""]:
        """Unit of the measure, its limit and its margin; none for a number."""
        if self.limit.measure == "risers":
            return ""
        return "rad" if self.limit.measure == "pitch" else "m"

    @property
    def verdict(self) -> Verdict:
        """What this limit alone says."""
        return verdict_from_probability(self.probability)

    def to_dict(self) -> dict[str, Any]:
        """Return the check as JSON types; a number that is not known is NaN."""
        return {
            "flight": self.flight_number,
            "measure": self.limit.measure,
            "sense": self.limit.sense,
            "measured": self.measured,
            "std": self.std,
            "limit": math.nan if self.limit.value is None else self.limit.value,
            "margin": self.margin,
            "unit": self.unit,
            "probability": list(self.probability),
            "source": self.limit.source,
        }


def check_limit(
    limit: Limit, measured: float, std: float, *, flight_number: int, is_lower_bound: bool = False
) -> LimitCheck:
    """Return how probably a measure keeps a limit.

    Parameters
    ----------
    limit
        What to compare with.
    measured, std
        The measure and one standard deviation, m or rad; NaN where unknown, which proves nothing.
    flight_number
        Number of the flight, from 1.
    is_lower_bound
        Whether the true measure may be any amount larger.
    """
    margin = _margin(limit, measured)
    if not math.isfinite(margin) or not math.isfinite(std):
        probability = (0.0, 1.0)
    else:
        keeps = _normal_probability(margin, std)
        probability = (keeps, keeps)
        if is_lower_bound:
            probability = (keeps, 1.0) if limit.sense == "min" else (0.0, keeps)
        if not limit.is_binding:
            probability = (probability[0], 1.0)
    return LimitCheck(
        flight_number=flight_number, limit=limit, measured=measured, std=std, probability=probability
    )


def measure_flight(flight: Flight, measure: Measure) -> tuple[float, float, bool]:
    """Return a measure of a flight, its standard deviation, and whether it is a lower bound (m, rad).

    Errors of rise and run are taken as independent, as the model gives no more. Deviations are those of the
    model and ``STEP_STD``, of a width ``WIDTH_STD``.
    """
    num = flight.num_risers
    rise_std, run_std = math.hypot(flight.std.rise, STEP_STD), math.hypot(flight.std.run, STEP_STD)
    pitch_std = math.hypot(flight.std.pitch, STEP_STD / math.hypot(flight.rise, flight.run))
    values: dict[str, tuple[float, float]] = {
        "rise": (flight.rise, rise_std),
        "single rise": (flight.rise, rise_std),
        "run": (flight.run, run_std),
        "pitch": (flight.pitch, pitch_std),
        "width": (flight.width, math.hypot(flight.std.width, WIDTH_STD)),
        "height": (num * flight.rise, num * rise_std),
        "2 rise + run": (2 * flight.rise + flight.run, math.hypot(2 * rise_std, run_std)),
        "risers": (num, RISERS_STD),
    }
    if measure not in values:
        raise ValueError(f"{measure} is no measure of a flight")
    is_lower_bound = measure == "width" and not (flight.left_bounded and flight.right_bounded)
    return (*values[measure], is_lower_bound)


def joint_probability(checks: Iterable[LimitCheck]) -> tuple[float, float]:
    """Return the lowest and highest probability that all limits are kept.

    Nothing is assumed about how errors go together (Fréchet 1935): at least
    ``1 - sum(1 - p)``, at most the smallest ``p``.
    """
    lows, highs = [], []
    for check in checks:
        lows.append(check.probability[0])
        highs.append(check.probability[1])
    return max(0.0, 1.0 - sum(1.0 - low for low in lows)), min(highs, default=1.0)


def verdict_from_probability(probability: tuple[float, float]) -> Verdict:
    """Return ``passable`` from 0.977 up, ``impassable`` up to 0.023, else ``unknown``."""
    lowest, highest = probability
    if lowest >= SURE:
        return "passable"
    return "impassable" if highest <= 1.0 - SURE else "unknown"


def limiting_check(checks: Sequence[LimitCheck], verdict: Verdict) -> LimitCheck | None:
    """Return the check that decides a verdict: the broken one, or the one with the least to spare."""
    if not checks:
        return None
    end = 1 if verdict == "impassable" else 0
    return min(checks, key=lambda check: (round(check.probability[end], 3), _spare(check)))


def _margin(limit: Limit, measured: float) -> float:
    if limit.value is None:
        return math.nan
    return limit.value - measured if limit.sense == "max" else measured - limit.value


def _spare(check: LimitCheck) -> float:
    """Margin as a share of the limit: tells apart what is equally certain."""
    if check.limit.value is None or not math.isfinite(check.margin):
        return 0.0
    return check.margin / check.limit.value


def _normal_probability(margin: float, std: float) -> float:
    """Probability that a Gaussian error leaves a margin at or above zero."""
    if std <= 0:
        return 1.0 if margin >= 0 else 0.0
    return 0.5 * math.erfc(-margin / (std * math.sqrt(2.0)))
