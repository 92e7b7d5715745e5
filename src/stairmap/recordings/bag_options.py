"""What a user may say about a bag, where it cannot be guessed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class BagOptions:
    """What to take of a bag; ``None`` leaves it to be guessed.

    Attributes
    ----------
    depth_topic
        Topic of the depth images.
    camera_info_topic
        Topic of their intrinsics.
    camera_file
        camera.json with the intrinsics, instead of a topic.
    pose_topic
        Topic of poses: transforms, odometry or stamped poses.
    map_frame
        Coordinate frame that is the map.
    cloud_topic
        Topic of a LiDAR's sweeps, to be used instead of depth images.
    """

    depth_topic: str | None = None
    camera_info_topic: str | None = None
    camera_file: Path | None = None
    pose_topic: str | None = None
    map_frame: str | None = None
    cloud_topic: str | None = None
