"""One stairway is reported once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ideal_observations import make_flight
from stairmap.modeling.duplicates import MARGIN, without_duplicates
from stairmap.modeling.fitting import FittedFlight
from stairmap.stairway import Flight

FLIGHT = make_flight(heading=0.6)


def fitted(flight: Flight, num_members: int) -> FittedFlight:
    return FittedFlight(
        flight=flight,
        members=np.arange(num_members),
        num_confirmed_steps=5,
        num_agreeing=num_members,
        num_precise=num_members,
    )


def beside(along: float = 0.0, left: float = 0.0, up: float = 0.0, **changes: Any) -> Flight:
    """The flight in another place, in its own axes, m, and with what else is different."""
    base = FLIGHT.base + FLIGHT.map_from_flight[:3, :3] @ [along, left, up]
    return make_flight(**{"base": base, "heading": 0.6, **changes})


def is_duplicate(flight: Flight) -> bool:
    """Whether a flight with fewer observations is dropped beside the better one."""
    kept = without_duplicates([fitted(flight, 4), fitted(FLIGHT, 9)])
    assert kept[0].flight is FLIGHT
    return len(kept) == 1


def test_the_flight_with_more_observations_stays_whatever_the_order() -> None:
    poor, good = fitted(beside(rise=0.20), 4), fitted(FLIGHT, 9)
    assert without_duplicates([poor, good]) == [good]
    assert without_duplicates([good, poor]) == [good]


@pytest.mark.parametrize(("turn_deg", "expected"), [(29.0, True), (-29.0, True), (31.0, False)])
def test_a_flight_in_its_place_that_heads_nearly_the_same_way_is_a_poor_view_of_it(
    turn_deg: float, expected: bool
) -> None:
    # Short ones, turned about their middle, so that the nosings stay in place.
    turned = make_flight(heading=0.6 + np.radians(turn_deg), num_risers=3, width=0.6)
    middle = turned.edges().mean(axis=(0, 1)) - FLIGHT.edges()[3:6].mean(axis=(0, 1))
    shifted = make_flight(base=turned.base - middle, heading=turned.heading, num_risers=3, width=0.6)
    assert is_duplicate(shifted) is expected


@pytest.mark.parametrize(
    ("flight", "expected"),
    [
        (beside(up=MARGIN - 0.02), True),
        (beside(up=MARGIN + 0.02), False),
        (beside(up=-MARGIN + 0.02), True),
        (beside(up=-MARGIN - 0.02), False),
        (beside(left=0.58), True),
        (beside(left=0.62), False),
        (beside(left=-0.62), False),
        (beside(along=-0.28 * 4, up=-0.17 * 4), True),
        (beside(along=-0.28 * 7, up=-0.17 * 7), False),
        (beside(along=0.28 * 4, up=0.17 * 4), True),
        (beside(along=0.28 * 7, up=0.17 * 7), False),
    ],
)
def test_most_nosings_must_lie_along_the_better_flight(flight: Flight, expected: bool) -> None:
    assert is_duplicate(flight) is expected


def test_exactly_half_of_the_nosings_are_not_most() -> None:
    # The better flight takes nosings up to a run and the margin beyond its last one: here three of six.
    beyond = beside(along=0.28 * 6, up=0.17 * 6, num_risers=6)
    assert is_duplicate(beyond) is False
    assert is_duplicate(beside(along=0.28 * 5, up=0.17 * 5, num_risers=6)) is True


def test_flights_far_apart_all_stay() -> None:
    flights = [fitted(make_flight(base=np.array([9.0 * index, 0.0, 0.0])), 5) for index in range(6)]
    assert without_duplicates(flights) == flights
    assert without_duplicates([]) == []


def test_a_duplicate_of_a_dropped_flight_is_judged_by_those_that_stay() -> None:
    near = beside(up=0.2)
    farther = beside(up=0.4)
    kept = without_duplicates([fitted(FLIGHT, 9), fitted(near, 6), fitted(farther, 4)])
    assert [item.flight for item in kept] == [FLIGHT, farther]
