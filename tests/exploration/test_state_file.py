"""Saved states are read back equal; damaged ones are refused."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, room_with

from stairmap.errors import ResultsError
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.layer_map import LayerMap
from stairmap.exploration.localizer import ScanStore
from stairmap.exploration.state_file import bytes_from_state, load_state
from stairmap.simulation.odometry import OdometryModel


def saved(tmp_path, state):
    path = tmp_path / "state.npz"
    path.write_bytes(bytes_from_state(state))
    return load_state(path)


def test_nested_values_are_read_back_equal(tmp_path):
    array = np.array([(1, 2.5)], dtype=[("id", "<i4"), ("height", "<f8")])
    state = saved(tmp_path, {"a": {"b": [1, None, "x", np.eye(2)]}, "c": array, "d": 2**100, "e": 0.1})
    assert (state["d"], state["e"], state["a"]["b"][:3]) == (2**100, 0.1, [1, None, "x"])
    assert np.array_equal(state["a"]["b"][3], np.eye(2))
    assert state["c"].dtype == array.dtype
    assert state["c"] == array


def test_what_is_no_state_is_refused(tmp_path):
    path = tmp_path / "state.npz"
    for content in (b"", b"text", bytes_from_state({"a": np.eye(50)})[:-30]):
        path.write_bytes(content)
        with pytest.raises(ResultsError, match="begin anew"):
            load_state(path)


def test_a_robot_and_what_it_knows_go_on_as_if_nothing_had_been(tmp_path):
    mesh = room_with(([3.0, 1.0, 0.0], [3.5, 3.0, 0.9]))

    def mission():
        robot = robot_in(mesh, 1.5, 2.0, model=OdometryModel(), seed=4)
        return robot, ExplorationMap(SPOT, robot.pose, has_perfect_odometry=False)

    def go_on(robot, known):
        robot.turn(0.2)
        robot.drive(0.2)
        known.take(robot.look())
        return robot.state(), known.state()

    robot, known = mission()
    known.enter_level()
    for _ in range(3):
        go_on(robot, known)
    known.level.map.block(np.array([[4.0, 0.5]]))
    known.note_look(0, np.array([3.0, 2.0]))
    state = saved(tmp_path, {"robot": robot.state(), "known": known.state()})
    other, other_known = mission()
    other.restore(state["robot"])
    other_known.restore(state["known"])
    assert other_known.num_looks(0, np.array([3.1, 2.0])) == 1
    expected, found = go_on(robot, known), go_on(other, other_known)
    # Registration begins with what was kept; it may differ by its tolerance.
    np.testing.assert_equal(found[0], expected[0])
    assert found[1]["pose"] == pytest.approx(expected[1]["pose"], abs=0.01)
    for name in ("frames", "odometry", "looks", "sightings"):
        np.testing.assert_equal(found[1][name], expected[1][name])
    assert found[1]["localizer"]["num_corrected"] == expected[1]["localizer"]["num_corrected"] > 0
    before, after = (part["levels"][0]["map"] for part in (expected[1], found[1]))
    assert np.array_equal(before["low"], after["low"])
    assert np.array_equal(before["masks"][2], after["masks"][2])
    assert after["masks"][2].sum() == 1
    assert np.mean(before["votes"] != after["votes"]) < 0.01


def test_parts_that_do_not_belong_together_are_refused():
    layer = LayerMap(0.0)
    layer.block(np.array([[1.0, 1.0]]))
    state = layer.state()
    for name, value in (
        ("votes", state["votes"][:2]), ("tops", state["tops"][:5]), ("masks", state["masks"].astype(np.int8)),
    ):  # fmt: skip
        with pytest.raises(ValueError, match="a map has"):
            layer.restore({**state, name: value})
    store = ScanStore()
    with pytest.raises(ValueError, match="1 scans have 0 places"):
        store.restore({**store.state(), "sizes": np.array([3])})
