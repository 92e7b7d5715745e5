"""The node always says why nothing comes."""

from __future__ import annotations

import numpy as np

from stairmap.detection.observation import Detection, Rejection
from stairmap_ros.node_status import Level, NodeStatus
from stairmap_ros.time_jumps import TimeJumps

TOPICS = {"/depth": "depth image", "/info": "camera_info"}
NOTHING = Detection(
    stamp_ns=0,
    observations=(),
    rejections=(Rejection(rule="min_steps", measured=2.0, limit=3.0, unit="1"),),
)


def new_status() -> NodeStatus:
    return NodeStatus(TOPICS, max_silence=5.0, now=0.0)


def test_the_silent_topic_is_named() -> None:
    status = new_status()
    status.message_came("/depth", 5.9)
    said = status.status(0, None, 6.0)
    assert said.level is Level.WARN
    assert said.message == (
        "no depth image with its camera_info for 6.0 s: no camera_info ever came on /info"
    )


def test_a_topic_that_stops_half_way_is_named_with_its_silence() -> None:
    status = new_status()
    for topic in TOPICS:
        status.message_came(topic, 1.0)
    status.pair_came(1.0)
    status.message_came("/info", 9.0)
    said = status.status(0, None, 9.0)
    assert said.message == "no depth image with its camera_info for 8.0 s: no depth image on /depth for 8.0 s"


def test_nothing_is_wrong_before_the_first_images() -> None:
    said = new_status().status(0, None, 2.0)
    assert (said.level, said.message) == (Level.OK, "waiting for the first image")


def test_a_missing_transform_is_told_when_no_image_can_be_placed() -> None:
    status = new_status()
    status.pair_came(3.0)
    assert status.status(0, "no coordinate frame 'map'", 3.0).level is Level.WARN
    status.processed(NOTHING, 3.0)
    assert status.status(0, "no coordinate frame 'map'", 3.5).level is Level.OK


def test_a_refused_image_is_an_error_with_its_reason() -> None:
    status = new_status()
    status.pair_came(3.0)
    status.refuse("expected depth, got 'rgb8'", 3.0)
    said = status.status(0, None, 3.0)
    assert (said.level, said.message) == (Level.ERROR, "expected depth, got 'rgb8'")


def test_without_a_stairway_the_last_rejection_is_told() -> None:
    status = new_status()
    status.pair_came(3.0)
    status.processed(NOTHING, 3.0)
    assert status.status(0, None, 3.0).message == "no stairway: the last image fails min_steps: 2, limit 3"
    assert status.status(2, None, 3.0).message == "2 stairways"
    assert status.values(4, 5)["reason against the last image"] == "min_steps: 2, limit 3"


def test_numbers_are_counted() -> None:
    status = new_status()
    status.pair_came(0.0)
    status.processed(NOTHING, 0.0)
    for delay in np.linspace(0.01, 0.03, 5):
        status.published(float(delay))
    values = status.values(4, 5)
    assert values["images superseded by newer ones"] == "4"
    assert values["images dropped without a transform"] == "5"
    assert values["images processed"] == "1"
    assert values["delay of the last 100 results, ms"] == "20 median, 30 longest"
    assert values["kernels"].startswith(("compiled", "NumPy, several times slower: "))


def test_a_stamp_that_was_never_set_is_no_jump_in_time() -> None:
    jumps = TimeJumps()
    assert jumps.find("images", 10**18) == 0
    assert jumps.find("images", 0) == 0
    assert jumps.find("images", 10**18 + 1) == 0


def test_only_a_clear_step_back_is_a_jump_in_time() -> None:
    jumps = TimeJumps()
    second = 1_000_000_000
    assert jumps.find("images", 100 * second) == 0
    assert jumps.find("images", 99 * second + second // 2) == 0
    assert jumps.find("/tf of odom", 90 * second) == 0
    assert jumps.find("images", 10 * second) == 90 * second
    assert jumps.find("/tf of odom", 10 * second) == 0
    assert jumps.find("images", 11 * second) == 0
