"""The lattice of nosings: rise and run of whole stairs, whichever steps were seen."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stairmap.arrays import Float64Array
from stairmap.config import EnvelopeConfig
from stairmap.detection.lattice import Lattice, NosingGroups, find_lattices, group_nosings

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


def grouped(*nosings: Float64Array) -> NosingGroups:
    return group_nosings(np.concatenate(nosings), num_strips=NUM_STRIPS, noise=NOISE)


def lattices_of(*nosings: Float64Array, view_sign: int = 1) -> list[Lattice]:
    return find_lattices(grouped(*nosings), ENVELOPE, view_sign=view_sign, noise=NOISE)


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
    assert lattices_of(nosings, view_sign=1) == []
    best = lattices_of(nosings, view_sign=-1)[0]
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
