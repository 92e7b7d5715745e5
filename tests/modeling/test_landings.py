"""Flights that a landing joins become one stairway, whichever way it turns."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from ideal_observations import (
    make_flight,
    mapper_of,
    observe_all,
    poses_before,
    the_only,
    trajectory_of,
)
from stairmap.modeling.landings import find_storeys, join_flights, make_landing, top_of
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import build_stairway
from stairmap.stairway import Flight, Landing, Stairway

SHAPE = FlightShape(rise=0.17, run=0.28, width=1.1, num_risers=7)
TURNS = {"straight": 0, "quarter-turn left": 90, "quarter-turn right": -90, "half-turn left": 180,
         "half-turn right": -180}  # fmt: skip


def build(*turns: int, heading: float = 0.4) -> Stairway:
    shape = StairwayShape(flights=(SHAPE,) * (len(turns) + 1), turns=turns)
    return build_stairway(
        shape, base=np.array([2.0, 1.0, 0.0]), heading=heading, stairway_id=1,
        random=np.random.default_rng(0),
    ).stairway  # fmt: skip


def corners(landing: Landing) -> np.ndarray:
    forward = np.array([np.cos(landing.heading), np.sin(landing.heading), 0]) * landing.size[0] / 2
    left = np.array([-np.sin(landing.heading), np.cos(landing.heading), 0]) * landing.size[1] / 2
    return np.array([landing.center + a * forward + b * left for a in (-1, 1) for b in (-1, 1)])


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS.keys())
def test_two_flights_of_a_stairway_are_joined_whatever_their_order(turn: int) -> None:
    flights = list(build(turn).flights)
    assert join_flights(flights) == [[0, 1]]
    assert join_flights(flights[::-1]) == [[1, 0]]


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS.keys())
def test_the_landing_is_level_and_where_it_was_built(turn: int) -> None:
    stairway = build(turn)
    lower, upper = stairway.flights
    landing, true = make_landing(lower, upper), stairway.landings[0]
    assert landing.center[2] == pytest.approx(7 * 0.17, abs=1e-9)
    assert landing.heading == lower.heading
    np.testing.assert_allclose(landing.center, true.center, atol=0.12)
    assert landing.size == pytest.approx(true.size, abs=0.15)


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS.keys())
def test_the_landing_reaches_both_flights(turn: int) -> None:
    lower, upper = build(turn).flights
    landing = make_landing(lower, upper)
    axis = np.array([np.cos(landing.heading), np.sin(landing.heading), 0])
    side = np.array([-axis[1], axis[0], 0])
    feet = upper.edges()[0] - [0, 0, upper.rise]
    for point in (*lower.edges()[-1], *feet):
        offset = point - landing.center
        assert abs(offset @ axis) <= landing.size[0] / 2 + 1e-6
        assert abs(offset @ side) <= landing.size[1] / 2 + 1e-6


def test_three_flights_are_one_chain_from_the_lowest() -> None:
    flights = build(90, 90).flights
    for order in permutations(range(3)):
        (chain,) = join_flights([flights[index] for index in order])
        assert [order[index] for index in chain] == [0, 1, 2]


def test_flights_of_two_stairways_are_two_chains() -> None:
    here, there = build(90).flights, build(-180, heading=2.0).flights
    away = [
        make_flight(
            base=flight.base + np.array([20.0, 0.0, 0.0]), heading=flight.heading, width=1.1, num_risers=7
        )
        for flight in there
    ]
    assert sorted(join_flights([here[1], away[0], here[0], away[1]])) == [[1, 3], [2, 0]]


@pytest.mark.parametrize(
    "base",
    [[2.0, 3.5, 0.0], [5.2, 0.0, 0.7], [9.5, 0.0, 8 * 0.17], [4.5, 0.0, 8 * 0.17 + 0.4]],
    ids=["beside it on the floor", "halfway up", "five metres on", "half a metre higher"],
)
def test_flights_without_a_landing_between_them_are_not_joined(base: list[float]) -> None:
    first = make_flight()
    assert sorted(join_flights([first, make_flight(base=np.array(base))])) == [[0], [1]]


def test_one_flight_is_its_own_chain_and_none_is_none() -> None:
    assert join_flights([make_flight()]) == [[0]]
    assert join_flights([]) == []


def test_the_top_of_a_flight_is_the_middle_of_its_last_nosing() -> None:
    flight = make_flight(heading=1.1, num_risers=5)
    np.testing.assert_allclose(top_of(flight), flight.edges()[-1].mean(axis=0), atol=1e-12)


def observed(flights: tuple[Flight, ...]) -> Stairway:
    """The one stairway that a mapper makes of flights seen one after the other."""
    poses, observations = [], []
    for flight in flights:
        mine = poses_before(flight, 5)
        observations += observe_all(flight, mine, first_stamp=len(poses))
        poses += mine
    return the_only(mapper_of(observations).stairways(trajectory_of(poses)))


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS.keys())
def test_a_mapped_stairway_has_its_flights_and_its_landing(turn: int) -> None:
    true = build(turn)
    stairway = observed(true.flights)
    assert [flight.num_risers for flight in stairway.flights] == [7, 7]
    assert len(stairway.landings) == 1
    np.testing.assert_allclose(stairway.landings[0].center, true.landings[0].center, atol=0.15)
    assert stairway.num_observations == 10
    assert corners(stairway.landings[0])[:, 2] == pytest.approx([7 * 0.17] * 4, abs=0.01)


def test_the_upper_flight_seen_first_makes_the_same_stairway() -> None:
    lower, upper = build(180).flights
    stairway = observed((upper, lower))
    assert stairway.id == 1
    np.testing.assert_allclose(stairway.flights[0].base, lower.base, atol=0.005)
    np.testing.assert_allclose(stairway.flights[1].base, upper.base, atol=0.005)


def test_an_id_stays_when_a_second_flight_joins() -> None:
    lower, upper = build(90).flights
    poses = [*poses_before(lower, 5), *poses_before(upper, 9)]
    trajectory = trajectory_of(poses)
    mapper = mapper_of(observe_all(lower, poses[:5]))
    before = the_only(mapper.stairways(trajectory)).id
    for observation in observe_all(upper, poses[5:], first_stamp=5):
        mapper.add(observation)
        assert (
            the_only([item for item in mapper.stairways(trajectory) if item.id == before])
            .flights[0]
            .num_risers
            == 7
        )
    assert the_only(mapper.stairways(trajectory)).id == before


def half_turns(*num_risers: int, rise: float = 0.17) -> list[Flight]:
    """Flights there and back, each beginning where the one below ends, half a step to the side."""
    flights, low = [], 0.0
    for index, num in enumerate(num_risers):
        turned = index % 2
        base = np.array([2.5 * turned, 1.3 * turned, low])
        flights.append(make_flight(base=base, heading=np.pi * turned, rise=rise, num_risers=num))
        low += rise * num
    return flights


def test_half_turn_stairs_over_three_storeys_are_three_stairways() -> None:
    flights = half_turns(9, 9, 9, 9, 9, 9)
    assert join_flights(flights) == [[0, 1], [2, 3], [4, 5]]
    assert join_flights(flights[::-1]) == [[5, 4], [3, 2], [1, 0]]


def test_scissor_stairs_with_a_flight_a_storey_are_a_stairway_a_storey() -> None:
    assert join_flights(half_turns(15, 15, 15, rise=0.2)) == [[0], [1], [2]]


def test_a_top_flight_seen_in_part_is_a_storey_too() -> None:
    assert find_storeys(half_turns(15, 8, rise=0.2)) == [0, 1]
    assert find_storeys(half_turns(15, 3, rise=0.2)) == [0]
    assert find_storeys(half_turns(9, 9, 4)) == [0, 2]


def test_flights_below_the_rise_of_a_storey_stay_together() -> None:
    for num_risers in ((9, 9), (6, 6, 6), (4, 4, 4, 4), (10,)):
        assert find_storeys(half_turns(*num_risers)) == [0]


def square_turns(num: int, *, num_risers: int = 6) -> list[Flight]:
    """Quarter-turn flights about a square well of 3 m; four of them are one round."""
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])
    return [
        make_flight(
            base=np.array([*corners[index % 4], 0.17 * num_risers * index]),
            heading=np.pi / 2 * (index % 4), num_risers=num_risers,
        )
        for index in range(num)
    ]  # fmt: skip


def test_stairs_about_a_well_are_cut_where_they_stand_over_their_beginning() -> None:
    # A round rises by 4.08 m; three flights rise by 3.06 m, and the fourth stands elsewhere.
    assert find_storeys(square_turns(8)) == [0, 4]


def test_stairs_that_never_come_back_over_themselves_stay_together() -> None:
    straight = [
        make_flight(base=np.array([3.0 * index, 0.0, 0.17 * 8 * index]), num_risers=8) for index in range(4)
    ]
    assert find_storeys(straight) == [0]


def test_a_mapped_stair_over_two_storeys_has_two_ids_that_stay() -> None:
    flights = half_turns(9, 9, 9, 9)
    poses, observations = [], []
    for flight in flights:
        mine = poses_before(flight, 5)
        observations += observe_all(flight, mine, first_stamp=len(poses))
        poses += mine
    mapper, trajectory = mapper_of(observations), trajectory_of(poses)
    first = mapper.stairways(trajectory)
    assert [(item.id, len(item.flights), len(item.landings)) for item in first] == [(1, 2, 1), (2, 2, 1)]
    assert [item.id for item in mapper.stairways(trajectory)] == [1, 2]
    assert first[1].flights[0].base[2] == pytest.approx(18 * 0.17, abs=0.02)


FIRST = make_flight()
TOP = np.array([2.0 + 7 * 0.28, 0.0, 8 * 0.17])


def joins(along: float = 0.9, left: float = 0.0, up: float = 0.0, *, rise: float = 0.17) -> bool:
    """Whether a flight whose foot lies there from the first one's top is joined to it."""
    first = make_flight(rise=rise)
    top = np.array([2.0 + 7 * 0.28, 0.0, 8 * rise])
    return join_flights([first, make_flight(base=top + np.array([along, left, up]), rise=rise)]) == [[0, 1]]


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ({"along": 2.95}, True),
        ({"along": 3.05}, False),
        ({"left": 2.8}, True),
        ({"left": -2.9}, False),
        ({"up": 0.101}, True),
        ({"up": 0.103}, False),
        ({"up": -0.101}, True),
        ({"up": -0.103}, False),
        ({"up": 0.119, "rise": 0.20}, True),
        ({"up": 0.121, "rise": 0.20}, False),
        ({"up": 0.099, "rise": 0.12}, True),
        ({"up": 0.101, "rise": 0.12}, False),
    ],
)
def test_a_flight_follows_when_its_foot_is_near_and_as_high_as_the_top(
    place: dict[str, float], expected: bool
) -> None:
    assert joins(**place) is expected


