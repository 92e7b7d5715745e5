"""Stairways are cut where a landing is a floor, and only there."""

from __future__ import annotations

import math

from stairmap.navigation.storeys import split_at_floors
from stairmap.stairway import Landing
from walkable_stairways import make_flight, make_half_turn, make_stairway


def stack(*num_risers):
    """Return one stairway of flights there and back, 0.2 m a riser."""
    flights, landings, low = [], [], 0.0
    for index, num in enumerate(num_risers):
        turned = index % 2
        flights.append(
            make_flight(
                base=(4.0 * turned, 2.0 * turned, low), heading=math.pi * turned, rise=0.2, num_risers=num
            )
        )
        low += 0.2 * num
        landings.append(Landing(center=(4.5, 1.0, low), size=(1.2, 3.0), heading=0.0))
    return make_stairway(*flights, stairway_id=4, landings=tuple(landings[:-1]))


def test_a_scissor_stair_with_one_flight_a_storey_becomes_a_stairway_a_storey():
    parts = split_at_floors([stack(15, 15, 15)])
    assert [(part.id, len(part.flights), len(part.landings)) for part in parts] == [
        (4, 1, 0), (5, 1, 0), (6, 1, 0),
    ]  # fmt: skip


def test_a_top_flight_that_was_seen_in_part_is_a_storey_too():
    assert len(split_at_floors([stack(15, 8)])) == 2
    assert len(split_at_floors([stack(15, 3)])) == 1


def test_flights_between_floors_stay_together():
    for stairway in (make_half_turn(), stack(6, 6, 6), stack(10, 10)):
        assert split_at_floors([stairway]) == (stairway,)


def test_without_stairways_there_is_nothing():
    assert split_at_floors([]) == ()
