"""Observations of one flight find each other; those of different flights do not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from ideal_observations import MS, make_flight, observe, poses_before
from stairmap.arrays import IntArray
from stairmap.modeling.association import find_groups
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.stairway import Flight

FLIGHT = make_flight()
POSE = poses_before(FLIGHT, 1)[0]


def groups_of(
    seen: Sequence[tuple[Flight, dict[str, Any]]], known: Sequence[int] | None = None
) -> list[IntArray]:
    """Members of the groups, in the order of their seeds."""
    table = ObservationTable()
    for index, (flight, how) in enumerate(seen):
        table.add(observe(flight, POSE, index * MS, **how))
    placed = PlacedObservations(table, np.tile(POSE, (len(seen), 1, 1)))
    chosen = np.arange(len(seen)) if known is None else np.array(known, dtype=np.int64)
    return [group.members for group in find_groups(placed, chosen)]


def are_one(first: Flight, second: Flight, **how: Any) -> bool:
    return len(groups_of([(first, {}), (second, how)])) == 1


def test_every_known_observation_is_in_exactly_one_group() -> None:
    other = make_flight(base=np.array([-4.0, 0.0, 0.0]), heading=np.pi)
    groups = groups_of([(FLIGHT, {}), (other, {})] * 3 + [(FLIGHT, {})], known=[0, 1, 2, 3, 5, 6])
    assert [group.tolist() for group in groups] == [[0, 2, 6], [1, 3, 5]]


@pytest.mark.parametrize("steps", [range(3), range(5, 8), [0, 4, 7]])
def test_other_steps_of_the_same_flight_are_of_it(steps: Any) -> None:
    assert are_one(FLIGHT, FLIGHT, steps=steps)


@pytest.mark.parametrize(
    "changes",
    [
        {"rise": 0.178, "run": 0.288},
        {"heading": np.radians(8)},
        {"base": np.array([2.1, 0.1, 0.05])},
        {"width": 0.7},
    ],
    ids=["a slightly other step", "a slightly other heading", "a slightly other place", "a narrower view"],
)
def test_what_differs_by_measurement_errors_is_of_the_same_flight(changes: dict[str, Any]) -> None:
    assert are_one(FLIGHT, make_flight(**changes))


@pytest.mark.parametrize(
    "changes",
    [
        {"heading": np.radians(90)},
        {"heading": np.pi, "base": np.array([4.0, 0.0, 0.0])},
        {"rise": 0.24, "run": 0.23},
        {"base": np.array([2.0, 1.5, 0.0])},
        {"base": np.array([2.0, 0.0, 1.0])},
        {"base": np.array([2.0 + 8 * 0.28 + 1.0, 0.0, 8 * 0.17])},
        {"base": np.array([2.0 + 20 * 0.28, 0.0, 20 * 0.17])},
    ],
    ids=[
        "another heading", "the opposite heading", "another step", "beside it", "above it",
        "behind a landing", "twelve steps up its line",
    ],
)  # fmt: skip
def test_what_lies_elsewhere_or_is_otherwise_is_another_flight(changes: dict[str, Any]) -> None:
    assert not are_one(FLIGHT, make_flight(**changes))


def test_groups_come_in_the_order_of_how_good_their_seeds_are() -> None:
    other = make_flight(base=np.array([-4.0, 0.0, 0.0]), heading=np.pi)
    groups = groups_of([(FLIGHT, {"steps": range(5)}), (other, {}), (FLIGHT, {"steps": range(4)})])
    assert [group.tolist() for group in groups] == [[1], [0, 2]]


def test_nothing_known_is_nothing_found() -> None:
    assert groups_of([(FLIGHT, {})], known=[]) == []
