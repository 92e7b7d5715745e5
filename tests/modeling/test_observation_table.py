"""Observations are kept in arrays that grow by doubling, each in its own axes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from ideal_observations import make_flight, observe, poses_before, turned_map
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations

FLIGHT = make_flight(heading=0.7)
POSE = poses_before(FLIGHT, 1)[0]


def test_adding_allocates_only_when_the_arrays_double() -> None:
    table = ObservationTable()
    observation = observe(FLIGHT, POSE, 0)
    buffers: list[tuple[int, int]] = []
    for _ in range(3000):
        table.add(observation)
        buffer = table.observations.base
        assert buffer is not None
        if not buffers or buffers[-1][0] != id(buffer):
            buffers.append((id(buffer), len(buffer)))
    lengths = [length for _, length in buffers]
    assert len(table) == 3000
    assert len(lengths) <= 8
    assert all(later >= 2 * earlier for earlier, later in pairwise(lengths))


def test_the_table_keeps_what_it_was_given_through_its_growth() -> None:
    table = ObservationTable()
    for index in range(200):
        table.add(observe(FLIGHT, POSE, index, steps=range(3 + index % 5), floor_seen=index % 2 == 0))
    records = table.observations
    np.testing.assert_array_equal(records["stamp_ns"], np.arange(200))
    np.testing.assert_array_equal(records["num_steps"], 3 + np.arange(200) % 5)
    np.testing.assert_array_equal(records["floor_seen"], np.arange(200) % 2 == 0)
    assert len(table.edges) == sum(3 + index % 5 for index in range(200))
    np.testing.assert_array_equal(np.bincount(table.edges["observation"]), records["num_steps"])


def test_edges_stand_in_their_observations_own_axes() -> None:
    table = ObservationTable()
    table.add(observe(FLIGHT, POSE, 0, steps=[1, 2, 4]))
    edges = table.edges
    np.testing.assert_array_equal(edges["index"], [0, 1, 3])
    np.testing.assert_allclose(edges["forward"], 0.28 * edges["index"], atol=1e-6)
    np.testing.assert_allclose(edges["up"], 0.17 * edges["index"], atol=1e-6)
    np.testing.assert_allclose(edges["left"], 0.6, atol=1e-6)
    np.testing.assert_allclose(edges["right"], -0.6, atol=1e-6)


def test_an_observation_without_a_covariance_gets_wide_variances() -> None:
    table = ObservationTable()
    certain = observe(FLIGHT, POSE, 0)
    table.add(certain)
    vague = observe(FLIGHT, POSE, 1)
    object.__setattr__(vague, "covariance", np.zeros((0, 0)))
    table.add(vague)
    for name in ("rise_variance", "run_variance", "forward_variance", "up_variance", "heading_variance"):
        assert table.observations[name][1] > table.observations[name][0] > 0


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0])
def test_placing_puts_origin_and_heading_into_the_map(yaw: float) -> None:
    table = ObservationTable()
    table.add(observe(FLIGHT, POSE, 0))
    other_from_map = turned_map(yaw, (3.0, -2.0, 1.0))
    placed = PlacedObservations(table, (other_from_map @ POSE)[None])
    nosing = FLIGHT.edges()[0].mean(axis=0)
    np.testing.assert_allclose(
        placed.origin[0], other_from_map[:3, :3] @ nosing + other_from_map[:3, 3], atol=1e-9
    )
    turn = placed.heading[0] - FLIGHT.heading - yaw
    assert (turn + np.pi) % (2 * np.pi) - np.pi == pytest.approx(0.0, abs=1e-9)


def test_positions_along_a_heading_are_forward_left_and_up() -> None:
    table = ObservationTable()
    table.add(observe(make_flight(base=np.array([2.0, 5.0, 1.0])), POSE, 0))
    placed = PlacedObservations(table, POSE[None])
    np.testing.assert_allclose(placed.in_axes(0.0), [[2.0, 5.0, 1.17]], atol=1e-9)
    np.testing.assert_allclose(placed.in_axes(np.pi / 2), [[5.0, -2.0, 1.17]], atol=1e-9)
    assert placed.in_axes(0.0, np.zeros(0, dtype=np.int64)).shape == (0, 3)
