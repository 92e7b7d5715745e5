"""Drives whose truth and odometry are made up, for tests of the judgement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.evaluation.truth import DriveTruth, TrueFlight
from stairmap.stairway import Flight, FlightStd, Stairway, Step
from stairmap.transforms import rotation_from_vector, transform_from_parts

STD = FlightStd(
    rise=0.002, run=0.003, width=0.02, pitch=0.01, heading=0.01, base=np.full(3, 0.01), overhang=0.003
)


def make_flight(**changes: Any) -> Flight:
    """Return a flight of ten risers with its nosings, turned and away from the origin."""
    measures: dict[str, Any] = {
        "base": np.array([2.0, -1.0, 0.3]), "heading": 0.7, "rise": 0.17, "run": 0.28, "width": 1.2,
        "num_risers": 10, "overhang": 0.02, "std": STD,
    }  # fmt: skip
    flight = Flight(**{**measures, **changes})
    return replace(flight, steps=tuple(Step(nosing=edge, num_observations=5) for edge in flight.edges()))


def make_true_flight(flight: Flight, *, stairway_id: int = 1, **changes: Any) -> TrueFlight:
    """Return a flight that had to be found and was whole in view."""
    seen = np.ones(flight.num_risers, dtype=bool)
    values: dict[str, Any] = {
        "stairway_id": stairway_id, "flight_index": 0, "flight": flight, "is_optional": False,
        "must_be_found": True, "num_near_frames": 40, "surely_seen": seen, "possibly_seen": seen,
    }  # fmt: skip
    return TrueFlight(**{**values, **changes})


def make_drifts(num: int) -> Float64Array:
    """Return (num, 4, 4) drifts that grow to 0.2 m and 5 degrees."""
    shares = np.linspace(0, 1, num)
    return np.array(
        [
            transform_from_parts(
                rotation_from_vector([0, 0, share * np.radians(5)]), share * np.array([0.15, -0.13, 0.0])
            )
            for share in shares
        ]
    )


def make_truth(*flights: TrueFlight, drifts: Float64Array | None = None) -> DriveTruth:
    """Return the truth of a drive; without drifts, of ten frames with perfect odometry."""
    drifts = np.tile(np.eye(4), (10, 1, 1)) if drifts is None else drifts
    return DriveTruth(flights=flights, drifts=drifts, true_poses=np.tile(np.eye(4), (len(drifts), 1, 1)))


def make_stairways(flights: Sequence[Flight]) -> tuple[Stairway, ...]:
    """Return each flight as a stairway of its own."""
    return tuple(
        Stairway(id=index, flights=(flight,), num_observations=9, first_seen_ns=0, last_seen_ns=1)
        for index, flight in enumerate(flights, start=1)
    )
