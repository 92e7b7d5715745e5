from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from site_runs import cut_flight, level_transform, make_flight, see

from stairmap.errors import MergeError
from stairmap.merging.alignment import align_pair, count_floors_between, find_alignment
from stairmap.merging.alignment_file import alignment_text, load_alignment
from stairmap.merging.landmarks import lies_on, may_be_same, step_shifts
from stairmap.merging.merged_map import sightings_of

SITE = [
    make_flight((0, 0, 0), 0.3, rise=0.165, run=0.290),
    make_flight((12, 4, 0), 2.1, rise=0.180, run=0.270, num_risers=8),
    make_flight((-6, 15, 2.8), -1.0, rise=0.150, run=0.310, num_risers=12),
]


def runs_of(*inputs):
    return [sightings_of(number, item.stairways) for number, item in enumerate(inputs)]


def check_close(found, expected, metres=0.15, degrees=1.5):
    assert np.linalg.norm(found[:3, 3] - expected[:3, 3]) < metres
    turn = math.atan2(found[1, 0], found[0, 0]) - math.atan2(expected[1, 0], expected[0, 0])
    assert abs(math.remainder(turn, 2 * math.pi)) < math.radians(degrees)


@settings(max_examples=20, deadline=None)
@given(
    x=st.floats(-50, 50), y=st.floats(-50, 50), z=st.floats(-5, 5), yaw=st.floats(-math.pi, math.pi),
    seed=st.integers(0, 10_000),
)  # fmt: skip
def test_two_runs_that_share_two_stairways_are_aligned_whatever_their_maps(x, y, z, yaw, seed):
    site_from_second = level_transform(x, y, z, yaw)
    first = see(SITE[:2], np.eye(4), seed=seed, name="a")
    second = see(SITE, site_from_second, seed=seed + 1, name="b")
    alignment = find_alignment(runs_of(first, second), ["a", "b"])
    assert alignment.pairs[0].num_common == 2
    # The origin of the second map may be 70 m away, where half a degree is 0.6 m: flights count.
    for flight in second.stairways:
        there = alignment.site_from_run[1] @ np.append(flight.flights[0].base, 1)
        true = site_from_second @ np.append(flight.flights[0].base, 1)
        assert np.linalg.norm(there - true) < 0.3


def test_runs_are_joined_over_others_by_the_surest_pairs_first():
    poses = [np.eye(4), level_transform(5, 1, 0, 1.0), level_transform(-3, 8, 2, -2.0)]
    first = see(SITE[:2], poses[0], seed=1, name="a")
    middle = see(SITE, poses[1], seed=2, name="b")
    last = see(SITE[2:], poses[2], seed=3, name="c")
    alignment = find_alignment(runs_of(first, last, middle), ["a", "c", "b"])
    for found, expected in zip(alignment.site_from_run, (poses[0], poses[2], poses[1]), strict=True):
        check_close(found, expected, metres=0.3)
    assert [pair.num_common for pair in alignment.pairs] == [2, 1]


def test_stairs_that_are_alike_on_every_floor_are_refused_not_guessed():
    storeys = [make_flight((0, 0, 3.4 * level)) for level in range(3)]
    first = see(storeys, np.eye(4), seed=1, name="a")
    second = see(storeys[:1], level_transform(1, 2, 0.5, 0.4), seed=2, name="b")
    assert align_pair(*runs_of(first, second)).num_rivals == 2
    with pytest.raises(MergeError, match="a and b fit each other in 3 ways with 1 common flight each"):
        find_alignment(runs_of(first, second), ["a", "b"])
    # One more stairway tells the floors apart.
    other = make_flight((9, 9, 3.4), 1.0, rise=0.14)
    first = see([*storeys, other], np.eye(4), seed=1, name="a")
    second = see([storeys[1], other], level_transform(1, 2, 0.5, 0.4), seed=2, name="b")
    check_close(
        find_alignment(runs_of(first, second), ["a", "b"]).site_from_run[1], level_transform(1, 2, 0.5, 0.4)
    )


def test_floors_tell_by_how_many_steps_stairs_with_open_ends_are_shifted():
    """Both runs saw the middle of a flight, from floors that a lift joins; its ends are in neither map."""
    flight = make_flight((3, 1, 0.5), num_risers=14)
    site_from_second = level_transform(1, 2, 0.7, 0.4)
    first = runs_of(see([cut_flight(flight, 2, 9)], np.eye(4), seed=1))[0]
    second = runs_of(see([cut_flight(flight, 4, 11)], site_from_second, seed=2))[0]
    assert align_pair(first, second).num_rivals == 10
    assert align_pair(first, second, [0.0, 3.4], [-0.7, 2.7]).num_rivals == 0
    pair = align_pair(first, second, [0.0, 3.4], [-0.72, 2.71, 6.1])
    check_close(pair.first_from_second, site_from_second)