def test_of_two_flights_that_may_follow_the_nearest_does_and_height_counts_five_times() -> None:
    near = make_flight(base=TOP + np.array([1.0, 0.0, 0.0]))
    other = make_flight(base=TOP + np.array([0.0, 1.2, 0.0]), heading=np.pi / 2)
    assert join_flights([FIRST, other, near]) == [[0, 2], [1]]
    higher = make_flight(base=TOP + np.array([0.0, 0.7, 0.05]), heading=np.pi / 2)
    assert join_flights([FIRST, higher, near]) == [[0, 1], [2]]
    highest = make_flight(base=TOP + np.array([0.0, 0.7, 0.07]), heading=np.pi / 2)
    assert join_flights([FIRST, highest, near]) == [[0, 2], [1]]


def test_one_flight_follows_one_other() -> None:
    second = make_flight(base=FIRST.base + np.array([0.0, 1.3, 0.0]))
    above = make_flight(base=TOP + np.array([0.9, 0.3, 0.0]))
    assert join_flights([FIRST, second, above]) == [[0, 2], [1]]


def test_flights_that_follow_each_other_in_a_circle_are_a_chain() -> None:
    # Two low sills beside each other: each begins near the other's top.
    low = make_flight(base=np.zeros(3), num_risers=1, rise=0.04)
    beside = make_flight(base=np.array([0.5, 0.0, 0.02]), num_risers=1, rise=0.04)
    (chain,) = join_flights([low, beside])
    assert sorted(chain) == [0, 1]


