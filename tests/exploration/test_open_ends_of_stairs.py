"""Flights whose end nobody saw are looked at from the level where they would begin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_worlds import SPOT, stairs
from test_candidates import search_of

from stairmap.exploration.candidates import LOOK_DISTANCE, MAX_LOOKS, find_tasks
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.odometry import Planar
from stairmap.exploration.open_ends import find_open_ends

RISE, RUN = 0.15, 0.30


def known_from(height, *, cut=3, **seen):
    """Return what a robot knows at a height that saw 6 of 9 risers from (2, 2, 0), without the first ones."""
    _, stairway = stairs(RISE, RUN, 9)
    flight = stairway.flights[0]
    base = flight.base + cut * (RUN * flight.forward + RISE * np.array([0.0, 0.0, 1.0]))
    ends = {"bottom_seen": False, "top_seen": False, **seen}
    part = replace(flight, base=base, num_risers=6, steps=(), **ends)
    known = ExplorationMap(SPOT, Planar(x=0.5, y=2.0, z=height, heading=0.0))
    level, _ = known.enter_level()
    known.stairs.update([replace(stairway, flights=(part,), landings=())], known.levels)
    return known, level


def test_an_end_above_the_level_meets_it_where_its_unseen_steps_lead():
    known, level = known_from(0.0)
    (end,) = find_open_ends(known.stairs.links, level)
    assert end.is_up
    assert end.unseen == pytest.approx(3 * RISE)
    assert end.place == pytest.approx((2.0, 2.0), abs=1e-6)


def test_an_end_below_the_level_is_looked_down_at():
    known, level = known_from(9 * RISE, cut=0)
    (end,) = find_open_ends(known.stairs.links, level)
    assert not end.is_up
    assert end.unseen == pytest.approx(3 * RISE)
    # The ninth nosing is eight runs behind the first.
    assert end.place == pytest.approx((2.0 + 8 * RUN, 2.0), abs=1e-6)


@pytest.mark.parametrize("height", [-1.0, 0.45])
def test_ends_that_are_on_the_level_or_too_far_from_it_are_no_open_ends(height):
    known, level = known_from(height)
    assert find_open_ends(known.stairs.links, level) == []


def test_an_end_that_was_seen_or_a_flight_that_was_climbed_is_none():
    known, level = known_from(0.0, bottom_seen=True)
    assert find_open_ends(known.stairs.links, level) == []
    known, level = known_from(0.0)
    known.stairs.links[0].state = "failed"
    assert find_open_ends(known.stairs.links, level) == []


def test_an_open_end_is_looked_at_from_the_front_until_that_was_in_vain():
    known, level = known_from(0.0)
    known.level.map.block(np.array([[6.9, 3.9], [0.1, 0.1]]))
    everything = np.zeros((40, 70), dtype=bool)
    everything[5:35, 1:19] = True
    search = replace(search_of(everything), grid=level.map.grid(), opaque=level.map.opaque())
    (task,) = (task for task in find_tasks(known, level, search) if task.kind == "look")
    assert "lower end" in task.reason
    assert task.is_up
    assert task.position == pytest.approx((2.0 - LOOK_DISTANCE, 2.0), abs=0.1)
    assert task.target == pytest.approx((2.0, 2.0), abs=1e-6)
    known.stairs.links[0].looks[level.number] = MAX_LOOKS
    assert not [task for task in find_tasks(known, level, search) if task.kind == "look"]
