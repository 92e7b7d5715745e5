"""What a stairway in a file may hold: the ranges of every number in ``stairways.json``.

Ranges are wide enough for all that stands in buildings and outdoors, and narrow enough that nothing that
follows (meshes, maps, plans) can run out of memory or precision.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import AfterValidator, Field

from stairmap.input_files import CheckedModel, Coordinate, Deviation, Place, Stamp

MIN_RISE, MAX_RISE = 0.02, 1.0
"""Rise of a step, m: a threshold, and a block that only a climber takes."""

MIN_RUN, MAX_RUN = 0.02, 10.0
"""Run of a step, m: a ladder, and terraces."""

MIN_WIDTH, MAX_WIDTH = 0.02, 1000.0
"""Width, m: a strip that was seen, and the stairs around a stadium."""

MAX_RISERS = 500
"""Most risers of a flight; the longest straight flights have some 300."""

MAX_OVERHANG = 1.0
"""Farthest that a nosing stands out, m."""

MAX_ANGLE = 100.0
"""Largest heading, rad: it is an angle, and not in degrees."""

MAX_COUNT = 2**53
"""Largest count: what every program that reads JSON can hold."""

MAX_STEPS, MAX_FLIGHTS, MAX_STAIRWAYS = 1_000, 1_000, 100_000
"""Most parts of a flight, of a stairway, and of a file."""

_UNIT_TOLERANCE = 1e-3
"""How far from one the length of a plane's normal may be; files have six decimals."""


def _unit_plane(plane: list[float]) -> list[float]:
    length = math.hypot(*plane[:3])
    if abs(length - 1) > _UNIT_TOLERANCE:
        raise ValueError(f"should have a normal [a, b, c] of unit length, has {length:.3g}")
    return plane


Count = Annotated[int, Field(ge=0, le=MAX_COUNT)]
Heading = Annotated[float, Field(ge=-MAX_ANGLE, le=MAX_ANGLE)]
Plane = Annotated[list[Coordinate], Field(min_length=4, max_length=4), AfterValidator(_unit_plane)]
OptionalDeviation = Deviation | None


class SavedStep(CheckedModel):
    """A step."""

    nosing: Annotated[list[Place], Field(min_length=2, max_length=2)]
    num_observations: Count
    std: Annotated[list[OptionalDeviation], Field(min_length=2, max_length=2)] = Field([None, None])


class SavedFlightStd(CheckedModel):
    """The deviations of a flight."""

    rise: OptionalDeviation
    run: OptionalDeviation
    width: OptionalDeviation
    pitch: OptionalDeviation
    heading: OptionalDeviation
    base: Annotated[list[OptionalDeviation], Field(min_length=3, max_length=3)]
    overhang: OptionalDeviation = None


class SavedBounds(CheckedModel):
    """Which ends of the steps were seen."""

    left: bool
    right: bool


class SavedBox(CheckedModel):
    """The box of a flight, which follows from the rest."""

    center: Place
    height: Annotated[float, Field(ge=0, le=MAX_RISE * MAX_RISERS)]
    width: Annotated[float, Field(ge=0, le=MAX_WIDTH)]
    depth: Annotated[float, Field(ge=0, le=MAX_RUN * MAX_RISERS)]


class SavedFlight(CheckedModel):
    """A flight; box, plane and pitch follow from the rest, and are checked where they stand."""

    base: Place
    heading: Heading
    rise: Annotated[float, Field(ge=MIN_RISE, le=MAX_RISE)]
    run: Annotated[float, Field(ge=MIN_RUN, le=MAX_RUN)]
    width: Annotated[float, Field(ge=MIN_WIDTH, le=MAX_WIDTH)]
    num_risers: Annotated[int, Field(ge=1, le=MAX_RISERS)]
    width_bounded: SavedBounds
    overhang: Annotated[float, Field(ge=-MAX_OVERHANG, le=MAX_OVERHANG)] | None = None
    bottom_seen: bool | None = None
    top_seen: bool | None = None
    std: SavedFlightStd
    steps: Annotated[list[SavedStep], Field(max_length=MAX_STEPS)]
    pitch: Annotated[float, Field(ge=0, le=math.pi / 2)] | None = None
    box: SavedBox | None = None
    plane: Plane | None = None


class SavedLanding(CheckedModel):
    """A landing."""

    center: Place
    size: Annotated[list[Annotated[float, Field(ge=0, le=MAX_WIDTH)]], Field(min_length=2, max_length=2)]
    heading: Heading


class SavedStairway(CheckedModel):
    """A stairway."""

    id: Annotated[int, Field(ge=1, le=MAX_COUNT)]
    num_observations: Count
    first_seen_ns: Stamp
    last_seen_ns: Stamp
    flights: Annotated[list[SavedFlight], Field(min_length=1, max_length=MAX_FLIGHTS)]
    landings: Annotated[list[SavedLanding], Field(max_length=MAX_FLIGHTS)]