@pytest.mark.parametrize(("rise", "begins"), [(2.25 / 15, [0]), (2.35 / 15, [0, 1])])
def test_a_flight_of_a_storey_is_cut_from_the_next(rise: float, begins: list[int]) -> None:
    assert find_storeys(half_turns(15, 15, rise=rise)) == begins


@pytest.mark.parametrize(("offset", "begins"), [(0.95, [0, 2]), (1.05, [0])])
def test_a_flight_stands_over_another_within_a_metre(offset: float, begins: list[int]) -> None:
    flights = half_turns(9, 9, 9)
    moved = make_flight(base=flights[2].base + np.array([offset, 0.0, 0.0]), num_risers=9)
    assert find_storeys([*flights[:2], moved]) == begins


@pytest.mark.parametrize(("turn_deg", "begins"), [(24.0, [0, 2]), (-24.0, [0, 2]), (26.0, [0])])
def test_a_flight_stands_over_another_that_heads_the_same_way(turn_deg: float, begins: list[int]) -> None:
    flights = half_turns(9, 9, 9)
    turned = make_flight(base=flights[2].base, heading=np.radians(turn_deg), num_risers=9)
    assert find_storeys([*flights[:2], turned]) == begins


@pytest.mark.parametrize(("num_risers", "begins"), [(6, [0]), (7, [0, 2])])
def test_a_storey_must_have_been_climbed_before_stairs_repeat(num_risers: int, begins: list[int]) -> None:
    # Two flights of six or seven risers: 2.04 and 2.38 m.
    assert find_storeys(half_turns(num_risers, num_risers, num_risers)) == begins


def test_a_straight_landing_ends_at_the_foot_of_the_next_flight() -> None:
    upper = make_flight(base=TOP + np.array([1.1, 0.0, 0.0]))
    landing = make_landing(FIRST, upper)
    assert landing.size == pytest.approx((1.1, 1.2))
    np.testing.assert_allclose(landing.center, TOP + np.array([0.55, 0.0, 0.0]), atol=1e-9)


def test_a_landing_where_the_flights_turn_is_as_deep_as_the_wider_one() -> None:
    upper = make_flight(base=TOP + np.array([0.3, 0.5, 0.0]), heading=np.pi / 2, width=0.9)
    assert make_landing(FIRST, upper).size[0] == pytest.approx(1.2)
    wider = make_flight(base=TOP + np.array([0.3, 0.5, 0.0]), heading=np.pi / 2, width=2.0)
    assert make_landing(FIRST, wider).size[0] == pytest.approx(2.0)


def test_a_landing_has_a_length_even_where_two_flights_meet() -> None:
    assert make_landing(FIRST, make_flight(base=TOP)).size[0] == pytest.approx(0.1)
