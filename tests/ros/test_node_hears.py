"""Ordinary robots are heard: slow transforms, other topics, transports and units; and what is odd is said."""

from __future__ import annotations

import pytest
from node_answers import assert_is_the_stairway
from ros_environment import Drive, RosEnvironment

pytestmark = pytest.mark.usefixtures("wheels")


def test_slow_odometry_and_corrections_lose_no_image(ros: RosEnvironment) -> None:
    """Odometry of 5 Hz with jitter and losses, and map -> odom that moves by 5 cm each second."""
    ros.start_node()
    order = {"mode": "hear", "odometry_every": 2, "correction_every": 10, "period": 0.1}
    (outcome,) = ros.run_robot([order])
    assert outcome["answered"], outcome["diagnostics"][-1]
    before, after = outcome["diagnostics"][0]["values"], outcome["diagnostics"][-1]["values"]
    num = {key: int(after[key]) - int(before[key]) for key in after if key.startswith("images")}
    assert num["images received"] > 60
    assert num["images processed"] >= 0.95 * num["images received"], num


def test_rvl_on_a_remapped_topic_and_latched_camera_info_are_taken(ros: RosEnvironment, drive: Drive) -> None:
    """The remap names the image's topic: its compressed copy moves along."""
    ros.start_node(depth_transport="compressedDepth", remaps={"depth/image_rect_raw": "/front/depth/image"})
    order = {"compressed": "rvl", "topic": "/front/depth/image", "latched_info": True, "distortion": 0.2}
    (outcome,) = ros.run_robot([order])
    assert outcome["answered"]
    assert_is_the_stairway(outcome, drive.true_flight)
    notes = outcome["diagnostics"][-1]["values"]["notes"]
    assert notes.startswith("/depth/camera_info: CameraInfo has distortion (up to 0.2), which is not undone")


def test_raw_units_are_told_and_taken(ros: RosEnvironment, drive: Drive) -> None:
    """An L515 without its driver: 0.25 mm. Two nodes listen, and one of them was told."""
    ros.start_node(name="untold")
    ros.start_node(depth_unit=0.00025)
    (outcome,) = ros.run_robot([{"depth_factor": 4, "until_others": {"untold": "another unit"}}])
    assert_is_the_stairway(outcome, drive.true_flight)
    told = [text for text in outcome["others"]["untold"] if "another unit" in text]
    assert told[0].startswith("depth fits the camera's way only if it is 0.25 times what was read")
    assert told[0].endswith("set depth_unit to 0.00025")


def test_missing_packages_clocks_and_coordinate_frames_are_told_by_nodes_that_run(
    ros: RosEnvironment,
) -> None:
    """Three nodes hear one robot."""
    ros.start_node(name="timeless", use_sim_time="true")
    ros.start_node(name="lost", map_frame="world", max_transform_wait=0.1)
    ros.start_node(without_package="vision_msgs")
    (outcome,) = ros.run_robot([{"until_others": {"timeless": "/clock", "lost": "world"}}])
    assert outcome["answered"], outcome["others"]
    assert outcome["stairways"]
    assert outcome["detections"] == []
    assert any(
        text.startswith("use_sim_time is true, but nothing comes on /clock")
        for text in outcome["others"]["timeless"]
    )
    assert (
        "no pose of the camera: no coordinate frame 'world'; there are: base_link, "
        "camera_depth_optical_frame, map, odom"
    ) in outcome["others"]["lost"]
