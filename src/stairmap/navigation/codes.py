"""Which rule of a building code a stairway breaks, by how much, and how sure that is.

Only rules that a model of equal steps can answer are here. Whether all risers of a flight are alike,
headroom, handrails and slip resistance are not, and each code lists what it asks beyond its rules. Heights
of single steps are pulled to the mean: a flight of 143 to 190 mm was modelled as 167 to 178 mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from typing import Any

import yaml

from stairmap.errors import ConfigError
from stairmap.navigation.limits import (
    Limit,
    LimitCheck,
    Verdict,
    check_limit,
    joint_probability,
    measure_flight,
    verdict_from_probability,
)
from stairmap.stairway import Stairway

_FOLDER = "codes"


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildingCode:
    """A building code's rules about the dimensions of stairs.

    Attributes
    ----------
    id, title
        Short and full name.
    rules
        Its limits, each with the clause as its source.
    unchecked
        What else it asks of stairs, and is not looked at.
    """

    id: str
    title: str
    rules: tuple[Limit, ...]
    unchecked: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeCheck:
    """A stairway against a building code.

    Attributes
    ----------
    stairway_id, code_id
        What was held against what.
    verdict
        ``passable``: keeps all rules; ``impassable``: breaks one; ``unknown``: too near to tell.
    probability
        Lowest and highest probability that all rules are kept.
    checks
        Every rule against every flight.
    unchecked
        What the code asks beyond them; ``keeps`` does not speak of it.
    """

    stairway_id: int
    code_id: str
    verdict: Verdict
    probability: tuple[float, float]
    checks: tuple[LimitCheck, ...]
    unchecked: tuple[str, ...] = ()

    @property
    def broken(self) -> tuple[LimitCheck, ...]:
        """Rules that are broken for sure."""
        return tuple(check for check in self.checks if check.verdict == "impassable")

    @property
    def undecided(self) -> tuple[LimitCheck, ...]:
        """Rules that the measures are too near to, or too uncertain for."""
        return tuple(check for check in self.checks if check.verdict == "unknown")

    @property
    def word(self) -> str:
        """The verdict as codes say it: ``keeps``, ``breaks`` or ``unknown``."""
        return {"passable": "keeps", "impassable": "breaks", "unknown": "unknown"}[self.verdict]

    def to_dict(self) -> dict[str, Any]:
        """Return the check as JSON types."""
        return {
            "stairway": self.stairway_id,
            "code": self.code_id,
            "verdict": self.word,
            "probability": list(self.probability),
            "checks": [check.to_dict() for check in self.checks],
            "unchecked": list(self.unchecked),
        }


def code_ids() -> tuple[str, ...]:
    """Return the short names of the codes that come with stairmap."""
    folder = resources.files("stairmap.navigation") / _FOLDER
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


def load_code(code_id: str) -> BuildingCode:
    """Return a building code by its short name.

    Raises
    ------
    ConfigError
        If there is no such code.
    """
    if code_id not in code_ids():
        raise ConfigError(f"no building code {code_id!r}; choose one of {', '.join(code_ids())}")
    text = (resources.files("stairmap.navigation") / _FOLDER / f"{code_id}.yaml").read_text("utf-8")
    values = yaml.safe_load(text)
    rules = []
    for rule in values["rules"]:
        degrees = rule.pop("degrees", None)
        value = rule.pop("value", None) if degrees is None else math.radians(degrees)
        rules.append(Limit(**rule, value=value))
    return BuildingCode(
        id=code_id, title=values["title"], rules=tuple(rules), unchecked=tuple(values["unchecked"])
    )


def check_code(stairway: Stairway, code: BuildingCode) -> CodeCheck:
    """Hold a stairway against a building code.

    A flight's height is that of the risers that were seen.
    """
    checks = []
    for number, flight in enumerate(stairway.flights, start=1):
        for rule in code.rules:
            measured, std, is_lower_bound = measure_flight(flight, rule.measure)
            checks.append(
                check_limit(rule, measured, std, flight_number=number, is_lower_bound=is_lower_bound)
            )
    probability = joint_probability(checks)
    return CodeCheck(
        stairway_id=stairway.id,
        code_id=code.id,
        verdict=verdict_from_probability(probability),
        probability=probability,
        checks=tuple(checks),
        unchecked=code.unchecked,
    )
