"""End to end: the node as its own process, a robot that drives up to known stairs, and what it is told."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from node_answers import (
    assert_is_the_stairway,
    assert_markers_show,
    assert_planner_knows,
    num_observations_in,
)
from ros_environment import Drive, RosEnvironment, wait_for

pytestmark = pytest.mark.usefixtures("wheels")


def test_a_stairway_comes_back_as_messages_markers_and_detections(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node(robot="spot")
    (outcome,) = ros.run_robot([{}])
    assert outcome["answered"]
    flight = assert_is_the_stairway(outcome, drive.true_flight)
    assert_markers_show(outcome["markers"], flight, drive.true_flight.num_risers)
    (detection,) = outcome["detections"]
    assert (detection["id"], detection["class_id"]) == ("1/1", "stairway")
    assert detection["frame_id"] == "map"
    np.testing.assert_allclose(detection["center"], flight["box_center"])
    np.testing.assert_allclose(detection["size"], flight["box_size"])
    last = outcome["diagnostics"][-1]
    assert (last["level"], last["message"]) == (0, "1 stairway")
    assert int(last["values"]["images processed"]) > 24
    assert_planner_knows(outcome["planner"], drive.true_flight)


def test_a_corrected_path_moves_the_stairway(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node(reliability="reliable")
    before, after = ros.run_robot([{"reliability": "reliable"}, {"mode": "correct", "without": ["depth"]}])
    lower = assert_is_the_stairway(before, drive.true_flight)
    assert after["answered"]
    higher = after["stairways"][0]["flights"][0]
    np.testing.assert_allclose(higher["base"], np.add(lower["base"], [0, 0, 1]), atol=0.02)
    assert after["stairways"][0]["id"] == before["stairways"][0]["id"]


def test_an_image_waits_for_its_transform(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node(max_transform_wait=1.0)
    (outcome,) = ros.run_robot([{"tf_delay": 0.2}])
    assert outcome["answered"]
    assert_is_the_stairway(outcome, drive.true_flight)
    assert outcome["median_delay"] > 0.2


def test_images_whose_transform_never_comes_are_dropped_counted_and_told(ros: RosEnvironment) -> None:
    ros.start_node(max_transform_wait=0.1)
    told = "no pose of the camera: no transform from"
    _, outcome = ros.run_robot(
        [{"mode": "listen", "until": "stairway"}, {"mode": "listen", "until": told, "without": ["tf"]}]
    )
    assert outcome["answered"]
    last = outcome["diagnostics"][-1]
    assert last["level"] == 1
    assert int(last["values"]["images dropped without a transform"]) > 5


def test_a_localiser_that_is_lost_does_not_spoil_the_map(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node()
    told = "no pose of the camera: no transform from"
    _, lost, after = ros.run_robot(
        [{"mode": "listen", "until": "stairway"}, {"mode": "listen", "until": told, "lost": True}, {}]
    )
    assert lost["answered"]
    assert int(lost["diagnostics"][-1]["values"]["invalid transforms"]) > 0
    assert_is_the_stairway(after, drive.true_flight)


@pytest.mark.parametrize(
    ("without", "told"),
    [
        (["info"], "no camera_info ever came on /depth/camera_info"),
        (["depth"], "no depth image ever came on /depth/image_rect_raw"),
    ],
)
def test_a_silent_topic_is_named(ros: RosEnvironment, without: list[str], told: str) -> None:
    ros.start_node(max_silence=1.0)
    (outcome,) = ros.run_robot([{"mode": "listen", "until": f" s: {told}", "without": without}])
    assert outcome["answered"], outcome["diagnostics"]
    assert outcome["diagnostics"][-1]["level"] == 1


def test_a_jump_back_in_time_is_told_and_the_stairway_stays_one(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node()
    before, after = ros.run_robot([{}, {"clock_offset": -100.0}])
    assert before["answered"]
    assert after["answered"]
    assert int(after["diagnostics"][-1]["values"]["jumps back in time"]) > 0
    assert ": time went back by" in ros.node_log.read_text()
    first = assert_is_the_stairway(before, drive.true_flight)
    second = assert_is_the_stairway(after, drive.true_flight)
    np.testing.assert_allclose(first["base"], second["base"], atol=0.01)
    assert after["stairways"][0]["num_observations"] > before["stairways"][0]["num_observations"]


def test_a_killed_node_goes_on_where_it_was(ros: RosEnvironment, drive: Drive, tmp_path: Path) -> None:
    map_file = tmp_path / "hall.npz"
    node = ros.start_node(map_file=map_file, map_save_period=0.5)
    (before,) = ros.run_robot([{}])
    assert_is_the_stairway(before, drive.true_flight)
    kept = tmp_path / "hall.json"
    wanted = before["stairways"][0]["num_observations"]
    assert wait_for(lambda: num_observations_in(kept) == wanted, seconds=5.0)
    node.send_signal(signal.SIGKILL)
    node.wait()
    ros.start_node(map_file=map_file)
    restored, after = ros.run_robot([{"mode": "wait"}, {}])
    assert restored["stairways"] == before["stairways"]
    assert_markers_show(
        restored["markers"], restored["stairways"][0]["flights"][0], drive.true_flight.num_risers
    )
    assert_is_the_stairway(after, drive.true_flight)
    assert after["stairways"][0]["num_observations"] > wanted