def test_floor_where_the_other_run_was_not_says_nothing():
    """A guess by it would put stairs that are alike on every floor on the wrong one."""
    storeys = [make_flight((0, 0, 3.4 * level)) for level in range(2)]
    first = runs_of(see(storeys, np.eye(4), seed=1))[0]
    second = runs_of(see(storeys[1:], level_transform(1, 2, 0, 0.4), seed=2))[0]
    assert align_pair(first, second, [0.0, 3.4, 6.8], [3.4, 6.8, 10.2]).num_rivals == 1


def test_floors_between_floors_are_counted():
    assert count_floors_between([0.0, 3.0], [0.0, 3.0], 0.05) == 0
    assert count_floors_between([0.0, 3.0], [0.0, 3.0], 0.17) == 2
    assert count_floors_between([0.0, 3.0], [0.0, 3.0], -3.0) == 0
    assert count_floors_between([0.0, 3.0], [0.0, 3.0], -1.5) == 2
    assert count_floors_between([], [0.0], 1.0) == 0


def test_runs_without_a_common_stairway_are_refused_by_name():
    first, second = see(SITE[:1], np.eye(4), seed=1), see(SITE[1:2], np.eye(4), seed=2)
    with pytest.raises(MergeError, match="no stairway joins b with a"):
        find_alignment(runs_of(first, second), ["a", "b"])


def test_open_ends_are_matched_by_the_steps_that_others_tell():
    whole = SITE[:2]
    part = [cut_flight(SITE[0], 3, 7), SITE[1]]
    site_from_second = level_transform(4, -2, 1, 2.5)
    alignment = find_alignment(
        runs_of(see(whole, np.eye(4), seed=1), see(part, site_from_second, seed=2)), ["a", "b"]
    )
    check_close(alignment.site_from_run[1], site_from_second)
    assert alignment.pairs[0].num_common == 2


def test_dimensions_tell_flights_apart_and_bounds_do_not():
    flight = make_flight()
    assert may_be_same(flight, make_flight(rise=0.173, run=0.283))
    assert not may_be_same(flight, make_flight(rise=0.180))
    assert not may_be_same(flight, make_flight(run=0.295))
    assert not may_be_same(flight, make_flight(width=1.0))
    assert may_be_same(flight, make_flight(width=1.0, left_bounded=False))
    assert not may_be_same(flight, make_flight(num_risers=9))
    assert may_be_same(flight, make_flight(num_risers=9, top_seen=False))


def test_shifts_keep_seen_ends_outside():
    whole = make_flight(num_risers=6)
    assert list(step_shifts(whole, whole)) == [0]
    assert list(step_shifts(whole, make_flight(num_risers=4, bottom_seen=False, top_seen=False))) == [0, 1, 2]
    assert list(step_shifts(whole, make_flight(num_risers=4, top_seen=False))) == [0]
    assert list(step_shifts(whole, make_flight(num_risers=4, bottom_seen=False))) == [2]


@pytest.mark.parametrize(
    ("other", "shift"),
    [
        (make_flight((0.1, 0.1, 0.0)), 0),
        (make_flight((0.0, 0.5, 0.0)), None),
        (make_flight((0.0, 0.0, 0.5)), None),
        (make_flight(heading=0.2), None),
        (cut_flight(make_flight(), 2, 8), 2),
    ],
)
def test_flight_lies_on_another_at_a_whole_number_of_steps(other, shift):
    assert lies_on(make_flight(), other, np.eye(4)) == shift


def test_alignment_file_goes_round_and_is_checked(tmp_path):
    runs = runs_of(see(SITE, np.eye(4), seed=1), see(SITE, level_transform(1, 2, 3, 0.5), seed=2))
    alignment = find_alignment(runs, ["a", "b"])
    path = tmp_path / "alignment.yaml"
    path.write_text(alignment_text(alignment, ["a", "b"]))
    again = load_alignment(path, ["b", "a"])
    assert np.allclose(again.site_from_run[0], alignment.site_from_run[1], atol=1e-4)
    with pytest.raises(MergeError, match="lacks the run c; it has: a, b"):
        load_alignment(path, ["a", "c"])
    path.write_text("runs: {a: {x: 1.0, y: nowhere, yaw_deg: 0.0}}")
    with pytest.raises(MergeError, match=r"is no alignment: runs\.a\.y"):
        load_alignment(path, ["a"])
