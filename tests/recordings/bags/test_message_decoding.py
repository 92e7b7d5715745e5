"""Messages are decoded by the bag's definition, or the usual one where it has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bag_files import OPTICAL, Ros
from stairmap.errors import RecordingError
from stairmap.recordings.bags.message_decoding import MessageDecoder, header_of
from stairmap.recordings.bags.stream import CDR, ROS1, BagMessage, BagTopic, plain_type

STAMP_NS = 1_700_000_000_123_456_789


def encoded(kind: str, *, definition: bool = False, is_little: bool = True) -> BagMessage:
    """A transform as a message of ROS 1 or 2."""
    ros = Ros(kind)
    message = ros.odometry(STAMP_NS, OPTICAL, "base", np.eye(4))
    name = message.__msgtype__
    if ros.is_ros1:
        data = ros.store.serialize_ros1(message, name)
    else:
        data = ros.store.serialize_cdr(message, name, little_endian=is_little)
    text = ros.store.generate_msgdef(name, ros_version=1 if ros.is_ros1 else 2)[0] if definition else ""
    topic = BagTopic(name="/odom", type=name, encoding=ROS1 if ros.is_ros1 else CDR, definition=text)
    return BagMessage(topic=topic, recorded_ns=0, data=bytes(data))


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
@pytest.mark.parametrize("definition", [True, False])
def test_message_is_decoded_with_and_without_a_definition(kind: str, definition: bool) -> None:
    decoded = MessageDecoder().decode(encoded(kind, definition=definition))
    assert (decoded.header.frame_id, decoded.child_frame_id) == (OPTICAL, "base")


@pytest.mark.parametrize(
    "message",
    [encoded("ros1"), encoded("mcap"), encoded("mcap", is_little=False)],
    ids=["ros1", "cdr", "cdr big-endian"],
)
def test_header_is_read_without_decoding_the_rest(message: BagMessage) -> None:
    assert header_of(message) == (STAMP_NS, OPTICAL)
    assert header_of(replace(message, data=message.data[:60])) == (STAMP_NS, OPTICAL)


def test_broken_bytes_are_an_error_of_the_recording() -> None:
    message = encoded("mcap")
    for data in (b"", message.data[:9], message.data[:100], b"\xff" * 50):
        with pytest.raises(RecordingError, match="the message is no nav_msgs/msg/Odometry"):
            MessageDecoder().decode(replace(message, data=data))
    for data in (b"", message.data[:20]):
        with pytest.raises(RecordingError, match="header"):
            header_of(replace(message, data=data))


def test_type_that_nobody_knows_is_named() -> None:
    message = encoded("mcap")
    strange = replace(message, topic=replace(message.topic, type="robot_msgs/msg/Mood"))
    with pytest.raises(RecordingError, match="does not define robot_msgs/msg/Mood"):
        MessageDecoder().decode(strange)
    json = replace(message, topic=replace(message.topic, encoding="json"))
    with pytest.raises(RecordingError, match="topic /odom is encoded as 'json'"):
        MessageDecoder().decode(json)
    broken = replace(message, topic=replace(message.topic, definition="}{ 5 =="))
    with pytest.raises(RecordingError, match=r"definition of nav_msgs/msg/Odometry is broken"):
        MessageDecoder().decode(broken)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("string child_frame_id", "string child_frame_iD"),
        ("float64 w", "float64 v"),
        ("float64 w", "float64[] w"),
    ],
)
def test_definition_that_lacks_a_usual_field_is_an_error_of_the_recording(right: str, wrong: str) -> None:
    message = encoded("mcap", definition=True)
    assert right in message.topic.definition
    spoilt = replace(message.topic, definition=message.topic.definition.replace(right, wrong))
    with pytest.raises(RecordingError, match=rf"is broken: .* no such field '{right.split()[1]}'"):
        MessageDecoder().decode(replace(message, topic=spoilt))


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("sensor_msgs/Image", "sensor_msgs/msg/Image"),
        ("sensor_msgs/msg/Image", "sensor_msgs/msg/Image"),
        ("Image", "Image"),
    ],
)
def test_types_are_spelt_as_in_ros2(name: str, plain: str) -> None:
    assert plain_type(name) == plain
