"""The rows of ``batch.csv`` and ``batch.parquet``: flights, recordings without stairs, failures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from stairmap.batch.job import RecordingResult
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.traversability import assess
from stairmap.stairway import Stairway

Row = Mapping[str, Any]
"""Values by the names of ``columns``; ``None`` where there is none."""

Robots = Mapping[str, RobotProfile]
"""Robots whose verdicts are columns, by the name that a column ends in."""

MEASURES = ("heading", "rise", "run", "width", "pitch")

_TEXTS = ("recording", "folder", "error")
_COUNTS = ("stairway", "flight", "num_risers", "num_observations", "num_frames", "num_detections")
_TRUTHS = ("left_bounded", "right_bounded", "bottom_seen", "top_seen")

COLUMNS: tuple[str, ...] = (
    "recording", "stairway", "flight", "base_x", "base_y", "base_z", "heading", "rise", "run", "width",
    "pitch", "num_risers", "base_x_std", "base_y_std", "base_z_std", "heading_std", "rise_std", "run_std",
    "width_std", "pitch_std", "left_bounded", "right_bounded", "bottom_seen", "top_seen", "num_observations",
    "num_frames", "num_detections", "folder",
)  # fmt: skip
"""Columns before the verdicts and the error; m, rad, map of the recording."""

VERDICT_PREFIX = "verdict_"


def columns(robots: Robots) -> tuple[str, ...]:
    """Return the names of all columns: ``COLUMNS``, ``verdict_<robot>`` for each robot, ``error``."""
    return (*COLUMNS, *(VERDICT_PREFIX + name for name in robots), "error")


def column_kind(name: str) -> str:
    """Return the kind of a column's values: ``text``, ``count``, ``truth`` or ``number``."""
    if name in _TEXTS or name.startswith(VERDICT_PREFIX):
        return "text"
    return "count" if name in _COUNTS else "truth" if name in _TRUTHS else "number"


def rows_of(result: RecordingResult, robots: Robots) -> list[Row]:
    """Return the rows of a recording: its flights, or one without measures; and one more with its error.

    Parameters
    ----------
    result
        What came of it.
    robots
        Whose verdicts to give; ``passable``, ``impassable`` or ``unknown``.
    """
    names = columns(robots)
    facts = {
        "recording": result.recording,
        "folder": result.folder,
        "num_frames": result.num_frames,
        "num_detections": result.num_detections,
        "error": "",
    }
    rows: list[dict[str, Any]] = []
    for values in result.stairways:
        stairway = Stairway.from_dict(dict(values))
        verdicts = {VERDICT_PREFIX + name: assess(stairway, robot).verdict for name, robot in robots.items()}
        rows += [{**facts, **verdicts, **flight} for flight in _flight_rows(stairway)]
    if result.error or not rows:
        rows.append({**facts, "error": result.error})
    return [{name: row.get(name) for name in names} for row in rows]


def _flight_rows(stairway: Stairway) -> list[dict[str, Any]]:
    rows = []
    for number, flight in enumerate(stairway.flights, start=1):
        row: dict[str, Any] = {
            "stairway": stairway.id,
            "flight": number,
            "num_risers": flight.num_risers,
            "num_observations": stairway.num_observations,
            **{name: getattr(flight, name) for name in _TRUTHS},
        }
        for axis, place, std in zip("xyz", flight.base.tolist(), flight.std.base.tolist(), strict=True):
            row |= {f"base_{axis}": place, f"base_{axis}_std": std}
        for name in MEASURES:
            row |= {name: float(getattr(flight, name)), f"{name}_std": float(getattr(flight.std, name))}
        rows.append({name: _rounded(value) for name, value in row.items()})
    return rows


def _rounded(value: Any) -> Any:
    """A number to a micrometre or microradian, ``None`` for one that is not known."""
    if not isinstance(value, float):
        return value
    return round(value, 6) if math.isfinite(value) else None
