"""What viewers write at a stairway, with which colours they draw it, and from where they look at it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from stairmap.arrays import IntArray, Points, Vector
from stairmap.export.summary import risers_text, stairway_rows, with_std
from stairmap.stairway import Flight, Stairway

Color: TypeAlias = tuple[int, int, int]

NOSING_COLOR: Color = (213, 94, 0)
"""Of nosings in single pictures: Okabe and Ito's vermilion. Colours are red-green-blue."""

STAIRWAY_COLORS: tuple[Color, ...] = ((213, 94, 0), (204, 121, 167), (86, 180, 233), (230, 159, 0))
"""Of the nosings of stairways, in turn."""

EDGE_COLOR: Color = (240, 228, 66)
"""Stair edges of the present frame."""

SURFACE_COLOR: Color = (196, 206, 214)
TRAJECTORY_COLOR: Color = (0, 114, 178)
ASCENT_COLOR: Color = (0, 158, 115)

LABEL_ROOM = np.array([0.0, 0.0, 0.9])
"""What the arrow and label of a stairway take up above it, m."""

_LOW_COLOR = np.array([38.0, 70.0, 112.0])
_HIGH_COLOR = np.array([172.0, 190.0, 200.0])


def stairway_color(stairway_id: int) -> Color:
    """Return the colour that a stairway has in every view and plot."""
    return STAIRWAY_COLORS[(stairway_id - 1) % len(STAIRWAY_COLORS)]


def flight_measures(flight: Flight) -> tuple[str, ...]:
    """Return the measures of a flight, one a line, with units and one standard deviation."""
    bound = "" if flight.left_bounded and flight.right_bounded else "≥ "
    return (
        f"{risers_text(flight)} risers, pitch {_degrees(flight.pitch, flight.std.pitch)}°",
        f"rise {_millimetres(flight.rise, flight.std.rise)} mm",
        f"run {_millimetres(flight.run, flight.std.run)} mm",
        f"width {bound}{_millimetres(flight.width, flight.std.width)} mm",
    )


def flight_title(stairway: Stairway, flight_index: int) -> str:
    """Return the name of a flight: that of its stairway, and its number where there are several."""
    if len(stairway.flights) == 1:
        return f"stairway {stairway.id}"
    return f"stairway {stairway.id}, flight {flight_index + 1} of {len(stairway.flights)}"


def measures_markdown(stairways: Sequence[Stairway]) -> str:
    """Return the measures of all flights as a table in Markdown."""
    if not stairways:
        return "No stairway was found."
    header = ("stairway", "flight", "risers", "rise mm", "run mm", "width mm", "pitch °", "views")
    lines = ["| " + " | ".join(header) + " |", "|---" * len(header) + "|"]
    for row in stairway_rows(stairways):
        cells = dict(zip(_COLUMN_OF_CELL, row.cells(), strict=True))
        lines.append("| " + " | ".join(cells[name] for name in _MARKDOWN_CELLS) + " |")
    note = "± is one standard deviation; ≥ where an end of the steps was not seen."
    return "\n".join([*lines, "", note])


def ascent_arrow(flight: Flight) -> tuple[Vector, Vector]:
    """Return start and end of an arrow up the flight, (3,) each, map, m: above the middle of the nosings."""
    lift = np.array([0.0, 0.0, 0.25])
    nosings = flight.edges().mean(axis=1)
    top = nosings[-1] if len(nosings) > 1 else nosings[0] + flight.run * flight.forward
    return nosings[0] + lift, top + lift


def height_colors(heights: Vector, low: float, high: float) -> IntArray:
    """Return (N, 3) uint8 colours for heights in m, blue-grey: dark at ``low``, pale at ``high``."""
    share = np.clip((np.asarray(heights) - low) / max(high - low, 1e-6), 0.0, 1.0)[:, None]
    colors: IntArray = (_LOW_COLOR + share * (_HIGH_COLOR - _LOW_COLOR)).astype(np.uint8)
    return colors


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint:
    """Where to look from and at, (3,) each, map, m."""

    eye: Vector
    target: Vector

    @property
    def distance(self) -> float:
        """Distance of the eye to what it looks at, m."""
        return float(np.linalg.norm(self.eye - self.target))


def find_viewpoint(stairways: Sequence[Stairway], positions: Points) -> Viewpoint:
    """Return a place to look from such that the stairways fill the picture, or the way without stairways.

    It lies in front of the first stairway, to its right and above, so that treads and risers are seen.

    Parameters
    ----------
    stairways
        What to look at.
    positions
        (N, 3) way of the camera, map, m.
    """
    if stairways:
        surface = np.concatenate([stairway.surface()[0] for stairway in stairways])
        corners = np.concatenate([surface, surface + LABEL_ROOM])
        forward = stairways[0].flights[0].forward
    elif len(positions):
        corners, forward = positions, np.array([1.0, 0.0, 0.0])
    else:
        return Viewpoint(eye=np.array([-1.2, -1.3, 0.9]), target=np.array([1.4, 0.0, -0.4]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    target = (low + high) / 2
    distance = 1.1 * max(float(np.linalg.norm(high - low)), 1.0)
    right = np.array([forward[1], -forward[0], 0.0])
    direction = -0.78 * forward + 0.52 * right + np.array([0.0, 0.0, 0.5])
    return Viewpoint(eye=target + distance * direction / np.linalg.norm(direction), target=target)


_COLUMN_OF_CELL = (
    "id", "flight", "rise", "run", "width", "ends", "pitch", "risers", "heading", "base", "observations",
)  # fmt: skip
_MARKDOWN_CELLS = ("id", "flight", "risers", "rise", "run", "width", "pitch", "observations")


def _millimetres(value: float, std: float) -> str:
    return with_std(value * 1e3, std * 1e3)


def _degrees(value: float, std: float) -> str:
    return with_std(float(np.degrees(value)), float(np.degrees(std)), digits=1)
