"""The lattice of nosings: rise and run of whole stairs, whichever steps were seen."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stairmap.arrays import Float64Array
from stairmap.config import EnvelopeConfig
from stairmap.detection.lattice import (
    Lattice,
    NosingGroups,
    find_lattices,
    group_corners,
)
from stairmap.detection.nosing_search import Corners

MAX_GROUP_DISTANCE = 0.09
MAX_GROUP_HEIGHT = 0.05
MAX_STRIPS_COUNTED = 12
"""Limits that hold, written again: who changes one changes it here as well."""

NUM_STRIPS = 20
NOISE = 2e-4
ENVELOPE = EnvelopeConfig()


def nosings_of(
    indices: Iterable[int],
    *,
    rise: float = 0.17,
    run: float = 0.28,
    distance: float = 1.2,
    height: float = -0.6,
    strips: range = range(4, 16),
) -> Float64Array:
    """(N, 3) distance, height and strip of each nosing in each strip."""
    rows = [(distance + k * run, height + k * rise, strip) for k in indices for strip in strips]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def grouped(*nosings: Float64Array, noise: float = NOISE) -> NosingGroups:
    distance, height, strip = np.concatenate(nosings).T
    corners = Corners(
        distance=distance,
        height=height,
        strip=strip.astype(np.int64),
        is_jump=np.ones(len(strip), bool),
        is_end=np.zeros(len(strip), bool),
    )
    return group_corners(corners, num_strips=NUM_STRIPS, noise=noise)


def lattices_of(
    *nosings: Float64Array, noise: float = NOISE, max_lattices: int = 3, envelope: EnvelopeConfig = ENVELOPE
) -> list[Lattice]:
    groups = grouped(*nosings, noise=noise)
    return find_lattices(groups, envelope, noise=noise, max_lattices=max_lattices)


def test_nosings_of_neighbouring_strips_become_one_group() -> None:
    groups = grouped(nosings_of([0, 1, 2]))
    assert len(groups) == 3
    np.testing.assert_allclose(np.sort(groups.distance), [1.2, 1.48, 1.76])
    assert (groups.strips.sum(axis=1) == 12).all()


def test_a_nosing_in_a_single_strip_is_no_group() -> None:
    assert len(grouped(nosings_of([0], strips=range(5, 6)))) == 0
    assert len(grouped(np.zeros((0, 3)))) == 0


def test_a_lattice_of_exact_nosings_is_exact() -> None:
    best = lattices_of(nosings_of(range(6)))[0]
    assert (best.rise, best.run) == pytest.approx((0.17, 0.28))
    assert (best.distance, best.height) == pytest.approx((1.2, -0.6))
    assert best.indices.tolist() == [0, 1, 2, 3, 4, 5]
    assert np.flatnonzero(best.strips).tolist() == list(range(4, 16))


@pytest.mark.parametrize("seen", [(0, 1, 3, 4), (0, 2, 3), (0, 1, 4, 5), (0, 1, 2, 5, 6, 9)])
def test_lattice_with_a_missed_step_keeps_its_rise(seen: tuple[int, ...]) -> None:
    best = lattices_of(nosings_of(seen))[0]
    assert (best.rise, best.run) == pytest.approx((0.17, 0.28))
    assert best.indices.tolist() == list(seen)


def test_every_second_step_missed_makes_no_stairs_of_twice_the_rise() -> None:
    # 0.34 m is no rise of a stairway, so that the pairs can only be two steps apart.
    best = lattices_of(nosings_of([0, 2, 4, 6]))[0]
    assert (best.rise, best.run) == pytest.approx((0.17, 0.28))


def test_nosings_of_noise_do_not_change_rise_and_run() -> None:
    random = np.random.default_rng(4)
    noise = []
    for _ in range(15):
        s, z, strip = random.uniform(1.0, 3.0), random.uniform(-0.8, 0.6), int(random.integers(2, 14))
        noise.append(nosings_of([0], distance=s, height=z, strips=range(strip, strip + 4)))
    best = lattices_of(nosings_of(range(6)), *noise)[0]
    assert (best.rise, best.run) == pytest.approx((0.17, 0.28), abs=0.004)
    assert set(range(6)) <= set(best.indices.tolist())


def test_a_lattice_of_measured_nosings_is_as_good_as_they_are() -> None:
    nosings = nosings_of(range(7))
    nosings[:, :2] += np.random.default_rng(1).normal(0, 0.006, nosings[:, :2].shape)
    best = lattices_of(nosings)[0]
    assert (best.rise, best.run) == pytest.approx((0.17, 0.28), abs=0.002)


def test_descending_stairs_have_a_negative_run_and_a_positive_rise() -> None:
    nosings = nosings_of(range(5), run=-0.28, distance=3.0, height=-1.6)
    best = lattices_of(nosings)[0]
    assert (best.rise, best.run) == pytest.approx((0.17, -0.28))
    assert (best.distance, best.height) == pytest.approx((3.0, -1.6))


def test_two_stairs_in_one_view_are_two_lattices() -> None:
    near = nosings_of(range(5), rise=0.15, run=0.32, strips=range(1, 8))
    far = nosings_of(range(4), rise=0.2, run=0.24, distance=2.0, height=-0.2, strips=range(12, 19))
    first, second, *_ = lattices_of(near, far)
    assert (first.rise, first.run) == pytest.approx((0.15, 0.32))
    assert (second.rise, second.run) == pytest.approx((0.2, 0.24))
    assert not (first.strips & second.strips).any()


@pytest.mark.parametrize(
    ("rise", "run"),
    [(0.05, 0.30), (0.17, 0.95), (0.60, 0.42), (0.24, 0.15)],
    ids=["too low", "too deep", "too high", "too steep"],
)
def test_what_repeats_outside_the_envelope_is_no_lattice_of_three(rise: float, run: float) -> None:
    found = lattices_of(nosings_of(range(3), rise=rise, run=run))
    assert all(len(lattice.indices) < 3 for lattice in found)


def test_one_nosing_is_no_lattice() -> None:
    assert lattices_of(nosings_of([0])) == []
    assert lattices_of(np.zeros((0, 3))) == []


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    rise=st.floats(0.10, 0.25),
    run=st.floats(0.20, 0.40),
    num_steps=st.integers(4, 20),
    missed=st.integers(1, 18),
    distance=st.floats(0.8, 2.0),
    height=st.floats(-1.5, -0.1),
)
def test_any_flight_with_any_one_step_missed_keeps_rise_and_run(
    rise: float, run: float, num_steps: int, missed: int, distance: float, height: float
) -> None:
    assume(15 <= np.degrees(np.arctan2(rise, run)) <= 50)
    seen = [k for k in range(num_steps) if k != missed]
    best = lattices_of(nosings_of(seen, rise=rise, run=run, distance=distance, height=height))[0]
    assert (best.rise, best.run) == pytest.approx((rise, run), abs=1e-6)
    assert best.indices.tolist() == seen


@pytest.mark.parametrize(("apart", "is_one"), [(0.03, True), (0.04, False)])
@pytest.mark.parametrize("axis", [0, 1])
def test_corners_of_one_nosing_lie_within_34_mm(axis: int, apart: float, is_one: bool) -> None:
    first, second = nosings_of([0], strips=range(4, 7)), nosings_of([0], strips=range(7, 10))
    second[:, axis] += apart
    assert len(grouped(first, second)) == (1 if is_one else 2)


def test_noise_lets_corners_of_one_nosing_lie_farther_apart_up_to_a_limit() -> None:
    first, second = nosings_of([0], strips=range(4, 7)), nosings_of([0], strips=range(7, 10))
    for axis, limit in ((0, MAX_GROUP_DISTANCE), (1, MAX_GROUP_HEIGHT)):
        moved = second.copy()
        moved[:, axis] += limit - 0.005
        assert len(grouped(first, moved)) == 2
        assert len(grouped(first, moved, noise=0.1)) == 1
        moved[:, axis] += 0.01
        assert len(grouped(first, moved, noise=0.1)) == 2


@pytest.mark.parametrize(("gap", "is_one"), [(2, True), (3, False)])
def test_a_nosing_may_miss_one_strip_between_two(gap: int, is_one: bool) -> None:
    first, second = nosings_of([0], strips=range(4, 7)), nosings_of([0], strips=range(6 + gap, 9 + gap))
    assert len(grouped(first, second)) == (1 if is_one else 2)


def test_a_group_lies_at_the_mean_of_its_corners() -> None:
    nosings = nosings_of([0], strips=range(4, 8))
    nosings[:, 0] += [0.0, 0.01, 0.02, 0.03]
    nosings[:, 1] -= [0.0, 0.01, 0.02, 0.03]
    groups = grouped(nosings)
    assert groups.distance == pytest.approx([1.215])
    assert groups.height == pytest.approx([-0.615])
    assert np.flatnonzero(groups.strips[0]).tolist() == [4, 5, 6, 7]


@pytest.mark.parametrize(("missed", "is_found"), [(2, True), (3, False)])
def test_up_to_two_steps_may_be_missed_between_the_two_that_find_a_lattice(
    missed: int, is_found: bool
) -> None:
    found = lattices_of(nosings_of([0, missed + 1], rise=0.24, run=0.3))
    right = [lattice for lattice in found if abs(lattice.rise - 0.24) < 0.001]
    assert bool(right) == is_found
    if is_found:
        assert right[0].indices.tolist() == [0, missed + 1]
        assert right[0].run == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("name", "factor", "is_found"),
    [
        ("min_rise", 1.09, True), ("min_rise", 1.13, False),
        ("max_rise", 0.92, True), ("max_rise", 0.89, False),
        ("min_run", 1.09, True), ("min_run", 1.13, False),
        ("max_run", 0.92, True), ("max_run", 0.89, False),
        ("min_pitch_deg", 1.09, True), ("min_pitch_deg", 1.11, False),
        ("max_pitch_deg", 0.91, True), ("max_pitch_deg", 0.89, False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_envelope_has_a_slack_of_a_tenth_and_of_3_degrees(
    sign: float, name: str, factor: float, is_found: bool
) -> None:
    # Pitch is 31.26 degrees, of which 3 are just under a tenth.
    value = {"rise": 0.17, "run": 0.28, "pitch": np.degrees(np.arctan2(0.17, 0.28))}[name.split("_")[1]]
    limits = {"min_rise": 0.05, "max_rise": 0.5, "min_run": 0.05, "max_run": 0.9}
    wide = {**limits, "min_pitch_deg": 5.0, "max_pitch_deg": 80.0}
    envelope = EnvelopeConfig.model_validate({**wide, name: float(value * factor)})
    found = lattices_of(nosings_of([0, 1, 2, 3], run=sign * 0.28, distance=2.0), envelope=envelope)
    regular = [lattice for lattice in found if len(lattice.indices) == 4]
    right = [lattice for lattice in regular if abs(lattice.rise - 0.17) < 1e-3]
    assert bool(right) == is_found


@pytest.mark.parametrize(("off", "is_inlier"), [(0.030, True), (0.050, False)])
def test_nosings_of_a_lattice_lie_within_35_mm_of_their_distance(off: float, is_inlier: bool) -> None:
    nosings = nosings_of(range(6))
    stray = nosings_of([6])
    # One more step along, of which the error of the pair's run has grown by little.
    stray[:, 0] += off * (1.9 if not is_inlier else 1.0)
    best = lattices_of(nosings, stray)[0]
    assert (6 in best.indices.tolist()) == is_inlier


@pytest.mark.parametrize(("off", "is_inlier"), [(0.022, True), (0.060, False)])
def test_nosings_of_a_lattice_lie_within_25_mm_of_their_height(off: float, is_inlier: bool) -> None:
    nosings, stray = nosings_of(range(6)), nosings_of([6])
    stray[:, 1] += off
    best = lattices_of(nosings, stray)[0]
    assert (6 in best.indices.tolist()) == is_inlier


def test_nosings_that_are_not_seen_in_any_strip_of_the_others_are_of_other_stairs() -> None:
    near = nosings_of([0, 1, 2], strips=range(1, 6))
    aside = nosings_of([3], strips=range(12, 18))
    assert lattices_of(near, aside)[0].indices.tolist() == [0, 1, 2]


def test_a_lattice_of_more_strips_is_the_better_one() -> None:
    wide = nosings_of(range(3), rise=0.15, run=0.32, strips=range(10, 20))
    narrow = nosings_of(range(4), rise=0.2, run=0.24, distance=2.5, height=0.4, strips=range(0, 4))
    first, second, *_ = lattices_of(wide, narrow)
    assert (first.rise, second.rise) == pytest.approx((0.15, 0.2))
    assert first.score == pytest.approx(30.0)
    assert second.score == pytest.approx(16.0)


def test_strips_of_a_wide_nosing_count_up_to_a_limit() -> None:
    best = lattices_of(nosings_of(range(3), strips=range(0, 18)))[0]
    assert best.score == pytest.approx(3 * MAX_STRIPS_COUNTED)


def test_a_missed_step_costs_half_of_one() -> None:
    best = lattices_of(nosings_of([0, 1, 3, 4]))[0]
    assert best.score == pytest.approx(3.5 * 12)


@pytest.mark.parametrize("num", [1, 2])
def test_no_more_lattices_than_asked_for_are_returned(num: int) -> None:
    near = nosings_of(range(5), rise=0.15, run=0.32, strips=range(1, 8))
    far = nosings_of(range(4), rise=0.2, run=0.24, distance=2.0, height=-0.2, strips=range(12, 19))
    assert len(lattices_of(near, far, max_lattices=num)) == num


def test_steps_that_are_not_level_with_each_other_are_weighed_by_their_strips() -> None:
    nosings = [nosings_of([0, 1, 2]), nosings_of([3], strips=range(4, 8))]
    nosings[1][:, 0] += 0.02
    best = lattices_of(*nosings)[0]
    plain = np.polyfit(np.arange(4), 1.2 + 0.28 * np.arange(4) + [0, 0, 0, 0.02], 1)[0]
    assert 0.28 < best.run < plain


EXACT = 1e-7
"""Noise that adds nothing to a limit, 1/m."""


def strayed(num: int, *, forward: float = 0.0, up: float = 0.0) -> Float64Array:
    """So many nosings, and one more that lies off its place."""
    last = nosings_of([num])
    last[:, 0] += forward
    last[:, 1] += up
    return np.concatenate([nosings_of(range(num)), last])


@pytest.mark.parametrize(("off", "is_inlier"), [(0.078, True), (0.083, False)])
def test_the_middle_of_three_nosings_lies_within_35_mm_and_a_share_for_each_step(
    off: float, is_inlier: bool
) -> None:
    # Its distance is off by half from the middle of the others: 35 mm and 15 % of them for one step away.
    assert len(lattices_of(strayed(2, forward=off), noise=EXACT)[0].indices) == (3 if is_inlier else 2)


@pytest.mark.parametrize(("off", "is_inlier"), [(0.055, True), (0.060, False)])
def test_the_middle_of_three_nosings_lies_within_25_mm_and_a_share_of_its_height(
    off: float, is_inlier: bool
) -> None:
    assert len(lattices_of(strayed(2, up=off), noise=EXACT)[0].indices) == (3 if is_inlier else 2)


@pytest.mark.parametrize(
    ("forward", "up", "is_inlier"),
    [(0.079, 0.0, True), (0.085, 0.0, False), (0.0, 0.048, True), (0.0, 0.052, False)],
)
def test_errors_grow_by_15_percent_a_step_but_no_more_than_twice_in_height(
    forward: float, up: float, is_inlier: bool
) -> None:
    # Nine steps away 35 mm grow to 82 mm, 25 mm to 50 mm and no farther.
    best = lattices_of(strayed(9, forward=forward, up=up), noise=EXACT)[0]
    assert (9 in best.indices.tolist()) == is_inlier


@pytest.mark.parametrize(("off", "is_inlier"), [(0.192, True), (0.199, False)])
def test_noise_adds_50_mm_at_most_to_where_a_nosing_may_lie(off: float, is_inlier: bool) -> None:
    groups = grouped(strayed(2, forward=off))
    # Rises below 0.15 m would let the three be a lattice with a missed step.
    best = find_lattices(groups, EnvelopeConfig(min_rise=0.16), noise=0.2, max_lattices=1)[0]
    assert len(best.indices) == (3 if is_inlier else 2)


@pytest.mark.parametrize(("gap", "is_one"), [(5, True), (6, False)])
def test_a_lattice_passes_over_five_steps_and_no_more(gap: int, is_one: bool) -> None:
    far = [3 + gap, 4 + gap]
    lattices = lattices_of(nosings_of([0, 1, 2]), nosings_of(far))
    assert lattices[0].indices.tolist() == ([0, 1, 2, *far] if is_one else [0, 1, 2])
    if not is_one:
        # What was left out is a lattice of its own.
        assert [lattice.score for lattice in lattices] == [36.0, 24.0]
        assert lattices[1].distance == pytest.approx(1.2 + 0.28 * far[0])


def test_what_is_left_out_of_a_lattice_costs_it_nothing() -> None:
    # Two wide nosings, and a narrow one far off: eight gaps would cost more than the three are worth.
    best = lattices_of(nosings_of([0, 1]), nosings_of([10], strips=range(4, 6)))[0]
    assert best.indices.tolist() == [0, 1]
    assert best.score == pytest.approx(24.0)
