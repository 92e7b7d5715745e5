"""Looks that miss a flight withdraw it; later views of it bring it back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ideal_observations import (
    MS,
    make_flight,
    mapper_of,
    observe,
    observe_all,
    poses_before,
    the_only,
    trajectory_of,
    turned_map,
)
from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.modeling.look_table import MAX_OFFSET, MAX_SUPPORT, NUM_VIEWS, LookTable, is_withdrawn
from stairmap.modeling.looks import Look
from stairmap.modeling.mapper import StairwayMapper
from stairmap.stairway import Flight
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, transform_points

FLIGHT = make_flight(heading=0.4)
NUM_MISSES = NUM_VIEWS - MAX_SUPPORT


def look_from(
    pose: Transform, stamp_ns: int, flight: Flight = FLIGHT, *, num_on: int = 0, num_through: int = 100
) -> Look:
    camera_from_map = invert_transform(pose)
    return Look(
        stamp_ns=stamp_ns,
        middle=transform_points(camera_from_map, flight.edges().mean(axis=(0, 1))),
        forward=camera_from_map[:3, :3] @ flight.forward,
        num_on=num_on,
        num_hidden=0,
        num_through=num_through,
        num_unmeasured=0,
    )


def stamps(*values: int) -> np.ndarray:
    return np.array(values, dtype=np.int64)


# Where a look was


def is_at(flight: Flight, other: Flight) -> bool:
    """Whether a look at one flight is taken for one at the other."""
    pose = poses_before(FLIGHT, 1)[0]
    table = LookTable()
    table.add(look_from(pose, 0, flight))
    table.place(np.arange(1), pose[None])
    return bool(table.are_at(other, np.arange(1))[0])


def moved(along: float = 0.0, left: float = 0.0, up: float = 0.0, turn: float = 0.0) -> Flight:
    shift = FLIGHT.map_from_flight[:3, :3] @ [along, left, up]
    return replace(FLIGHT, base=FLIGHT.base + shift, heading=FLIGHT.heading + turn)


NORMAL = np.array([-np.sin(FLIGHT.pitch), np.cos(FLIGHT.pitch)])
LENGTH = 7 * 0.28


@pytest.mark.parametrize(
    ("flight", "expected"),
    [
        (moved(), True),
        (moved(*((MAX_OFFSET - 0.01) * NORMAL[:1]), up=(MAX_OFFSET - 0.01) * NORMAL[1]), True),
        (moved(*((MAX_OFFSET + 0.01) * NORMAL[:1]), up=(MAX_OFFSET + 0.01) * NORMAL[1]), False),
        (moved(*(-(MAX_OFFSET + 0.01) * NORMAL[:1]), up=-(MAX_OFFSET + 0.01) * NORMAL[1]), False),
        (moved(left=0.24), True),
        (moved(left=0.26), False),
        (moved(left=-0.26), False),
        (moved(along=0.28 * 3, up=0.17 * 3), True),
        (moved(along=0.28 * 4, up=0.17 * 4), False),
        (moved(along=-0.28 * 3, up=-0.17 * 3), True),
        (moved(along=-0.28 * 4, up=-0.17 * 4), False),
    ],
)
def test_a_look_is_of_the_flight_whose_line_it_looked_along(flight: Flight, expected: bool) -> None:
    assert is_at(FLIGHT, flight) is expected


@pytest.mark.parametrize(("turn_deg", "expected"), [(9.0, True), (-9.0, True), (11.0, False), (180.0, False)])
def test_a_look_is_of_the_flight_that_heads_the_same_way(turn_deg: float, expected: bool) -> None:
    turned = replace(FLIGHT, heading=FLIGHT.heading + np.radians(turn_deg))
    middle = turned.edges().mean(axis=(0, 1)) - FLIGHT.edges().mean(axis=(0, 1))
    assert is_at(FLIGHT, replace(turned, base=turned.base - middle)) is expected


# How many looks withdraw a flight


def test_fifteen_of_the_last_eighteen_views_must_miss_it() -> None:
    seen = stamps(1, 2, 3)
    assert is_withdrawn(np.arange(10, 10 + NUM_MISSES), seen)
    assert not is_withdrawn(np.arange(10, 10 + NUM_MISSES - 1), seen)
    assert (NUM_MISSES, NUM_VIEWS, MAX_SUPPORT) == (15, 18, 3)


def test_what_saw_it_long_ago_does_not_count_and_what_saw_it_lately_does() -> None:
    long_ago = np.arange(1000)
    assert is_withdrawn(np.arange(2000, 2015), long_ago)
    assert is_withdrawn(np.arange(2000, 2020), long_ago)
    assert not is_withdrawn(np.arange(2000, 2014), long_ago)
    lately = np.append(long_ago, [2030, 2031, 2032, 2033])
    assert not is_withdrawn(np.arange(2000, 2015), lately)
    assert is_withdrawn(np.arange(2000, 2015), lately[:-1])


def test_fewer_views_than_eighteen_withdraw_nothing() -> None:
    assert not is_withdrawn(np.arange(10, 10 + 16), stamps(1))
    assert is_withdrawn(np.arange(10, 10 + 17), stamps(1))


def test_misses_before_the_flight_was_seen_do_not_count_against_it() -> None:
    assert not is_withdrawn(np.arange(15), np.arange(100, 104))
    assert is_withdrawn(np.arange(15), np.arange(100, 103))


def test_a_frame_that_sees_and_misses_it_has_seen_it_last() -> None:
    # Eighteen misses at stamps 0 to 17; four views at the stamps of the first four of the last eighteen.
    assert not is_withdrawn(np.arange(18), stamps(14, 15, 16, 17))
    assert is_withdrawn(np.arange(18), stamps(0, 1, 2, 3))
    # The eighteenth view from the end is one of two of the same frame, at stamp 0.
    assert not is_withdrawn(np.arange(15), stamps(0, 20, 21, 22))
    assert is_withdrawn(np.arange(15), stamps(-1, 20, 21, 22))


# In the map


POSES = poses_before(FLIGHT, 60)


def modelled(num: int = 12) -> StairwayMapper:
    """A mapper that saw the flight from the first poses."""
    return mapper_of(observe_all(FLIGHT, POSES[:num]))


def miss(mapper: StairwayMapper, first: int, num: int, poses: list[Transform] = POSES) -> None:
    for index in range(first, first + num):
        mapper.add_look(look_from(poses[index], index * 100 * MS))


def test_a_stairway_that_looks_miss_is_withdrawn_and_comes_back_under_its_id_when_it_is_seen_again() -> None:
    mapper, trajectory = modelled(), trajectory_of(POSES)
    other = make_flight(base=np.array([-20.0, 0.0, 0.0]))
    for observation in observe_all(other, poses_before(other, 12), first_stamp=48):
        mapper.add(observation)
    poses = [*POSES[:48], *poses_before(other, 12)]
    trajectory = trajectory_of(poses)
    assert [item.id for item in mapper.stairways(trajectory)] == [1, 2]
    miss(mapper, 12, NUM_MISSES - 1, poses)
    assert [item.id for item in mapper.stairways(trajectory)] == [1, 2]
    miss(mapper, 12 + NUM_MISSES - 1, 1, poses)
    assert [item.id for item in mapper.stairways(trajectory)] == [2]
    for index in range(30, 33):
        mapper.add(observe(FLIGHT, poses[index], index * 100 * MS))
        assert [item.id for item in mapper.stairways(trajectory)] == [2]
    mapper.add(observe(FLIGHT, poses[33], 33 * 100 * MS))
    found = mapper.stairways(trajectory)
    assert [item.id for item in found] == [1, 2]
    assert found[0].num_observations == 16


def test_looks_that_see_the_flight_keep_it_though_no_detector_does() -> None:
    mapper = modelled()
    for index in range(12, 52):
        num_on = 0 if index % 4 else 80
        mapper.add_look(look_from(POSES[index], index * 100 * MS, num_on=num_on))
    assert len(mapper.stairways(trajectory_of(POSES))) == 1


def test_looks_that_tell_nothing_are_not_kept() -> None:
    mapper = modelled()
    for index in range(12, 52):
        mapper.add_look(look_from(POSES[index], index * 100 * MS, num_on=20, num_through=80))
        mapper.add_look(look_from(POSES[index], index * 100 * MS, num_through=39))
    assert len(mapper.state().looks) == 0
    assert len(mapper.stairways(trajectory_of(POSES))) == 1


def test_looks_without_a_pose_do_not_count_until_they_have_one() -> None:
    mapper = modelled()
    miss(mapper, 20, 20)
    assert len(mapper.stairways(trajectory_of(POSES[:30]))) == 1
    assert mapper.stairways(trajectory_of(POSES)) == ()
    assert len(mapper.stairways(trajectory_of(POSES[:30]))) == 1


def test_looks_that_a_loop_closure_moves_away_do_not_count_any_more() -> None:
    mapper = modelled()
    miss(mapper, 20, 20)
    assert mapper.stairways(trajectory_of(POSES)) == ()
    # The poses had drifted by 1 m when the looks were taken: they looked beside the stairs.
    correction = turned_map(0.0, (0.0, 1.0, 0.0))
    closed = trajectory_of([*POSES[:15], *(correction @ pose for pose in POSES[15:])])
    stairway = the_only(mapper.stairways(closed))
    assert stairway.num_observations == 12
    assert mapper.stairways(trajectory_of(POSES)) == ()


def test_a_loop_closure_that_moves_all_keeps_what_looks_said() -> None:
    mapper = modelled()
    miss(mapper, 20, 20)
    correction = turned_map(0.7, (3.0, 1.0, 0.2))
    assert mapper.stairways(trajectory_of([correction @ pose for pose in POSES])) == ()


def test_looks_at_one_flight_do_not_count_against_another() -> None:
    beside = make_flight(base=FLIGHT.base + FLIGHT.map_from_flight[:3, 1] * 1.5, heading=0.4)
    mapper = modelled()
    for observation in observe_all(beside, POSES[:12]):
        mapper.add(observation)
    miss(mapper, 20, 20)
    stairway = the_only(mapper.stairways(trajectory_of(POSES)))
    np.testing.assert_allclose(stairway.flights[0].base, beside.base, atol=0.01)


def test_a_restored_mapper_keeps_the_looks() -> None:
    mapper = modelled()
    miss(mapper, 20, NUM_MISSES - 1)
    restored = StairwayMapper(Config())
    restored.restore(mapper.state())
    assert len(restored.stairways(trajectory_of(POSES))) == 1
    miss(restored, 40, 1)
    assert restored.stairways(trajectory_of(POSES)) == ()
    assert len(restored.state().looks) == NUM_MISSES
    assert len(mapper.stairways(trajectory_of(POSES))) == 1


def test_looks_of_another_version_are_refused() -> None:
    state = replace(modelled().state(), looks=np.zeros(2, dtype=[("stamp_ns", np.int64)]))
    with pytest.raises(ValueError, match="looks have the fields"):
        StairwayMapper(Config()).restore(state)


def test_looks_in_any_order_give_the_same() -> None:
    forward, backward = modelled(), modelled()
    miss(forward, 20, 20)
    for index in reversed(range(20, 40)):
        backward.add_look(look_from(POSES[index], index * 100 * MS))
    trajectory = trajectory_of(POSES)
    assert forward.stairways(trajectory) == backward.stairways(trajectory) == ()


def test_the_table_keeps_looks_through_its_growth() -> None:
    table = LookTable()
    for index in range(200):
        table.add(look_from(POSES[index % 60], index))
    np.testing.assert_array_equal(table.records["stamp_ns"], np.arange(200))
    trajectory = Trajectory(stamps_ns=np.arange(200), map_from_camera=np.array(POSES)[np.arange(200) % 60])
    table.place(np.arange(200), trajectory.map_from_camera)
    np.testing.assert_allclose(
        table.middle[:200], np.tile(FLIGHT.edges().mean(axis=(0, 1)), (200, 1)), atol=1e-9
    )
