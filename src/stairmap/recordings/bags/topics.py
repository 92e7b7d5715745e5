"""Which topics of a bag hold depth, its camera and its poses, where the user does not say."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence

from stairmap.errors import RecordingError
from stairmap.recordings.bags.stream import BagTopic
from stairmap.recordings.depth_message import DEPTH_ENCODINGS

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
ODOMETRY = "nav_msgs/msg/Odometry"
CLOUDS = (
    "sensor_msgs/msg/PointCloud2",
    "livox_ros_driver2/msg/CustomMsg",
    "livox_ros_driver/msg/CustomMsg",
)
"""Types of a LiDAR's sweeps."""

POSES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)

_MAX_LISTED = 12
_TRANSPORTS = ("/compressedDepth", "/compressed")


def topics_of_type(topics: Iterable[BagTopic], *types: str) -> tuple[BagTopic, ...]:
    """Return the topics of some types that have a message."""
    return tuple(topic for topic in topics if topic.type in types and topic.num_messages)


def find_topic(topics: Sequence[BagTopic], name: str, *types: str, option: str) -> BagTopic:
    """Return a topic that the user named.

    Raises
    ------
    RecordingError
        If there is none of this name, it has no message, or is of another type.
    """
    found = next((topic for topic in topics if name in {topic.name, topic.name.lstrip("/")}), None)
    usable = topics_of_type(topics, *types)
    if found is None:
        near = difflib.get_close_matches(name, [topic.name for topic in usable], n=1, cutoff=0.0)
        advice = f"; did you mean {near[0]}?" if near else ""
        raise RecordingError(f"{option} {name}: there is no such topic{advice} {listed(usable)}")
    if found.type not in types:
        raise RecordingError(
            f"{option} {name}: expected a topic of type {' or '.join(types)}, it is {found.type}; "
            f"{listed(usable)}"
        )
    if not found.num_messages:
        raise RecordingError(f"{option} {name}: the topic has no messages; {listed(usable)}")
    return found


def guess_depth_topic(topics: Sequence[BagTopic], encodings: Mapping[str, str]) -> BagTopic:
    """Return the only topic with depth images.

    Parameters
    ----------
    topics
        All topics.
    encodings
        Encoding or format of the first image of image topics, by topic.

    Raises
    ------
    RecordingError
        If there is none, or there are several.
    """
    images = topics_of_type(topics, IMAGE, COMPRESSED_IMAGE)
    candidates = [topic for topic in images if _is_depth(topic, encodings.get(topic.name))]
    names = {topic.name for topic in candidates}
    # Of one image raw and compressed, the raw one is read faster and is not rounded.
    candidates = [topic for topic in candidates if base_topic(topic.name) not in names - {topic.name}]
    if len(candidates) == 1:
        return candidates[0]
    if candidates:
        raise RecordingError(
            f"there are {len(candidates)} topics with depth images; pass one of them with --depth-topic: "
            + ", ".join(topic.name for topic in candidates)
        )
    if images:
        there_are = ", ".join(f"{topic.name} ({encodings.get(topic.name, '?')})" for topic in images)
        raise RecordingError(
            f"no topic has depth images (16UC1, 32FC1 or compressedDepth); there are images on: {there_are}"
        )
    clouds = topics_of_type(topics, *CLOUDS)
    advice = "; stairmap run finds stairs in point clouds too, with --cloud-topic" if clouds else ""
    raise RecordingError(f"no topic has depth images; {listed(tuple(topics))}{advice}")


def has_depth_topic(topics: Sequence[BagTopic], encodings: Mapping[str, str]) -> bool:
    """Tell whether there are depth images; see ``guess_depth_topic``."""
    images = topics_of_type(topics, IMAGE, COMPRESSED_IMAGE)
    return any(_is_depth(topic, encodings.get(topic.name)) for topic in images)


def guess_cloud_topic(topics: Sequence[BagTopic]) -> BagTopic:
    """Return the only topic with sweeps of a LiDAR.

    Raises
    ------
    RecordingError
        If there is none, or there are several.
    """
    candidates = topics_of_type(topics, *CLOUDS)
    if len(candidates) == 1:
        return candidates[0]
    if candidates:
        raise RecordingError(
            f"there are {len(candidates)} topics with point clouds; pass that of the LiDAR itself with "
            "--cloud-topic: " + ", ".join(topic.name for topic in candidates)
        )
    raise RecordingError(f"no topic has point clouds; {listed(tuple(topics))}")


def guess_camera_info_topic(topics: Sequence[BagTopic], depth_topic: str) -> BagTopic:
    """Return the CameraInfo topic that shares most of its name with the depth topic.

    Raises
    ------
    RecordingError
        If there is none, or several share as much.
    """
    candidates = topics_of_type(topics, CAMERA_INFO)
    advice = "record it too, or pass --camera camera.json with the intrinsics"
    if not candidates:
        raise RecordingError(f"topic {depth_topic} has no CameraInfo, nor has any other; {advice}")
    scores = [_num_shared(topic.name, base_topic(depth_topic)) for topic in candidates]
    best = [topic for topic, score in zip(candidates, scores, strict=True) if score == max(scores)]
    if len(candidates) == 1 or (len(best) == 1 and max(scores) > 0):
        return best[0]
    raise RecordingError(
        f"cannot tell which CameraInfo belongs to {depth_topic}; pass one of them with --camera-info-topic: "
        + ", ".join(topic.name for topic in candidates)
    )


def transform_topics(topics: Sequence[BagTopic]) -> tuple[BagTopic, ...]:
    """Return ``/tf`` and ``/tf_static``, or whatever topics of their type there are."""
    candidates = topics_of_type(topics, *TRANSFORMS)
    usual = tuple(topic for topic in candidates if topic.name in {"/tf", "/tf_static"})
    return usual or candidates


def base_topic(name: str) -> str:
    """Return an image topic without the transport that its publisher appends."""
    for transport in _TRANSPORTS:
        name = name.removesuffix(transport)
    return name


def listed(topics: Sequence[BagTopic]) -> str:
    """Return ``there are: /a (type), /b (type)``."""
    if not topics:
        return "there are none"
    names = [f"{topic.name} ({topic.type})" for topic in topics if topic.num_messages]
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return f"there are: {', '.join(names[:_MAX_LISTED])}{more}"


def _is_depth(topic: BagTopic, encoding: str | None) -> bool:
    has_depth_name = "depth" in topic.name.lower()
    if encoding is None:
        return has_depth_name
    if topic.type == COMPRESSED_IMAGE:
        return "compressedDepth" in encoding or encoding.partition(";")[0] in {"16UC1", "32FC1"}
    # Infrared images are of 16 bits too.
    return encoding in DEPTH_ENCODINGS and (encoding != "mono16" or has_depth_name)


def _num_shared(name: str, other: str) -> int:
    """How many leading parts two topics share."""
    count = 0
    for mine, its in zip(name.strip("/").split("/"), other.strip("/").split("/"), strict=False):
        if mine != its:
            break
        count += 1
    return count
