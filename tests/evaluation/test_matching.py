"""Estimates are matched by place, heading and dimension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from true_drives import make_flight

from stairmap.evaluation.matching import MAX_HEADING, find_deviation, match_flights
from stairmap.stairway import Flight
from value_strategies import flights, no_deadline

FLIGHT = make_flight()


def moved(flight: Flight, along: float, across: float = 0.0, up: float = 0.0) -> Flight:
    base = flight.base + flight.map_from_flight[:3, :3] @ [along, across, up]
    return replace(flight, base=base, steps=())


@no_deadline
@given(flights())
def test_a_flight_matches_itself_without_deviation(flight: Flight) -> None:
    assert find_deviation(flight, flight) == pytest.approx(0, abs=1e-6)


def test_a_second_estimate_of_a_flight_is_a_duplicate_and_the_better_one_is_kept() -> None:
    worse = replace(FLIGHT, rise=0.18)
    matching = match_flights([worse, FLIGHT], [FLIGHT], optional=[False])
    assert matching.pairs == ((1, 0),)
    assert matching.duplicates == (0,)
    assert matching.strays == ()


def test_two_halves_of_a_flight_are_one_match_and_one_duplicate() -> None:
    lower = replace(FLIGHT, num_risers=5)
    upper = replace(moved(FLIGHT, 5 * 0.28, up=5 * 0.17), num_risers=5)
    matching = match_flights([lower, upper], [FLIGHT], optional=[False])
    assert len(matching.pairs) == len(matching.duplicates) == 1


@pytest.mark.parametrize(
    "estimate",
    [
        replace(FLIGHT, rise=0.34, run=0.56, num_risers=5),
        replace(FLIGHT, heading=FLIGHT.heading + 1.01 * MAX_HEADING),
        replace(FLIGHT, heading=FLIGHT.heading + np.pi),
        moved(FLIGHT, 0, across=1.3),
        moved(FLIGHT, 0, up=0.3),
        moved(FLIGHT, 3.0),
    ],
    ids=["every second step", "turned", "upside down", "beside", "above", "behind"],
)
def test_what_is_elsewhere_or_of_another_size_is_no_match(estimate: Flight) -> None:
    matching = match_flights([estimate], [FLIGHT], optional=[False])
    assert matching.pairs == ()
    assert matching.strays == (0,)


def test_an_estimate_one_step_off_along_the_slope_still_matches() -> None:
    assert find_deviation(moved(FLIGHT, 0.28, up=0.17), FLIGHT) is not None


def test_a_partly_seen_flight_matches() -> None:
    assert find_deviation(replace(FLIGHT, num_risers=3, width=0.4), FLIGHT) is not None


def test_neighbours_are_assigned_so_that_both_are_found() -> None:
    left, right = moved(FLIGHT, 0, across=0.9), moved(FLIGHT, 0, across=-0.9)
    # The estimate of the right one leans to the left, and still goes to the right one.
    leaning = replace(moved(FLIGHT, 0, across=-0.3), width=2.0)
    matching = match_flights([leaning, left], [left, right], optional=[False, False])
    assert set(matching.pairs) == {(0, 1), (1, 0)}


def test_an_optional_flight_is_neither_false_nor_duplicate() -> None:
    matching = match_flights([FLIGHT, FLIGHT], [FLIGHT], optional=[True])
    assert len(matching.pairs) == 1
    assert matching.duplicates == matching.strays == ()


def test_nothing_matches_nothing() -> None:
    assert match_flights([], [], optional=[]).pairs == ()
    assert match_flights([], [FLIGHT], optional=[False]).pairs == ()
    assert match_flights([FLIGHT], [], optional=[]).strays == (0,)
