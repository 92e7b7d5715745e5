"""Every step of a flight keeps the place that it was built at, and says how well it is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stairmap.arrays import Float64Array
from stairmap.modeling.step_places import SeenEdges, fit_step_offsets

SIGMA = 0.013


def seen_by(
    num: int,
    offsets: Float64Array,
    *,
    noise: float = 0.0,
    std: float = 0.003,
    step_std: float = 0.002,
    seed: int = 0,
    steps: Any = None,
    step_error: float = 0.0,
) -> SeenEdges:
    """The steps of a flight with these offsets as so many observations see them, each with its own shift."""
    random = np.random.default_rng(seed)
    chosen = np.arange(len(offsets)) if steps is None else np.asarray(steps)
    owner, step = np.repeat(np.arange(num), len(chosen)), np.tile(chosen, num)
    shift = random.normal(0, 0.02, num)
    shift -= shift.mean()
    slope = step_error * random.normal(size=num)
    values = offsets[step] + shift[owner] + slope[owner] * (step - step.mean())
    return SeenEdges(
        owner=owner,
        step=step,
        offset=values + random.normal(0, noise, len(step)) if noise else values,
        std=np.full(len(step), std),
        step_variance=np.full(num, step_std**2),
    )


def fit(edges: SeenEdges, num_steps: int) -> tuple[Float64Array, Float64Array]:
    return fit_step_offsets(edges, num_steps, irregularity=SIGMA, unstated_std=0.006)


def joined(first: SeenEdges, second: SeenEdges) -> SeenEdges:
    num = len(first.step_variance)
    return SeenEdges(
        owner=np.append(first.owner, second.owner + num),
        step=np.append(first.step, second.step),
        offset=np.append(first.offset, second.offset),
        std=np.append(first.std, second.std),
        step_variance=np.append(first.step_variance, second.step_variance),
    )


def risers(offsets: Float64Array) -> Float64Array:
    return 0.168 + np.diff(offsets)


def test_uneven_risers_are_not_pulled_to_their_mean() -> None:
    true = np.cumsum([0.0, 0.022, -0.025, 0.012, -0.004, -0.020, 0.015])
    true -= np.polyval(np.polyfit(np.arange(7), true, 1), np.arange(7))
    found, _ = fit(seen_by(12, true, noise=0.003), 7)
    assert risers(true).min() < 0.150 and risers(true).max() > 0.185
    np.testing.assert_allclose(risers(found), risers(true), atol=0.003)


def test_one_riser_12_mm_off_is_told_from_a_regular_flight() -> None:
    regular, _ = fit(seen_by(12, np.zeros(8), noise=0.003), 8)
    assert np.abs(np.diff(regular)).max() < 0.004
    raised = np.where(np.arange(8) >= 4, 0.012, 0.0)
    found, std = fit(seen_by(12, raised, noise=0.003), 8)
    differences = np.diff(found)
    assert differences[3] == pytest.approx(0.012, abs=0.003)
    assert np.abs(np.delete(differences, 3)).max() < 0.004
    assert differences[3] > 3 * np.hypot(std[3], std[4])


def test_shifts_of_whole_observations_do_not_move_single_steps() -> None:
    true = np.array([0.0, 0.01, -0.01, 0.0, 0.004, -0.004])
    found, _ = fit(seen_by(6, true, noise=0.0, std=0.001, step_std=0.0006), 6)
    np.testing.assert_allclose(found - found.mean(), true - true.mean(), atol=0.0005)


def test_an_error_of_the_step_of_a_frame_is_spread_by_its_stated_deviation() -> None:
    sloped = seen_by(1, 0.004 * (np.arange(6) - 2.5), std=0.002, step_std=0.010)
    found, _ = fit(sloped, 6)
    # The frame may err by 10 mm a step and stairs are built evenly, so most of it is the frame's error.
    assert np.abs(found).max() < 0.002
    sure = seen_by(1, 0.004 * (np.arange(6) - 2.5), std=0.002, step_std=0.0006)
    found, _ = fit(sure, 6)
    assert found[-1] == pytest.approx(0.010, abs=0.001)


def test_observations_of_different_steps_are_put_together() -> None:
    true = np.array([0.0, 0.0, 0.012, 0.0, -0.010, 0.0, 0.008, 0.0, 0.0])
    low = seen_by(8, true, steps=range(6), noise=0.001, std=0.001)
    high = seen_by(8, true, steps=range(3, 9), noise=0.001, std=0.001, seed=1)
    found, _ = fit(joined(low, high), 9)
    np.testing.assert_allclose(found - found.mean(), true - true.mean(), atol=0.002)


def test_deviations_are_honest_over_many_flights() -> None:
    scores = []
    for seed in range(60):
        random = np.random.default_rng(1000 + seed)
        true = random.normal(0, SIGMA, 7)
        edges = seen_by(4, true, noise=0.004, std=0.004, step_std=0.0015, step_error=0.0015, seed=seed)
        found, std = fit(edges, 7)
        scores.append(((found - found.mean()) - (true - true.mean())) / std)
    # Four neighbouring frames count as one, and here they err independently: so twice as good as stated.
    assert 0.4 < np.std(scores) < 0.75
    assert np.abs(scores).max() < 3.0


def test_more_observations_make_a_step_surer_and_neighbours_count_once() -> None:
    stds = {num: fit(seen_by(num, np.zeros(6), std=0.004), 6)[1].mean() for num in (1, 6, 24)}
    assert stds[6] == pytest.approx(stds[1], rel=1e-6)
    assert stds[24] < 0.6 * stds[6]


def test_a_wrong_edge_moves_its_step_little() -> None:
    edges = seen_by(12, np.zeros(6), noise=0.002, std=0.002)
    offset = edges.offset.copy()
    offset[3] += 0.08
    spoilt = SeenEdges(
        owner=edges.owner, step=edges.step, offset=offset, std=edges.std, step_variance=edges.step_variance
    )
    assert abs(fit(spoilt, 6)[0][3] - fit(edges, 6)[0][3]) < 0.002


def test_edges_that_scatter_more_than_they_state_are_less_sure() -> None:
    stated = fit(seen_by(12, np.zeros(6), noise=0.002, std=0.002, step_std=0.0006), 6)[1]
    wild = fit(seen_by(12, np.zeros(6), noise=0.010, std=0.002, step_std=0.0006), 6)[1]
    assert wild.mean() > 2.5 * stated.mean()


def test_a_precise_edge_counts_more_than_a_vague_one() -> None:
    precise = seen_by(6, np.array([0.0, 0.010, 0.0, 0.0]), std=0.001)
    vague = seen_by(6, np.zeros(4), std=0.02)
    found, _ = fit(joined(precise, vague), 4)
    assert found[1] - found[0] == pytest.approx(0.010, abs=0.001)


def test_a_step_that_nobody_saw_lies_on_the_lattice_and_is_as_uncertain_as_stairs_are_uneven() -> None:
    found, std = fit(seen_by(8, np.zeros(6), std=0.002, steps=[0, 1, 2, 4, 5]), 6)
    assert found[3] == pytest.approx(0.0, abs=1e-9)
    assert SIGMA < std[3] < 1.15 * SIGMA
    assert std[2] < 0.3 * SIGMA


def test_deviations_are_unknown_where_no_edge_states_one() -> None:
    found, std = fit(seen_by(8, np.array([0.0, 0.01, 0.0, 0.0]), std=float("nan")), 4)
    assert np.isnan(std).all()
    assert found[1] - found[0] == pytest.approx(0.010, abs=0.002)
    one = seen_by(8, np.zeros(4), std=float("nan"), steps=[0, 1])
    other = seen_by(8, np.zeros(4), std=0.002, steps=[1, 2])
    _, std = fit(joined(one, other), 4)
    assert np.isnan(std[0]) and np.isfinite(std[1:]).all()


def test_all_steps_lie_where_the_edges_do() -> None:
    edges = seen_by(6, np.full(5, 0.020), std=0.002)
    np.testing.assert_allclose(fit(edges, 5)[0], 0.020, atol=1e-6)


def test_no_step_is_said_to_be_known_to_less_than_what_sensors_err_in_common() -> None:
    assert fit(seen_by(600, np.zeros(5), std=0.001), 5)[1].min() >= 0.0009
