"""Observations and a trajectory become stairways: the right number, in the right place, with lasting ids."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ideal_observations import (
    MS,
    assert_is_flight,
    make_flight,
    mapper_of,
    moved_flight,
    observe,
    observe_all,
    poses_above,
    poses_before,
    the_only,
    trajectory_of,
    turned_map,
)
from stairmap.config import Config
from stairmap.modeling.mapper import StairwayMapper
from stairmap.stairway import Flight

FLIGHT = make_flight()
POSES = poses_before(FLIGHT, 12)
OTHER = make_flight(
    base=np.array([-6.0, 1.0, 0.0]), heading=np.pi, rise=0.19, run=0.25, width=0.95, num_risers=9
)


def test_a_flight_seen_in_some_frames_is_modelled_as_it_is() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES))
    stairway = the_only(mapper.stairways(trajectory_of(POSES)))
    assert_is_flight(stairway.flights[0], FLIGHT)
    assert stairway.num_observations == 12
    assert (stairway.first_seen_ns, stairway.last_seen_ns) == (0, 1100 * MS)
    assert stairway.landings == ()
    assert stairway.flights[0].left_bounded
    assert stairway.flights[0].right_bounded


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    rise=st.floats(0.10, 0.25),
    run=st.floats(0.20, 0.40),
    width=st.floats(0.6, 3.0),
    num_risers=st.integers(3, 20),
    heading=st.floats(-np.pi, np.pi),
    x=st.floats(-50, 50),
    y=st.floats(-50, 50),
    z=st.floats(-10, 10),
)
def test_any_flight_at_any_place_and_heading_is_recovered(
    rise: float, run: float, width: float, num_risers: int, heading: float, x: float, y: float, z: float
) -> None:
    assume(15 <= np.degrees(np.arctan2(rise, run)) <= 50)
    flight = make_flight(
        base=np.array([x, y, z]), heading=heading, rise=rise, run=run, width=width, num_risers=num_risers
    )
    poses = poses_before(flight, 4)
    stairway = the_only(mapper_of(observe_all(flight, poses)).stairways(trajectory_of(poses)))
    assert_is_flight(stairway.flights[0], flight)


def test_noise_of_single_frames_averages_out() -> None:
    poses = poses_before(FLIGHT, 40)
    stairway = the_only(mapper_of(observe_all(FLIGHT, poses, noise=0.015)).stairways(trajectory_of(poses)))
    assert_is_flight(stairway.flights[0], FLIGHT, place=0.02, step=0.0015)


def test_errors_of_poses_do_not_touch_rise_and_run() -> None:
    random = np.random.default_rng(3)
    shaken = [pose.copy() for pose in POSES]
    for pose in shaken:
        pose[:3, 3] += random.normal(0, 0.05, 3)
    stairway = the_only(mapper_of(observe_all(FLIGHT, POSES)).stairways(trajectory_of(shaken)))
    flight = stairway.flights[0]
    assert (flight.rise, flight.run) == pytest.approx((FLIGHT.rise, FLIGHT.run), abs=1e-6)
    assert np.abs(flight.base - FLIGHT.base).max() < 0.06
    assert flight.num_risers == FLIGHT.num_risers


@pytest.mark.parametrize("num", [0, 1, 2])
def test_fewer_than_min_observations_give_none(num: int) -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES[:num]))
    assert mapper.stairways(trajectory_of(POSES)) == ()


@pytest.mark.parametrize("needed", [1, 5])
def test_min_observations_is_the_configurations(needed: int) -> None:
    config = Config.model_validate({"modeling": {"min_observations": needed}})
    poses = POSES if needed > 1 else POSES * 1
    mapper = StairwayMapper(config)
    for count, observation in enumerate(observe_all(FLIGHT, poses), start=1):
        mapper.add(observation)
        # Each step must have been seen twice, whatever the limit.
        expected = count >= max(needed, 2)
        assert (len(mapper.stairways(trajectory_of(poses))) == 1) == expected


@pytest.mark.parametrize(("num_risers", "num_found"), [(2, 0), (3, 1)])
def test_three_steps_make_a_stairway_and_two_do_not(num_risers: int, num_found: int) -> None:
    mapper = mapper_of(observe_all(make_flight(num_risers=num_risers), POSES))
    assert len(mapper.stairways(trajectory_of(POSES))) == num_found


@pytest.mark.parametrize(("num_sure", "num_found"), [(2, 0), (3, 1)])
def test_three_observations_that_measured_their_rise_well_confirm_a_stairway(
    num_sure: int, num_found: int
) -> None:
    observations = observe_all(FLIGHT, POSES)
    for observation in observations[num_sure:]:
        covariance = observation.covariance.copy()
        covariance[0, 0] = 0.0066**2
        object.__setattr__(observation, "covariance", covariance)
    assert len(mapper_of(observations).stairways(trajectory_of(POSES))) == num_found


@pytest.mark.parametrize(("num_off", "num_found"), [(5, 1), (6, 0)])
def test_more_than_half_of_the_observations_must_agree(num_off: int, num_found: int) -> None:
    # 55 % of twelve: seven.
    observations = observe_all(FLIGHT, POSES)
    for index in range(num_off):
        error = 0.02 if index % 2 else -0.02
        object.__setattr__(observations[index], "run", observations[index].run + error)
    assert len(mapper_of(observations).stairways(trajectory_of(POSES))) == num_found


@pytest.mark.parametrize("poor_comes_first", [True, False])
def test_of_two_flights_in_one_place_seen_as_often_the_one_with_the_better_view_stays(
    poor_comes_first: bool,
) -> None:
    good = observe_all(FLIGHT, POSES[:4], first_stamp=4 if poor_comes_first else 0)
    poor = observe_all(
        make_flight(rise=0.22), POSES[4:8], first_stamp=0 if poor_comes_first else 4, steps=range(5)
    )
    poses = [*POSES[4:8], *POSES[:4]] if poor_comes_first else POSES[:8]
    mapper = mapper_of(poor + good if poor_comes_first else good + poor)
    assert the_only(mapper.stairways(trajectory_of(poses))).flights[0].rise == pytest.approx(0.17, abs=1e-6)


def test_observations_without_a_pose_are_left_out() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES))
    assert the_only(mapper.stairways(trajectory_of(POSES[:5]))).num_observations == 5
    assert mapper.stairways(trajectory_of(POSES[:2])) == ()


def test_observations_without_edges_are_not_taken_in() -> None:
    empty = observe(FLIGHT, POSES[0], 0)
    object.__setattr__(empty, "edges", ())
    mapper = mapper_of([empty] * 5)
    assert mapper.stairways(trajectory_of(POSES)) == ()


# Several stairways


def test_two_stairways_in_one_map_stay_two() -> None:
    poses = [*POSES, *poses_before(OTHER, 8)]
    mapper = mapper_of(observe_all(FLIGHT, POSES))
    for observation in observe_all(OTHER, poses[12:], first_stamp=12):
        mapper.add(observation)
    first, second = mapper.stairways(trajectory_of(poses))
    assert_is_flight(first.flights[0], FLIGHT)
    assert_is_flight(second.flights[0], OTHER)
    assert (first.num_observations, second.num_observations) == (12, 8)


def test_ids_stay_the_same_from_one_query_to_the_next() -> None:
    poses = [*POSES, *poses_before(OTHER, 8), *poses_before(FLIGHT, 30, distance=1.5)]
    trajectory = trajectory_of(poses)
    mapper = mapper_of(observe_all(FLIGHT, poses[:12]))
    (before,) = mapper.stairways(trajectory)
    for observation in observe_all(OTHER, poses[12:20], first_stamp=12):
        mapper.add(observation)
    first, second = mapper.stairways(trajectory)
    for observation in observe_all(FLIGHT, poses[20:], first_stamp=20):
        mapper.add(observation)
    again_first, again_second = mapper.stairways(trajectory)
    assert before.id == first.id == again_first.id == 1
    assert second.id == again_second.id == 2
    assert again_first.num_observations == 42


def test_ids_follow_the_stairway_that_was_seen_more_later() -> None:
    # Far more observations of the second stairway must not swap the ids.
    poses = [*POSES, *poses_before(OTHER, 40)]
    trajectory = trajectory_of(poses)
    mapper = mapper_of(observe_all(FLIGHT, POSES))
    first_id = the_only(mapper.stairways(trajectory)).id
    for observation in observe_all(OTHER, poses[12:], first_stamp=12):
        mapper.add(observation)
        for stairway in mapper.stairways(trajectory):
            is_first = stairway.flights[0].rise < 0.18
            assert (stairway.id == first_id) == is_first


def test_equal_flights_side_by_side_stay_two() -> None:
    beside = make_flight(base=np.array([2.0, 1.8, 0.0]))
    poses = POSES
    observations = observe_all(FLIGHT, poses) + observe_all(beside, poses)
    stairways = mapper_of(observations).stairways(trajectory_of(poses))
    assert len(stairways) == 2
    assert {round(float(stairway.flights[0].base[1]), 2) for stairway in stairways} == {0.0, 1.8}


def test_the_same_flight_one_storey_higher_is_another() -> None:
    above = make_flight(base=np.array([2.0, 0.0, 3.0]))
    poses = [*POSES, *poses_before(above, 12)]
    observations = observe_all(FLIGHT, POSES) + observe_all(above, poses[12:], first_stamp=12)
    assert len(mapper_of(observations).stairways(trajectory_of(poses))) == 2


def test_a_flight_split_by_an_occlusion_is_one() -> None:
    observations = [
        observe(FLIGHT, pose, index * 100 * MS, steps=range(4) if index % 2 else range(5, 8))
        for index, pose in enumerate(POSES)
    ]
    stairway = the_only(mapper_of(observations).stairways(trajectory_of(POSES)))
    assert stairway.num_risers == 8


# From below and from above


def test_seen_from_below_and_from_above_it_is_one_with_its_base_at_the_bottom() -> None:
    below, above = POSES[:8], poses_above(FLIGHT, 8)
    poses = [*below, *above]
    observations = observe_all(FLIGHT, below, steps=range(6)) + observe_all(
        FLIGHT, above, first_stamp=8, steps=range(3, 8), view="descending"
    )
    stairway = the_only(mapper_of(observations).stairways(trajectory_of(poses)))
    assert stairway.num_observations == 16
    assert_is_flight(stairway.flights[0], FLIGHT)


def test_seen_only_from_above_its_base_is_at_the_bottom_and_it_heads_up() -> None:
    poses = poses_above(FLIGHT, 6)
    observations = observe_all(FLIGHT, poses, view="descending")
    assert_is_flight(the_only(mapper_of(observations).stairways(trajectory_of(poses))).flights[0], FLIGHT)


# Which steps were seen


@pytest.mark.parametrize("missed", [[3], [2, 5], [1, 2]])
def test_a_flight_with_missed_steps_keeps_its_count(missed: list[int]) -> None:
    steps = [step for step in range(8) if step not in missed]
    stairway = the_only(mapper_of(observe_all(FLIGHT, POSES, steps=steps)).stairways(trajectory_of(POSES)))
    assert_is_flight(stairway.flights[0], FLIGHT)
    counts = [step.num_observations for step in stairway.flights[0].steps]
    assert counts == [0 if step in missed else 12 for step in range(8)]


def test_a_step_that_only_some_frames_missed_is_there() -> None:
    observations = [
        observe(FLIGHT, pose, index * 100 * MS, steps=[k for k in range(8) if k != 1 + index % 6])
        for index, pose in enumerate(POSES)
    ]
    stairway = the_only(mapper_of(observations).stairways(trajectory_of(POSES)))
    assert_is_flight(stairway.flights[0], FLIGHT)


def test_frames_that_show_different_steps_add_up_to_the_whole_flight() -> None:
    observations = [
        observe(FLIGHT, pose, index * 100 * MS, steps=range(index // 3, index // 3 + 5))
        for index, pose in enumerate(POSES)
    ]
    stairway = the_only(mapper_of(observations).stairways(trajectory_of(POSES)))
    assert_is_flight(stairway.flights[0], FLIGHT)


def test_a_step_that_one_frame_invented_is_not_counted() -> None:
    longer = make_flight(num_risers=9)
    observations = observe_all(FLIGHT, POSES)
    observations.append(observe(longer, POSES[-1], 1100 * MS + MS))
    poses = trajectory_of([*POSES, POSES[-1]])
    assert the_only(mapper_of(observations).stairways(poses)).num_risers == 8


def test_the_floor_ends_the_steps_below_and_the_landing_those_above() -> None:
    # A mat before the first riser and a sill on the landing, seen as steps in a quarter of the frames.
    longer = make_flight(base=FLIGHT.base - [0.28, 0.0, 0.17], num_risers=10)
    observations = [
        observe(longer, pose, index * 100 * MS)
        if index % 4 == 0
        else observe(FLIGHT, pose, index * 100 * MS, floor_seen=True, top_seen=True)
        for index, pose in enumerate(POSES)
    ]
    assert_is_flight(the_only(mapper_of(observations).stairways(trajectory_of(POSES))).flights[0], FLIGHT)


def test_where_only_upper_steps_were_seen_base_is_one_rise_below_the_lowest_of_them() -> None:
    # What is hidden below is not invented: num_risers counts from the lowest step seen.
    stairway = the_only(
        mapper_of(observe_all(FLIGHT, POSES, steps=range(3, 8))).stairways(trajectory_of(POSES))
    )
    flight = stairway.flights[0]
    assert flight.num_risers == 5
    np.testing.assert_allclose(flight.base, FLIGHT.base + np.array([3 * 0.28, 0.0, 3 * 0.17]), atol=0.002)


def test_sides_that_no_frame_saw_are_not_bounded() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES, bounded=False))
    flight = the_only(mapper.stairways(trajectory_of(POSES))).flights[0]
    assert not flight.left_bounded
    assert not flight.right_bounded
    assert flight.width == pytest.approx(1.2, abs=0.005)


def test_later_observations_that_disagree_withdraw_a_stairway() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES[:5]))
    assert len(mapper.stairways(trajectory_of(POSES))) == 1
    for place, pose in enumerate(POSES[5:], start=5):
        # As views of a spiral do: each sees other steps, none those of the one before.
        error = 0.020 if place % 2 else -0.020
        seen = observe(FLIGHT, pose, place * 100 * MS)
        mapper.add(replace(seen, rise=seen.rise + error, run=seen.run - error))
    assert mapper.stairways(trajectory_of(POSES)) == ()


# Trajectories that change


@pytest.mark.parametrize("drift", [(0.12, 0.0, 0.0), (0.0, 0.18, 0.0), (0.08, -0.1, 0.06), (0.0, 0.0, 0.15)])
def test_duplicates_from_a_drift_below_20_cm_merge(drift: tuple[float, float, float]) -> None:
    poses = [*POSES, *POSES]
    observations = observe_all(FLIGHT, POSES) + observe_all(FLIGHT, POSES, first_stamp=12)
    drifted = [*POSES, *(turned_map(0.0, drift) @ pose for pose in POSES)]
    stairway = the_only(mapper_of(observations).stairways(trajectory_of(drifted)))
    assert stairway.num_observations == len(poses)
    flight = stairway.flights[0]
    assert (flight.rise, flight.run) == pytest.approx((0.17, 0.28), abs=0.001)
    assert np.linalg.norm(flight.base - FLIGHT.base) < 0.2
    assert 8 <= flight.num_risers <= 9


@pytest.mark.parametrize("turn_deg", [0.0, 5.0])
def test_a_loop_closure_merges_what_drift_had_torn_apart(turn_deg: float) -> None:
    observations = observe_all(FLIGHT, POSES) + observe_all(FLIGHT, POSES, first_stamp=12)
    mapper = mapper_of(observations)
    torn = [*POSES, *(turned_map(np.radians(turn_deg), (0.3, 2.5, 0.0)) @ pose for pose in POSES)]
    first, second = mapper.stairways(trajectory_of(torn))
    assert (first.id, second.id) == (1, 2)
    closed = trajectory_of([*POSES, *POSES])
    stairway = the_only(mapper.stairways(closed))
    assert_is_flight(stairway.flights[0], FLIGHT)
    assert stairway.id in {1, 2}
    assert stairway.num_observations == 24
    # And the other way round: a closure that proves to be wrong is undone, without a third id.
    ids = {item.id for item in mapper.stairways(trajectory_of(torn))}
    assert len(ids) == 2 and ids <= {1, 2, 3}


def test_a_loop_closure_that_moves_the_second_half_moves_the_stairway_seen_in_it() -> None:
    poses = [*POSES, *poses_before(OTHER, 8)]
    mapper = mapper_of(observe_all(FLIGHT, POSES) + observe_all(OTHER, poses[12:], first_stamp=12))
    before = mapper.stairways(trajectory_of(poses))
    correction = turned_map(0.1, (0.4, -0.3, 0.05))
    closed = [*POSES, *(correction @ pose for pose in poses[12:])]
    first, second = mapper.stairways(trajectory_of(closed))
    assert [first.id, second.id] == [item.id for item in before]
    assert_is_flight(first.flights[0], FLIGHT)
    assert_is_flight(second.flights[0], moved_flight(correction, OTHER))


@settings(max_examples=20, deadline=None, derandomize=True)
@given(yaw=st.floats(-np.pi, np.pi), x=st.floats(-100, 100), y=st.floats(-100, 100), z=st.floats(-20, 20))
def test_moving_the_whole_trajectory_moves_the_stairways_likewise(
    yaw: float, x: float, y: float, z: float
) -> None:
    other_from_map = turned_map(yaw, (x, y, z))
    mapper = mapper_of(observe_all(FLIGHT, POSES, noise=0.01, steps=[0, 1, 2, 4, 5, 6, 7]))
    here = the_only(mapper.stairways(trajectory_of(POSES))).flights[0]
    there = the_only(mapper.stairways(trajectory_of([other_from_map @ pose for pose in POSES]))).flights[0]
    moved = moved_flight(other_from_map, here)
    np.testing.assert_allclose(there.base, moved.base, atol=1e-5)
    assert abs((there.heading - moved.heading + np.pi) % (2 * np.pi) - np.pi) < 1e-6
    for name in ("rise", "run", "width", "num_risers"):
        assert getattr(there, name) == pytest.approx(getattr(here, name), abs=1e-6)
    for name in ("rise", "run", "width", "pitch", "heading"):
        assert getattr(there.std, name) == pytest.approx(getattr(here.std, name), rel=1e-3, abs=1e-9)


def test_a_trajectory_with_poses_between_the_frames_gives_the_same_stairways() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES))
    coarse = trajectory_of(POSES)
    stamps = np.arange(0, 1101, 10) * MS
    dense = type(coarse)(stamps_ns=stamps, map_from_camera=coarse.poses_at(stamps))
    here, there = the_only(mapper.stairways(coarse)), the_only(mapper.stairways(dense))
    np.testing.assert_allclose(there.flights[0].base, here.flights[0].base, atol=1e-9)


# Order, cost, repetition


def flat(flight: Flight) -> list[float]:
    return [*flight.base, flight.heading, flight.rise, flight.run, flight.width, flight.num_risers]


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.permutations(range(20)))
def test_observations_in_any_order_give_the_same_stairways(order: list[int]) -> None:
    poses = [*POSES, *poses_before(OTHER, 8)]
    observations = observe_all(FLIGHT, POSES, noise=0.01) + observe_all(
        OTHER, poses[12:], first_stamp=12, noise=0.01
    )
    trajectory = trajectory_of(poses)
    expected = mapper_of(observations).stairways(trajectory)
    found = mapper_of(observations[index] for index in order).stairways(trajectory)
    assert len(found) == len(expected)
    for one in expected:
        nearest = min(found, key=lambda item: np.linalg.norm(item.flights[0].base - one.flights[0].base))
        assert flat(nearest.flights[0]) == pytest.approx(flat(one.flights[0]), abs=1e-6)
        assert nearest.num_observations == one.num_observations
        assert (nearest.first_seen_ns, nearest.last_seen_ns) == (one.first_seen_ns, one.last_seen_ns)


def test_the_same_input_twice_gives_the_same_json_bit_for_bit() -> None:
    def text() -> str:
        poses = [*POSES, *poses_before(OTHER, 8)]
        mapper = mapper_of(
            observe_all(FLIGHT, POSES, noise=0.01)
            + observe_all(OTHER, poses[12:], first_stamp=12, noise=0.01)
        )
        return json.dumps([stairway.to_dict() for stairway in mapper.stairways(trajectory_of(poses))])

    assert text() == text()


def test_asking_twice_changes_nothing() -> None:
    mapper = mapper_of(observe_all(FLIGHT, POSES, noise=0.01))
    trajectory = trajectory_of(POSES)
    first, second = mapper.stairways(trajectory), mapper.stairways(trajectory)
    assert json.dumps([item.to_dict() for item in first]) == json.dumps([item.to_dict() for item in second])


def test_a_mapper_without_observations_has_no_stairways() -> None:
    assert StairwayMapper(Config()).stairways(trajectory_of(POSES)) == ()


def test_a_restored_mapper_goes_on_with_the_same_stairways_and_ids() -> None:
    first = mapper_of(observe_all(FLIGHT, POSES))
    seen = first.stairways(trajectory_of(POSES))
    second = StairwayMapper(Config())
    second.restore(first.state())
    assert second.stairways(trajectory_of(POSES)) is not seen
    assert [s.to_dict() for s in second.stairways(trajectory_of(POSES))] == [s.to_dict() for s in seen]
    poses = np.concatenate([POSES, poses_before(OTHER, 12)])
    for observation in observe_all(OTHER, poses[12:], first_stamp=12):
        second.add(observation)
    found = second.stairways(trajectory_of(poses))
    assert [stairway.id for stairway in found] == [1, 2]
    assert_is_flight(found[1].flights[0], OTHER)


def test_a_state_of_another_version_is_refused() -> None:
    state = mapper_of(observe_all(FLIGHT, POSES)).state()
    records = np.zeros(12, dtype=[("stamp_ns", np.int64)])
    with pytest.raises(ValueError, match="observations have the fields"):
        StairwayMapper(Config()).restore(replace(state, observations=records))
    with pytest.raises(ValueError, match="belongs to none of the 5 observations"):
        StairwayMapper(Config()).restore(
            replace(state, observations=state.observations[:5], ids=state.ids[:5])
        )
