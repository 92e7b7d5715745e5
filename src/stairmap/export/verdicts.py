"""Verdicts of robots and building codes in the words and units that people read."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stairmap.export.summary import with_std
from stairmap.navigation.codes import CodeCheck
from stairmap.navigation.limits import LimitCheck
from stairmap.navigation.traversability import Assessment

VERDICT_COLUMNS = (
    "stairway", "robot", "verdict", "P passable", "limiting", "measured", "limit", "margin",
)  # fmt: skip
"""Headers of ``verdict_cells``."""

CODE_COLUMNS = ("stairway", "code", "verdict", "P kept", "flight", "rule", "measured", "limit", "by")
"""Headers of ``code_cells``."""


def verdict_cells(assessment: Assessment) -> tuple[str, ...]:
    """Return one row of the table of verdicts."""
    check = assessment.limiting
    return (
        str(assessment.stairway_id),
        assessment.robot,
        assessment.verdict,
        format_probability(assessment.probability),
        f"{check.limit.measure}, flight {check.flight_number}",
        format_measured(check),
        format_limit(check),
        format_margin(check),
    )


def code_cells(check: CodeCheck) -> list[tuple[str, ...]]:
    """Return a row for each rule that is broken or undecided; one without a rule if all are kept."""
    start = (str(check.stairway_id), check.code_id, check.word, format_probability(check.probability))
    rows: list[tuple[str, ...]] = [
        (
            *start,
            str(item.flight_number),
            f"{item.limit.measure} ({item.limit.source})",
            format_measured(item),
            format_limit(item),
            format_margin(item),
        )
        for item in (*check.broken, *check.undecided)
    ]
    return rows or [(*start, "", "", "", "", "")]


def format_probability(probability: tuple[float, float]) -> str:
    """Return a probability, or from where to where it may lie; never rounded to certainty."""
    lowest, highest = probability
    if highest - lowest < 0.005:
        return _percent(lowest)
    return f"{_percent(lowest)} to {_percent(highest)}"


def format_measured(check: LimitCheck) -> str:
    """Return a measure with its deviation and unit, mm or deg."""
    factor, unit = _scale(check)
    return (
        f"{with_std(check.measured * factor, check.std * factor, digits=int(unit != 'mm'))} {unit}".rstrip()
    )


def format_limit(check: LimitCheck) -> str:
    """Return a limit with its sense and unit, or that it was never published."""
    if check.limit.value is None:
        return "not published"
    factor, unit = _scale(check)
    sign = "≤" if check.limit.sense == "max" else "≥"
    return f"{sign} {check.limit.value * factor:g} {unit}".rstrip()


def format_margin(check: LimitCheck) -> str:
    """Return how far a measure is inside of its limit; negative beyond it, empty where unknown."""
    if not math.isfinite(check.margin):
        return ""
    factor, unit = _scale(check)
    return f"{check.margin * factor:+.{int(unit != 'mm')}f} {unit}".rstrip()


def format_verdicts(assessments: Sequence[Assessment]) -> str:
    """Return a sentence for each assessment, for texts without a table."""
    lines = []
    for assessment in assessments:
        check = assessment.limiting
        lines.append(
            f"stairway {assessment.stairway_id}, {assessment.robot}: {assessment.verdict} "
            f"(P {format_probability(assessment.probability)}); {check.limit.measure} "
            f"{format_measured(check)}, limit {format_limit(check)}"
        )
    return "\n".join(lines)


def _scale(check: LimitCheck) -> tuple[float, str]:
    return {"rad": (180 / math.pi, "deg"), "m": (1e3, "mm"), "": (1.0, "")}[check.unit]


def _percent(value: float) -> str:
    if value > 0.999:
        return "> 99.9 %"
    if value < 0.001:
        return "< 0.1 %"
    return f"{value:.1%}".replace("%", " %")
