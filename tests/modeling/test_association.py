"""Observations of one flight find each other; those of different flights do not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ideal_observations import MS, make_flight, observe, poses_before
from stairmap.arrays import Float64Array, IntArray
from stairmap.modeling import association
from stairmap.modeling.association import ObservationGroup, Reach, close_groups, find_groups
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


def moved_by(x: float, y: float, z: float) -> Float64Array:
    """The flight's base, moved, m."""
    return FLIGHT.base + np.array([x, y, z])


def along_line(steps: float) -> Flight:
    return make_flight(base=FLIGHT.base + steps * np.array([0.28, 0.0, 0.17]))


NORMAL = np.array([-np.sin(FLIGHT.pitch), 0.0, np.cos(FLIGHT.pitch)])


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"heading": np.radians(19.5)}, True),
        ({"heading": np.radians(-19.5)}, True),
        ({"heading": np.radians(20.5)}, False),
        ({"base": FLIGHT.base + 0.29 * NORMAL}, True),
        ({"base": FLIGHT.base - 0.29 * NORMAL}, True),
        ({"base": FLIGHT.base + 0.31 * NORMAL}, False),
        ({"base": FLIGHT.base - 0.31 * NORMAL}, False),
        # Rise and run: 35 mm and twice √2 of the 2 mm that each observation states.
        ({"rise": 0.17 + 0.040}, True),
        ({"rise": 0.17 + 0.041}, False),
        ({"rise": 0.17 - 0.041}, False),
        ({"run": 0.28 + 0.040}, True),
        ({"run": 0.28 - 0.041}, False),
        # Lateral overlap of 0.36 m of 1.2 m.
        ({"base": moved_by(0.0, 0.83, 0.0)}, True),
        ({"base": moved_by(0.0, 0.85, 0.0)}, False),
        ({"base": moved_by(0.0, -0.85, 0.0)}, False),
    ],
)
def test_each_limit_of_what_may_be_one_flight_has_two_sides(changes: dict[str, Any], expected: bool) -> None:
    assert are_one(FLIGHT, make_flight(**changes)) is expected


@pytest.mark.parametrize(("steps", "expected"), [(9.9, True), (10.1, False), (-9.9, True), (-10.1, False)])
def test_views_with_three_steps_unseen_between_them_may_be_one_flight(steps: float, expected: bool) -> None:
    assert are_one(FLIGHT, along_line(steps)) is expected


def test_the_overlap_is_a_share_of_the_narrower_view() -> None:
    narrow = {"base": moved_by(0.0, 0.70, 0.0), "width": 0.4}
    assert are_one(FLIGHT, make_flight(**narrow)) is False
    narrow["base"] = moved_by(0.0, 0.66, 0.0)
    assert are_one(FLIGHT, make_flight(**narrow)) is True


def test_the_best_observation_begins_a_group() -> None:
    table = ObservationTable()
    for index, (steps, rise_std) in enumerate([(range(5), 0.002), (range(6), 0.06), (range(6), 0.04)]):
        seen = observe(FLIGHT, POSE, index * MS, steps=steps)
        covariance = seen.covariance.copy()
        covariance[0, 0] = rise_std**2
        object.__setattr__(seen, "covariance", covariance)
        table.add(seen)
    placed = PlacedObservations(table, np.tile(POSE, (3, 1, 1)))
    (group,) = find_groups(placed, np.arange(3))
    # A step more is worth 50 mm of the rise's deviation.
    assert group.seed == 2
    assert group.seed_quality == pytest.approx(6 - 20 * 0.04)
    (group,) = find_groups(placed, np.array([0, 1]))
    assert group.seed == 0


def test_the_most_typical_member_gathers_what_the_seed_did_not_reach() -> None:
    # Places drift by 0.2 m from one to the next: the seed at one end reaches the second, that the third.
    drifting = [make_flight(base=FLIGHT.base + 0.2 * index * NORMAL) for index in range(3)]
    reached = [
        (drifting[0], {}),
        *[(drifting[1], {"steps": range(7)})] * 3,
        (drifting[2], {"steps": range(6)}),
    ]
    assert [group.tolist() for group in groups_of(reached)] == [[0, 1, 2, 3, 4]]
    alone = [(drifting[0], {}), (drifting[1], {"steps": range(7)}), (drifting[2], {"steps": range(6)})]
    assert [group.tolist() for group in groups_of(alone)] == [[0, 1], [2]]


