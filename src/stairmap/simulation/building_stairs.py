"""``stairs.json``: what was measured of the stairs of a real building, as a model with ranges."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from stairmap.errors import RecordingError
from stairmap.input_files import CheckedModel, Coordinate, Place, parse_json, read_text, shown, validated
from stairmap.saved_stairway import (
    MAX_FLIGHTS,
    MAX_RISE,
    MAX_RISERS,
    MAX_RUN,
    MAX_STAIRWAYS,
    MAX_WIDTH,
    MIN_RISE,
    MIN_RUN,
    MIN_WIDTH,
)

MAX_FREE = 1000.0
"""Longest free floor before a flight, m."""

TreadHeights = Annotated[list[Coordinate], Field(min_length=1, max_length=MAX_RISERS)]
Point = Annotated[list[Coordinate], Field(min_length=2, max_length=3)]


class _Rise(CheckedModel):
    mean: Annotated[float, Field(ge=MIN_RISE, le=MAX_RISE)]


class _Run(CheckedModel):
    mean: Annotated[float, Field(ge=MIN_RUN, le=MAX_RUN)]


class _Width(CheckedModel):
    median: Annotated[float, Field(ge=MIN_WIDTH, le=MAX_WIDTH)]


class MeasuredFlight(CheckedModel):
    """A straight flight; lengths in m, ``ascend_dir`` is the direction of ascent in the plan."""

    usable: bool
    approach_free_m: Annotated[float, Field(ge=0, le=MAX_FREE)]
    ascend_dir: Annotated[list[Annotated[float, Field(ge=-1.01, le=1.01)]], Field(min_length=2, max_length=2)]
    first_edge_mid: Place
    going: _Run
    width: _Width
    riser_between_treads: _Rise
    tread_z: TreadHeights
    n_risers: Annotated[int, Field(ge=1, le=MAX_RISERS)]
    n_treads: Annotated[int, Field(ge=0, le=MAX_RISERS)]
    z_bottom: Coordinate
    z_top: Coordinate


class MeasuredPart(CheckedModel):
    """A part that is no straight flight, such as winders."""

    kind: str
    tread_z: TreadHeights
    centres: Annotated[list[Point], Field(min_length=1, max_length=MAX_RISERS)] | None = None
    first_edge_mid: Point | None = None

    @model_validator(mode="after")
    def _check_has_place(self) -> MeasuredPart:
        if self.centres is None and self.first_edge_mid is None:
            raise ValueError("lacks both centres and first_edge_mid")
        return self

    @property
    def lowest_place(self) -> list[float]:
        """[x, y] of its first step."""
        return (self.centres[0] if self.centres else self.first_edge_mid or [])[:2]


class MeasuredStair(CheckedModel):
    """A stair: its flights, and what of it is none."""

    flights: Annotated[list[MeasuredFlight], Field(max_length=MAX_FLIGHTS)]
    other_parts: Annotated[list[MeasuredPart], Field(max_length=MAX_FLIGHTS)]


class MeasuredStairs(CheckedModel):
    """All stairs of a building."""

    stairs: Annotated[list[MeasuredStair], Field(min_length=1, max_length=MAX_STAIRWAYS)]


def load_measured_stairs(path: Path) -> MeasuredStairs:
    """Read ``stairs.json``.

    Raises
    ------
    RecordingError
        If it cannot be read, or is no such file.
    """
    text = read_text(path, error_type=RecordingError, what="the building's stairs")
    try:
        return validated(MeasuredStairs, parse_json(text))
    except ValueError as error:
        raise RecordingError(f"{shown(path)} is not a file of measured stairs: {error}") from error
