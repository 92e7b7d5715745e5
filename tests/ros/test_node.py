"""End to end: the node as its own process, a robot that drives up to known stairs, and what it is told."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ros_environment import Drive, RosEnvironment, wait_for

from stairmap.stairway import Flight

pytestmark = pytest.mark.usefixtures("wheels")


@pytest.mark.parametrize("reliability", ["best_effort", "reliable"])
def test_a_stairway_comes_back_as_messages_markers_and_detections(
    ros: RosEnvironment, drive: Drive, reliability: str
) -> None:
    ros.start_node(reliability=reliability)
    (outcome,) = ros.run_robot([{"reliability": reliability}])
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


def test_compressed_depth_is_taken(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node(depth_transport="compressedDepth")
    (outcome,) = ros.run_robot([{"compressed": True}])
    assert outcome["answered"]
    assert_is_the_stairway(outcome, drive.true_flight)


def test_a_corrected_path_moves_the_stairway(ros: RosEnvironment, drive: Drive) -> None:
    ros.start_node()
    before, after = ros.run_robot([{}, {"mode": "correct", "without": ["depth"]}])
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


def test_without_a_clock_the_node_still_says_why_nothing_comes(ros: RosEnvironment) -> None:
    ros.start_node(max_silence=1.0, use_sim_time="true")
    told = "no depth image ever came on /depth/image_rect_raw"
    (outcome,) = ros.run_robot([{"mode": "listen", "until": told, "without": ["depth"]}])
    assert outcome["answered"], outcome["diagnostics"]


def test_missing_coordinate_frames_are_named_with_those_there_are(ros: RosEnvironment) -> None:
    ros.start_node(map_frame="world")
    told = (
        "no pose of the camera: no coordinate frame 'world'; there are: base_link, "
        "camera_depth_optical_frame, map, odom"
    )
    (outcome,) = ros.run_robot([{"mode": "listen", "until": told}])
    assert outcome["answered"], outcome["diagnostics"]


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


def test_a_stopped_node_writes_its_map(ros: RosEnvironment, drive: Drive, tmp_path: Path) -> None:
    node = ros.start_node(map_file=tmp_path / "hall.npz", map_save_period=600)
    (outcome,) = ros.run_robot([{}])
    node.send_signal(signal.SIGINT)
    assert node.wait(timeout=20) == 0
    assert num_observations_in(tmp_path / "hall.json") == outcome["stairways"][0]["num_observations"]


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({"reliability": "sometimes"}, "parameter reliability: Input should be 'best_effort' or 'reliable'"),
        ({"detection.max_depth": 50}, "parameter detection.max_depth: Input should be less than or equal"),
        ({"map_file": "/nowhere/hall.npz"}, "the folder of map_file /nowhere/hall.npz is not there"),
        ({"map_file": "hall.yaml"}, "map_file must end in .npz"),
        ({"map_file": "hall.npz", "method": "delmerico2013"}, "map_file needs method: stairmap"),
    ],
)
def test_an_impossible_parameter_ends_the_node_with_one_line(
    ros: RosEnvironment, parameters: dict[str, Any], told: str
) -> None:
    node = ros.start_node(**parameters)
    assert node.wait(timeout=60) == 1
    assert the_only_line_of(ros).startswith(f"stairmap: {told}")


def test_arguments_that_ros_cannot_read_end_the_node_without_a_traceback(ros: RosEnvironment) -> None:
    node = ros.start_node(map_frame="")
    assert node.wait(timeout=60) == 1
    last = ros.node_log.read_text().splitlines()[-1]
    assert last.startswith("stairmap: failed to initialize rcl: Couldn't parse parameter override rule")


def test_without_tf2_msgs_the_node_says_what_to_install(ros: RosEnvironment) -> None:
    node = ros.start_node(without_package="tf2_msgs")
    assert node.wait(timeout=60) == 1
    line = the_only_line_of(ros)
    assert line.startswith("stairmap: tf2_msgs is not installed")
    assert line.endswith("sudo apt install ros-$ROS_DISTRO-tf2-msgs")


def test_without_vision_msgs_only_the_detections_are_missing(ros: RosEnvironment) -> None:
    ros.start_node(without_package="vision_msgs")
    (outcome,) = ros.run_robot([{"mode": "listen", "until": "stairway"}])
    assert outcome["answered"]
    assert outcome["stairways"] is not None


def the_only_line_of(ros: RosEnvironment) -> str:
    """What the node has printed, without what Fast DDS has to say about itself."""
    lines = ros.node_log.read_text().splitlines()
    (line,) = [line for line in lines if "[rmw_fastrtps_shared_cpp]" not in line]
    return line


def assert_is_the_stairway(outcome: dict[str, Any], true: Flight) -> dict[str, Any]:
    """The one stairway of an outcome is the true one; return its flight."""
    (stairway,) = outcome["stairways"]
    assert (stairway["id"], stairway["frame_id"]) == (1, "map")
    (flight,) = stairway["flights"]
    assert abs(flight["rise"] - true.rise) < 0.005
    assert abs(flight["run"] - true.run) < 0.006
    assert abs(flight["width"] - true.width) < 0.04
    assert flight["num_risers"] == flight["num_steps"] == true.num_risers
    assert abs(flight["heading"] - true.heading) < np.radians(1.5)
    np.testing.assert_allclose(flight["base"], true.base, atol=0.04)
    covariance = np.reshape(flight["covariance"], (4, 4))
    assert 0.0005 < np.sqrt(covariance[0, 0]) < 0.01
    assert (np.linalg.eigvalsh(covariance) > -1e-12).all()
    position_std = np.sqrt(np.diag(np.reshape(flight["pose_covariance"], (6, 6))))
    assert (position_std[:3] > 0).all()
    assert 0 < position_std[5] < np.radians(3.0)
    return dict(flight)


def assert_markers_show(markers: list[dict[str, Any]], flight: dict[str, Any], num_risers: int) -> None:
    """Nosings, box and label are there once each, where the flight is."""
    assert sorted(marker["ns"] for marker in markers) == ["box", "label", "nosings"]
    assert {marker["frame_id"] for marker in markers} == {"map"}
    by_name = {marker["ns"]: marker for marker in markers}
    points = np.array(by_name["nosings"]["points"]).reshape(-1, 2, 3)
    assert len(points) == num_risers
    np.testing.assert_allclose(np.linalg.norm(points[:, 0] - points[:, 1], axis=1), flight["width"])
    np.testing.assert_allclose(points[0, :, 2], flight["base"][2] + flight["rise"])
    np.testing.assert_allclose(by_name["box"]["position"], flight["box_center"])
    np.testing.assert_allclose(by_name["box"]["scale"], flight["box_size"])
    assert f"rise {flight['rise'] * 1e3:.0f} ± " in by_name["label"]["text"]


def num_observations_in(file: Path) -> int:
    """Number of observations of the first stairway in a map file's JSON."""
    if not file.exists():
        return 0
    stairways = json.loads(file.read_text())["stairways"]
    return int(stairways[0]["num_observations"]) if stairways else 0
