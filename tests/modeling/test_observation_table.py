"""Observations are kept in arrays that grow by doubling, each in its own axes."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from ideal_observations import make_flight, observe, poses_before, turned_map
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.transforms import transform_from_parts

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


def test_edges_of_some_observations_come_in_their_order() -> None:
    table = ObservationTable()
    for index in range(6):
        table.add(observe(FLIGHT, POSE, index, steps=range(2 + index), edge_std=(0.002, 0.001)))
    for members in ([0, 2, 5], [1, 2, 3], [4], [0], []):
        chosen = np.array(members, dtype=np.int64)
        edges, owner = table.edges_of(chosen)
        expected = table.edges[np.isin(table.edges["observation"], chosen)]
        np.testing.assert_array_equal(edges, expected)
        np.testing.assert_array_equal(chosen[owner], expected["observation"])


def test_what_a_detector_states_of_edges_and_overhang_is_kept() -> None:
    table = ObservationTable()
    table.add(observe(FLIGHT, POSE, 0, edge_std=(0.004, 0.002), overhang=(0.03, 0.005)))
    table.add(observe(FLIGHT, POSE, 1))
    assert table.observations["overhang"][0] == 0.03
    assert table.observations["overhang_std"] == pytest.approx([0.005, np.nan], nan_ok=True)
    assert table.edges["forward_std"][0] == pytest.approx(0.004)
    assert table.edges["up_std"][0] == pytest.approx(0.002)
    assert np.isnan(table.edges["up_std"][-1])


def without_fields(records: Any, *names: str) -> Any:
    """Records as they were before some fields came in."""
    kept = np.dtype([(name, records.dtype[name]) for name in records.dtype.names if name not in names])
    old = np.zeros(len(records), dtype=kept)
    for name in kept.names or ():
        old[name] = records[name]
    return old


def test_records_of_the_first_version_are_read_and_what_they_lack_is_unknown() -> None:
    table = ObservationTable()
    for index in range(3):
        table.add(observe(FLIGHT, POSE, index, edge_std=(0.004, 0.002), overhang=(0.03, 0.005)))
    old = ObservationTable.from_records(
        without_fields(table.observations, "overhang", "overhang_std"),
        without_fields(table.edges, "forward_std", "up_std"),
    )
    assert np.isnan(old.observations["overhang_std"]).all()
    assert np.isnan(old.edges["up_std"]).all()
    np.testing.assert_array_equal(old.observations["rise"], table.observations["rise"])
    np.testing.assert_array_equal(old.edges["forward"], table.edges["forward"])
    edges, _ = old.edges_of(np.array([1]))
    assert (edges["observation"] == 1).all()
    old.add(observe(FLIGHT, POSE, 3, edge_std=(0.004, 0.002)))
    assert old.edges_of(np.array([3]))[0]["up_std"] == pytest.approx(0.002)


def test_records_with_other_fields_are_refused() -> None:
    table = ObservationTable()
    table.add(observe(FLIGHT, POSE, 0))
    with pytest.raises(ValueError, match="observations have the fields"):
        ObservationTable.from_records(without_fields(table.observations, "rise"), table.edges)
    with pytest.raises(ValueError, match="edges have the fields"):
        ObservationTable.from_records(table.observations, without_fields(table.edges, "index", "up_std"))
    other = table.observations.astype(
        [(name, np.float32 if name == "rise" else table.observations.dtype[name])
         for name in table.observations.dtype.names or ()]
    )  # fmt: skip
    with pytest.raises(ValueError, match="field rise is float32"):
        ObservationTable.from_records(other, table.edges)


def test_edges_out_of_order_are_refused() -> None:
    table = ObservationTable()
    for index in range(3):
        table.add(observe(FLIGHT, POSE, index))
    with pytest.raises(ValueError, match="not in the order"):
        ObservationTable.from_records(table.observations, table.edges[::-1])


def test_placing_tells_which_observations_moved() -> None:
    table = ObservationTable()
    for index in range(3):
        table.add(observe(FLIGHT, POSE, index))
    placed = PlacedObservations(table)
    poses = np.array([POSE] * 3)
    assert placed.place(np.arange(3), poses).all()
    assert not placed.place(np.arange(3), poses).any()
    poses[1] = turned_map(0.0, (0.0, 0.0, 1e-9)) @ POSE
    np.testing.assert_array_equal(placed.place(np.arange(3), poses), [False, True, False])
    poses[2] = turned_map(1e-9, (0.0, 0.0, 0.0)) @ POSE
    np.testing.assert_array_equal(placed.place(np.arange(3), poses), [False, False, True])


def test_a_view_from_above_is_one_whatever_axis_the_sensor_calls_forward() -> None:
    flight = make_flight()
    (pose,) = poses_before(flight, 1)
    # As a LiDAR's frame: x forward, z up.
    turned = pose @ transform_from_parts([[0, -1, 0], [0, 0, -1], [1, 0, 0]], np.zeros(3))
    table = ObservationTable()
    for stamp_ns, (view, where) in enumerate(
        [("ascending", pose), ("descending", pose), ("ascending", turned), ("descending", turned)]
    ):
        table.add(observe(flight, where, stamp_ns, view=view))
    assert table.observations["from_below"].tolist() == [True, False, True, False]
    # Records of before there were LiDARs: a camera's z tells.
    older = without_fields(table.observations, "from_below")
    again = ObservationTable.from_records(older, table.edges)
    assert again.observations["from_below"].tolist()[:2] == [True, True]


def test_variances_are_those_of_their_own_measures() -> None:
    """The covariance is of rise, run, forward, up, tilt, which is left out, and heading."""
    observation = observe(FLIGHT, POSE, 0)
    object.__setattr__(observation, "covariance", np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    table = ObservationTable()
    table.add(observation)
    names = ("rise", "run", "forward", "up", "heading")
    assert [table.observations[f"{name}_variance"][0] for name in names] == [1.0, 2.0, 3.0, 4.0, 6.0]
