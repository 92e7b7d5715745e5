"""What a bag holds, as ``stairmap inspect`` prints it: for a user who has never seen it before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stairmap.cli.plain_table import format_columns
from stairmap.errors import StairmapError
from stairmap.recordings.bags.bag import Bag, is_bag
from stairmap.recordings.bags.recording import BagRecording
from stairmap.recordings.bags.stream import BagTopic


def describe_bag(recording: BagRecording) -> dict[str, Any]:
    """Return what was taken of a bag, and what else it holds, as JSON values."""
    contents = recording.contents
    return {
        "depth_topic": contents.depth.topic,
        "camera_info": contents.depth.camera_info,
        "camera_frame": contents.depth.frame_id,
        "map_frame": recording.frame_id,
        "pose_source": recording.pose_source,
        "pose_problem": contents.poses.problem if recording.trajectory is None else None,
        "coordinate_frames": list(contents.coordinate_frames),
        "topics": describe_topics(contents.topics),
    }


def describe_topics(topics: Sequence[BagTopic]) -> list[dict[str, Any]]:
    """Return topics as JSON values."""
    return [{"name": topic.name, "type": topic.type, "num_messages": topic.num_messages} for topic in topics]


def find_topics(path: Path) -> tuple[BagTopic, ...]:
    """Return the topics of a bag that cannot be used as a recording; none if it is no bag."""
    try:
        return Bag(path).topics if is_bag(path) else ()
    except (StairmapError, OSError):
        return ()


def format_bag_rows(bag: dict[str, Any]) -> dict[str, str]:
    """Return what was taken of a bag as rows of a table."""
    return {
        "depth topic": bag["depth_topic"],
        "camera info": bag["camera_info"],
        "camera frame": bag["camera_frame"] or "not named",
        "poses from": f"none: {bag['pose_problem']}" if bag["pose_problem"] else bag["pose_source"],
        "coord. frames": ", ".join(bag["coordinate_frames"]) or "none",
    }


def format_topics(topics: Sequence[dict[str, Any]]) -> str:
    """Return a table of topics."""
    rows = [(topic["name"], topic["type"], str(topic["num_messages"])) for topic in topics]
    return format_columns(("topic", "type", "messages"), rows, left_aligned=("topic", "type"))
