"""What of the true stairways a LiDAR measured: what a method can be asked to find."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Vector, readonly
from stairmap.simulation.visibility import find_approach
from stairmap.stairway import Flight, rounded
from stairmap.transforms import invert_transform, transform_points

ON_SURFACE = 0.04
"""A true point so far from a tread or riser at most, m, lies on it: real flights vary from step to step."""

SIDE_MARGIN = 0.005
"""Points nearer to a flight's sides, m, are of the faces beside it."""

MIN_RETURNS = 30
"""A step with so many returns within the range that is asked for was measured (ours)."""

MAX_VIEW_ANGLE = float(np.radians(60))
"""From farther aside, rad, risers are seen edge on."""

MIN_STEPS = 3
"""A flight of which so many steps were measured can be found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightReturns:
    """The returns of one flight over a drive, sweep by sweep.

    Attributes
    ----------
    distance
        (N,) horizontal distance of the LiDAR from the middle of the nearer end's nosing, m.
    view_angle
        (N,) angle there between the way the stairs are walked onto and the LiDAR, rad; see
        ``FlightVisibility``.
    num_returns
        (N, K) returns of each step, its riser and its tread.
    """

    distance: Float64Array
    view_angle: Float64Array
    num_returns: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "distance", readonly(self.distance))
        object.__setattr__(self, "view_angle", readonly(self.view_angle))
        object.__setattr__(self, "num_returns", readonly(self.num_returns, np.int64))

    def is_measured(self, max_distance: float) -> Mask:
        """Tell which (K,) steps had enough returns from within a distance, m, and not from aside."""
        near = self.num_returns[(self.distance <= max_distance) & (self.view_angle <= MAX_VIEW_ANGLE)]
        return np.asarray(near.sum(axis=0) >= MIN_RETURNS)

    def can_be_found(self, max_distance: float) -> bool:
        """Whether enough steps were measured from within a distance, m."""
        return int(np.count_nonzero(self.is_measured(max_distance))) >= MIN_STEPS

    def to_dict(self) -> dict[str, Any]:
        """Return the returns as they stand in ``truth.json``."""
        return {
            "distance": rounded(self.distance),
            "view_angle": rounded(self.view_angle),
            "num_returns": self.num_returns.sum(axis=0).tolist(),
        }


class ReturnCounter:
    """Counts the returns of true flights while a drive goes on.

    Parameters
    ----------
    flights
        The true flights; their ``steps`` hold the nosings.
    """

    def __init__(self, flights: Sequence[Flight]) -> None:
        self._flights = tuple(flights)
        self._approaches: list[list[tuple[float, float]]] = [[] for _ in flights]
        self._returns: list[list[IntArray]] = [[] for _ in flights]

    def add(self, true_points: Points, eye: Vector) -> None:
        """Take in the (N, 3) true points of a sweep and where the LiDAR was, map."""
        for flight, approaches, returns in zip(self._flights, self._approaches, self._returns, strict=True):
            nosings = np.array([step.nosing for step in flight.steps])
            approaches.append(find_approach(flight, nosings, eye)[:2])
            returns.append(count_returns(flight, true_points, eye))

    def result(self) -> tuple[FlightReturns, ...]:
        """Return what each flight gave so far."""
        return tuple(
            FlightReturns(
                distance=np.array(approaches).reshape(-1, 2)[:, 0],
                view_angle=np.array(approaches).reshape(-1, 2)[:, 1],
                num_returns=np.array(returns).reshape(-1, flight.num_risers),
            )
            for flight, approaches, returns in zip(
                self._flights, self._approaches, self._returns, strict=True
            )
        )


def count_returns(flight: Flight, points: Points, eye: Vector) -> IntArray:
    """Return (num_risers,) how many of (N, 3) true points, seen from (3,), lie on each step's riser or tread.

    A riser is seen from before it and a tread from above: what a LiDAR under a flight measures of its
    underside, or one beside it of its string, shows neither.
    """
    flight_from_map = invert_transform(flight.map_from_flight)
    local, (eye_along, _, eye_up) = transform_points(flight_from_map, points), flight_from_map[:3] @ [*eye, 1]
    heights = np.array([step.nosing[:, 2].mean() for step in flight.steps]) - flight.base[2]
    fronts = np.array([transform_points(flight_from_map, step.nosing)[:, 0].mean() for step in flight.steps])
    inside = np.abs(local[:, 1]) < 0.5 * flight.width - SIDE_MARGIN
    inside &= (local[:, 0] > fronts[0] - flight.run) & (local[:, 0] < fronts[-1] + flight.run)
    local = local[inside]
    counts = np.zeros(len(heights), dtype=np.int64)
    lower = 0.0
    for index, (front, height) in enumerate(zip(fronts, heights, strict=True)):
        back = fronts[index + 1] if index + 1 < len(fronts) else front + flight.run
        along, up = local[:, 0] - front, local[:, 2]
        on_riser = (np.abs(along) < ON_SURFACE) & (up > lower + ON_SURFACE / 2) & (up < height + ON_SURFACE)
        on_tread = (np.abs(up - height) < ON_SURFACE) & (along >= ON_SURFACE) & (local[:, 0] < back)
        seen = (on_riser & (eye_along < front)) | (on_tread & (eye_up > height))
        counts[index] = int(np.count_nonzero(seen))
        lower = height
    return counts