def box(low: float, high: float) -> ObservationGroup:
    return ObservationGroup(
        members=np.zeros(0, dtype=np.int64), seed=0, seed_quality=0.0,
        low=np.full(3, low), high=np.full(3, high),
    )  # fmt: skip


def closed(touched: list[bool], low: float, high: float) -> list[bool]:
    groups = [box(0, 1), box(1, 2), box(2, 3), box(5, 6), box(6.5, 8)]
    corners = np.full((1, 3), low), np.full((1, 3), high)
    return close_groups(groups, np.array(touched), *corners).tolist()


def test_groups_in_reach_of_each_other_change_together() -> None:
    none = [False] * 5
    assert closed(none, 20, 21) == none
    assert closed(none, 2.5, 2.6) == [True, True, True, False, False]
    assert closed(none, 6.2, 6.3) == none
    assert closed(none, 6.0, 6.6) == [False, False, False, True, True]
    assert closed([True, False, False, False, False], 20, 21) == [True, True, True, False, False]
    assert closed([False, False, False, True, False], 20, 21) == [False, False, False, True, False]


def test_boxes_that_miss_each_other_on_one_axis_do_not_meet() -> None:
    group = box(0, 1)
    for axis in range(3):
        low, high = np.zeros((1, 3)), np.ones((1, 3))
        low[0, axis], high[0, axis] = 2.0, 3.0
        assert not close_groups([group], np.array([False]), low, high).any()


def test_no_observations_and_no_groups_are_fine() -> None:
    nothing = np.zeros((0, 3))
    assert close_groups([], np.zeros(0, dtype=bool), nothing, nothing).tolist() == []
    assert close_groups([box(0, 1)], np.array([False]), nothing, nothing).tolist() == [False]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    along=st.floats(-12, 12),
    left=st.floats(-1.5, 1.5),
    up=st.floats(-4, 4),
    first=st.integers(0, 5),
    num=st.integers(2, 8),
    turn=st.floats(-0.4, 0.4),
    rise=st.floats(0.13, 0.21),
)
def test_what_fits_is_always_in_reach(
    along: float, left: float, up: float, first: int, num: int, turn: float, rise: float
) -> None:
    other = make_flight(base=moved_by(along, left, up), heading=turn, rise=rise)
    table = ObservationTable()
    table.add(observe(FLIGHT, POSE, 0))
    table.add(observe(other, POSE, MS, steps=range(first, min(first + num, 8))))
    placed = PlacedObservations(table, np.tile(POSE, (2, 1, 1)))
    groups = find_groups(placed, np.arange(2))
    (alone,) = find_groups(placed, np.array([0]))
    reach = Reach(placed, np.array([1]))
    meets = close_groups([alone], np.array([False]), reach.low, reach.high)
    assert meets[0] or len(groups) == 2


def test_what_only_the_seed_reaches_stays_in_its_group() -> None:
    seen = [
        (FLIGHT, {}),
        *[(make_flight(base=FLIGHT.base + 0.2 * NORMAL), {"steps": range(7)})] * 3,
        (make_flight(base=FLIGHT.base - 0.2 * NORMAL), {"steps": range(6)}),
    ]
    assert [group.tolist() for group in groups_of(seen)] == [[0, 1, 2, 3, 4]]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), spread=st.sampled_from([1.0, 6.0, 60.0]))
def test_groups_are_those_that_a_look_at_all_observations_finds(seed: int, spread: float) -> None:
    random = np.random.default_rng(seed)
    seen = []
    for _ in range(30):
        base = np.round(random.uniform(0, spread, 3) * [1, 1, 0.2], 1)
        seen.append((make_flight(base=base, heading=float(random.choice([0.0, 0.1, 2.0]))), {}))
    found = groups_of(seen)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(association._Cells, "of", lambda _, __, is_free: np.flatnonzero(is_free))
        among_all = groups_of(seen)
    assert [group.tolist() for group in found] == [group.tolist() for group in among_all]
    assert sorted(index for group in found for index in group.tolist()) == list(range(30))
