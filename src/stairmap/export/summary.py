"""The stairways as a table with units, for ``summary.txt`` and the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stairmap.stairway import Flight, Stairway

COLUMNS: tuple[str, ...] = (
    "id",
    "flight",
    "rise mm",
    "run mm",
    "width mm",
    "ends seen",
    "pitch deg",
    "risers",
    "heading deg",
    "base x, y, z m",
    "observations",
)
"""Headers of the cells of a ``StairwayRow``, with units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StairwayRow:
    """One flight of one stairway, in the units that people read: mm, deg, and m for positions.

    Each ``_std`` is one standard deviation; NaN where the method gives none. ``ends_seen`` says which
    sides of the steps were seen; unless it is ``both``, the width is a lower bound. ``levels_seen`` says
    whether the floor before the first riser (``bottom``) and the level behind the last nosing (``top``) were;
    unless it is ``both``, so is the number of risers; ``unknown`` where nothing tells, as in older files.
    """

    stairway_id: int
    flight_number: int
    num_flights: int
    rise_mm: float
    rise_std_mm: float
    run_mm: float
    run_std_mm: float
    width_mm: float
    width_std_mm: float
    ends_seen: Literal["both", "left", "right", "none"]
    pitch_deg: float
    pitch_std_deg: float
    num_risers: int
    levels_seen: Literal["both", "bottom", "top", "none", "unknown"]
    heading_deg: float
    base: tuple[float, float, float]
    num_observations: int

    def cells(self) -> tuple[str, ...]:
        """Return the text of each of ``COLUMNS``."""
        bound = "" if self.ends_seen == "both" else "≥ "
        return (
            str(self.stairway_id),
            f"{self.flight_number}/{self.num_flights}",
            with_std(self.rise_mm, self.rise_std_mm),
            with_std(self.run_mm, self.run_std_mm),
            bound + with_std(self.width_mm, self.width_std_mm),
            self.ends_seen if self.levels_seen == "unknown" else f"{self.ends_seen}; {self.levels_seen}",
            with_std(self.pitch_deg, self.pitch_std_deg, digits=1),
            _bounded(self.num_risers, self.levels_seen),
            f"{self.heading_deg:.1f}",
            ", ".join(f"{value:.2f}" for value in self.base),
            str(self.num_observations),
        )


def stairway_rows(stairways: Sequence[Stairway]) -> list[StairwayRow]:
    """Return one row per flight, in the order of the stairways."""
    ends: dict[tuple[bool, bool], Literal["both", "left", "right", "none"]] = {
        (True, True): "both",
        (True, False): "left",
        (False, True): "right",
        (False, False): "none",
    }
    return [
        StairwayRow(
            stairway_id=stairway.id,
            flight_number=number,
            num_flights=len(stairway.flights),
            rise_mm=flight.rise * 1e3,
            rise_std_mm=flight.std.rise * 1e3,
            run_mm=flight.run * 1e3,
            run_std_mm=flight.std.run * 1e3,
            width_mm=flight.width * 1e3,
            width_std_mm=flight.std.width * 1e3,
            ends_seen=ends[flight.left_bounded, flight.right_bounded],
            pitch_deg=float(np.degrees(flight.pitch)),
            pitch_std_deg=float(np.degrees(flight.std.pitch)),
            num_risers=flight.num_risers,
            levels_seen=_levels_seen(flight),
            heading_deg=float(np.degrees(flight.heading)),
            base=(float(flight.base[0]), float(flight.base[1]), float(flight.base[2])),
            num_observations=stairway.num_observations,
        )
        for stairway in stairways
        for number, flight in enumerate(stairway.flights, start=1)
    ]


def risers_text(flight: Flight) -> str:
    """Return the number of risers; a lower bound where an end of the flight was not seen."""
    return _bounded(flight.num_risers, _levels_seen(flight))


def _bounded(num_risers: int, levels_seen: str) -> str:
    return ("" if levels_seen in {"both", "unknown"} else "≥ ") + str(num_risers)


def _levels_seen(flight: Flight) -> Literal["both", "bottom", "top", "none", "unknown"]:
    if flight.bottom_seen is None and flight.top_seen is None:
        return "unknown"
    if flight.bottom_seen:
        return "both" if flight.top_seen else "bottom"
    return "top" if flight.top_seen else "none"


def format_table(stairways: Sequence[Stairway]) -> str:
    """Return the rows as a plain-text table; one line that says so when there is no stairway."""
    if not stairways:
        return "no stairway was found\n"
    lines = [COLUMNS, *(row.cells() for row in stairway_rows(stairways))]
    widths = [max(len(line[index]) for line in lines) for index in range(len(COLUMNS))]
    text = ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in lines]
    return "\n".join([text[0], "  ".join("-" * width for width in widths), *text[1:]]) + "\n"


def format_summary(
    stairways: Sequence[Stairway],
    *,
    num_frames: int,
    num_detections: int,
    reasons: Sequence[str] = (),
    problems: Sequence[str] = (),
) -> str:
    """Return the text of ``summary.txt``.

    Parameters
    ----------
    stairways
        The stairways found.
    num_frames, num_detections
        Number of frames looked at, and of those in which stair edges were seen.
    reasons
        Why frames gave none, most frequent first, one line each.
    problems
        What was wrong with the recording, one line each.
    """
    parts = [f"{num_frames} frames, stair edges seen in {num_detections}\n", format_table(stairways)]
    if stairways:
        parts.append(
            "± is one standard deviation; ≥ where an end was not seen. Ends seen: sides of the steps;\n"
            "levels at the bottom and the top of the flight, which otherwise may go on there\n"
        )
    for title, lines in (("why frames gave no stairway", reasons), ("problems of the recording", problems)):
        if lines:
            parts.append("\n".join([f"{title}:", *(f"  {line}" for line in lines)]) + "\n")
    return "\n".join(parts)


def with_std(value: float, std: float, *, digits: int = 0) -> str:
    """Return ``value ± std`` with so many decimals; the value alone where the deviation is not finite."""
    text = f"{value:.{digits}f}"
    # A deviation that rounds to zero would read as certainty, so it gets one decimal more.
    digits = digits if round(std, digits) > 0 or not np.isfinite(std) else digits + 1
    return f"{text} ± {std:.{digits}f}" if np.isfinite(std) else text


def counted(number: int, singular: str) -> str:
    """Return ``1 frame``, ``2 frames``."""
    return f"{number} {singular}{'' if number == 1 else 's'}"
