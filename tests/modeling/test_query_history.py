"""What was asked before changes what a query costs, and nothing that it says but ids."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ideal_observations import (
    MS,
    make_flight,
    mapper_of,
    observe,
    poses_before,
    trajectory_of,
    turned_map,
)
from stairmap.arrays import Transform
from stairmap.config import load_config
from stairmap.detection.observation import StairObservation
from stairmap.modeling import flight_groups
from stairmap.modeling.looks import Look
from stairmap.modeling.mapper import StairwayMapper
from stairmap.stairway import Stairway
from stairmap.transforms import invert_transform, transform_points

DRIFTING = load_config(None, ["modeling.pose_drift=0.01", "modeling.pose_heading_drift_deg=0.3"])

FLIGHTS = [
    make_flight(),
    make_flight(base=np.array([2.0, 1.5, 0.0])),  # beside the first
    make_flight(base=np.array([2.0 + 7 * 0.28 + 1.0, 0.0, 8 * 0.17])),  # behind its landing
    make_flight(base=np.array([-20.0, 3.0, 0.0]), heading=2.0, rise=0.19, run=0.25),
    make_flight(base=np.array([-20.0, 9.0, 0.0]), heading=-2.0, rise=0.15, run=0.30),
]


def drive(seed: int, num: int) -> tuple[list[StairObservation], list[Transform]]:
    """Random views of the flights, a few steps each, with noise; some are of steps measured badly."""
    random = np.random.default_rng(seed)
    observations, poses = [], []
    for index in range(num):
        flight = FLIGHTS[random.integers(len(FLIGHTS))]
        pose = poses_before(flight, 12)[random.integers(12)]
        first = int(random.integers(0, 5))
        seen = make_flight(
            base=flight.base, heading=flight.heading, run=flight.run,
            rise=flight.rise + (0.05 if random.random() < 0.1 else 0.0),
        )  # fmt: skip
        steps = range(first, min(first + int(random.integers(2, 6)), 8))
        observations.append(
            observe(
                seen, pose, index * 100 * MS, steps=steps, noise=0.01,
                floor_seen=first == 0 and bool(random.random() < 0.7), top_seen=bool(random.random() < 0.1),
            )
        )  # fmt: skip
        poses.append(pose)
    return observations, poses


def look_from(pose: Transform, stamp_ns: int, flight: Any, *, is_absent: bool) -> Look:
    """A look at a flight from a pose."""
    camera_from_map = invert_transform(pose)
    return Look(
        stamp_ns=stamp_ns,
        middle=transform_points(camera_from_map, flight.edges().mean(axis=(0, 1))),
        forward=camera_from_map[:3, :3] @ flight.forward,
        num_on=0 if is_absent else 90,
        num_hidden=0,
        num_through=90 if is_absent else 0,
        num_unmeasured=0,
    )


def without_ids(stairways: tuple[Stairway, ...]) -> list[dict[str, Any]]:
    values = [{**stairway.to_dict(), "id": 0} for stairway in stairways]
    return sorted(values, key=lambda value: value["flights"][0]["base"])


def exactly(stairways: tuple[Stairway, ...]) -> Iterator[list[float]]:
    """Every number of the flights, unrounded."""
    for stairway in sorted(stairways, key=lambda item: tuple(item.flights[0].base)):
        for flight in stairway.flights:
            yield [
                *flight.base, flight.heading, flight.rise, flight.run, flight.width, flight.overhang,
                flight.std.rise, flight.std.run, flight.std.width, *flight.std.base, flight.std.heading,
                *(value for step in flight.steps for value in (*step.nosing.ravel(), *step.std)),
            ]  # fmt: skip


def assert_same(one: tuple[Stairway, ...], other: tuple[Stairway, ...]) -> None:
    assert without_ids(one) == without_ids(other)
    for first, second in zip(exactly(one), exactly(other), strict=True):
        np.testing.assert_array_equal(first, second)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    asked=st.lists(st.integers(1, 60), max_size=12),
    closes=st.lists(st.integers(1, 59), max_size=3),
    has_drift=st.booleans(),
)
def test_the_answer_is_that_of_a_mapper_that_was_never_asked(
    seed: int, asked: list[int], closes: list[int], has_drift: bool
) -> None:
    observations, poses = drive(seed, 60)
    config = DRIFTING if has_drift else None
    asked_mapper = mapper_of([], config)
    so_far: list[Transform] = []
    for index, (observation, pose) in enumerate(zip(observations, poses, strict=True), start=1):
        so_far.append(pose)
        if index in closes:
            correction = turned_map(0.05, (0.1, -0.2, 0.03))
            so_far = [*so_far[: index // 2], *(correction @ other for other in so_far[index // 2 :])]
        asked_mapper.add(observation)
        asked_mapper.add_look(look_from(so_far[-1], index, FLIGHTS[index % 5], is_absent=index % 3 > 0))
        if index in asked:
            fresh = StairwayMapper(config) if config else mapper_of([])
            fresh.restore(asked_mapper.state())
            assert_same(asked_mapper.stairways(trajectory_of(so_far)), fresh.stairways(trajectory_of(so_far)))
    fresh = mapper_of(observations, config)
    for index in range(1, 61):
        fresh.add_look(look_from(so_far[index - 1], index, FLIGHTS[index % 5], is_absent=index % 3 > 0))
    trajectory = trajectory_of(so_far)
    if not closes:
        assert_same(asked_mapper.stairways(trajectory), fresh.stairways(trajectory))


def test_a_trajectory_that_loses_poses_and_gets_them_again_gives_the_same() -> None:
    observations, poses = drive(7, 50)
    mapper = mapper_of(observations)
    whole, part = trajectory_of(poses), trajectory_of(poses[:30])
    first = mapper.stairways(whole)
    assert_same(mapper.stairways(part), mapper_of(observations).stairways(part))
    assert_same(mapper.stairways(whole), first)
    assert [item.id for item in mapper.stairways(whole)] == [item.id for item in first]


def test_a_pose_between_others_that_comes_late_counts() -> None:
    observations, poses = drive(3, 40)
    mapper = mapper_of(observations)
    late = trajectory_of(poses)
    keep = np.arange(40) % 3 != 1
    early = type(late)(stamps_ns=late.stamps_ns[keep], map_from_camera=late.map_from_camera[keep])
    mapper.stairways(early)
    assert_same(mapper.stairways(late), mapper_of(observations).stairways(late))


def test_a_way_that_changed_before_the_stairs_were_seen_changes_how_sure_their_place_is() -> None:
    observations, poses = drive(3, 40)
    late = [index for index in range(40) if index >= 5]
    mapper = mapper_of([observations[index] for index in late], DRIFTING)
    here = trajectory_of(poses)
    detour = trajectory_of([turned_map(0.0, (0.0, 0.0, 100.0)) @ poses[0], *poses[1:]])
    first = mapper.stairways(here)
    found = mapper.stairways(detour)
    assert found[0].flights[0].std.base[2] > first[0].flights[0].std.base[2] + 0.1
    assert_same(found, mapper_of([observations[index] for index in late], DRIFTING).stairways(detour))


class Counter:
    """Counts the calls of a function that it stands in for."""

    def __init__(self, function: Any) -> None:
        self.function, self.sizes = function, []

    def __call__(self, *arguments: Any) -> Any:
        self.sizes.append(len(arguments[-1]))
        return self.function(*arguments)


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Counter:
    counter = Counter(flight_groups.fit_flight)
    monkeypatch.setattr(flight_groups, "fit_flight", counter)
    return counter


@pytest.fixture
def groupings(monkeypatch: pytest.MonkeyPatch) -> Counter:
    counter = Counter(flight_groups.find_groups)
    monkeypatch.setattr(flight_groups, "find_groups", counter)
    return counter


def far_apart(num: int) -> tuple[list[StairObservation], list[Transform]]:
    """Six views each of flights 12 m apart."""
    observations, poses = [], []
    for index in range(num):
        flight = make_flight(base=np.array([12.0 * index, 0.0, 0.0]), heading=0.3 * index)
        for pose in poses_before(flight, 6):
            observations.append(observe(flight, pose, len(poses) * 100 * MS))
            poses.append(pose)
    return observations, poses


def test_a_query_with_nothing_new_fits_and_groups_nothing(fits: Counter, groupings: Counter) -> None:
    observations, poses = far_apart(5)
    mapper = mapper_of(observations)
    first = mapper.stairways(trajectory_of(poses))
    assert (len(first), len(fits.sizes), len(groupings.sizes)) == (5, 5, 1)
    assert mapper.stairways(trajectory_of(poses)) is first
    assert (len(fits.sizes), len(groupings.sizes)) == (5, 1)


def test_a_new_pose_without_an_observation_fits_nothing(fits: Counter) -> None:
    observations, poses = far_apart(3)
    mapper = mapper_of(observations)
    mapper.stairways(trajectory_of(poses))
    mapper.stairways(trajectory_of([*poses, poses[-1]]))
    assert len(fits.sizes) == 3


def test_a_new_observation_costs_the_fit_of_its_flight_and_groups_its_neighbours_only(
    fits: Counter, groupings: Counter
) -> None:
    observations, poses = far_apart(5)
    mapper = mapper_of(observations)
    mapper.stairways(trajectory_of(poses))
    poses.append(poses[15])
    flight = make_flight(base=np.array([24.0, 0.0, 0.0]), heading=0.6)
    mapper.add(observe(flight, poses[15], 30 * 100 * MS))
    mapper.stairways(trajectory_of(poses))
    assert fits.sizes[5:] == [7]
    assert groupings.sizes[1:] == [7]


def test_poses_that_moved_cost_the_flights_that_were_seen_from_them(fits: Counter) -> None:
    observations, poses = far_apart(6)
    mapper = mapper_of(observations)
    mapper.stairways(trajectory_of(poses))
    moved = [
        turned_map(0.01, (0.1, 0.0, 0.0)) @ pose if 6 <= i < 12 else pose for i, pose in enumerate(poses)
    ]
    stairways = mapper.stairways(trajectory_of(moved))
    assert fits.sizes[6:] == [6]
    assert_same(stairways, mapper_of(observations).stairways(trajectory_of(moved)))
