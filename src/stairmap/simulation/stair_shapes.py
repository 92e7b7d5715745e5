"""Dimensions of stairways to simulate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Side = Literal["open", "wall", "railing"]
"""What stands along one side of a flight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightShape:
    """Dimensions of one flight, m.

    Attributes
    ----------
    rise, run, width
        Dimensions of a step.
    num_risers
        Number of risers; the last tread is the upper floor or landing.
    overhang
        How far a nosing stands before its riser; codes allow 0 to 0.03.
    lip
        Thickness of treads that overhang or stand free.
    tread_slope
        How much the treads fall towards the front, as a ratio; floor, landing and top stay level.
    odd_risers
        Risers that are higher than the others by so much, as (number from 0, m).
    irregularity
        Standard deviation of each single rise and run; surveys found up to 0.019 and 0.011.
    open_risers
        Whether one can look through between the treads.
    soffit
        Whether the flight is a sloping slab with free space below, instead of solid to the floor.
    left, right
        What stands along either side, as seen from below.
    """

    rise: float
    run: float
    width: float
    num_risers: int
    overhang: float = 0.0
    lip: float = 0.04
    tread_slope: float = 0.0
    odd_risers: tuple[tuple[int, float], ...] = ()
    irregularity: float = 0.0
    open_risers: bool = False
    soffit: bool = False
    left: Side = "open"
    right: Side = "open"


@dataclass(frozen=True, slots=True, kw_only=True)
class StairwayShape:
    """Flights of a stairway and the turns between them.

    Attributes
    ----------
    flights
        From the lowest.
    turns
        Turn on the landing after each flight but the last: 0, +90, -90, +180 or -180 deg,
        counter-clockwise seen from above.
    landing_length
        Length of every landing along the flight that reaches it, m.
    well
        Gap between the two flights of a half turn, m.
    """

    flights: tuple[FlightShape, ...]
    turns: tuple[int, ...] = ()
    landing_length: float = 1.2
    well: float = 0.2

    def __post_init__(self) -> None:
        if len(self.turns) != len(self.flights) - 1:
            raise ValueError(
                f"{len(self.flights)} flights need {len(self.flights) - 1} turns, got {self.turns}"
            )
        if not set(self.turns) <= {0, 90, -90, 180, -180}:
            raise ValueError(f"a turn is 0, 90, -90, 180 or -180 deg, got {self.turns}")
