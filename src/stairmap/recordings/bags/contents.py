"""All that is read of a bag when it is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stairmap.arrays import IntArray
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.depth import BagDepth, find_bag_depth
from stairmap.recordings.bags.poses import BagPoses, find_bag_poses
from stairmap.recordings.bags.scan import BagScan, scan_bag
from stairmap.recordings.bags.stream import BagTopic
from stairmap.recordings.bags.topics import (
    ODOMETRY,
    POSES,
    TRANSFORMS,
    find_topic,
    topics_of_type,
    transform_topics,
)
from stairmap.recordings.base import WatchOpening

MAX_REPEATED_SHARE = 0.05
"""More images than this share with a stamp that was there before are no hiccup of a driver."""

MAX_SILENCE_NS = 2_000_000_000
"""Depth that ends earlier than this before the bag does, nanoseconds, has stopped half-way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BagContents:
    """What a bag holds for us.

    Attributes
    ----------
    topics
        All topics.
    depth
        Depth topic and camera.
    poses
        Where the camera was.
    first_image, num_images
        Which messages of the depth topic count: all, unless the clock was reset.
    stamps_ns
        (N,) increasing stamps of the depth images, in nanoseconds.
    coordinate_frames
        Names of all coordinate frames that transforms name.
    notes
        What is lost or looks strange, one sentence each.
    """

    topics: tuple[BagTopic, ...]
    depth: BagDepth
    poses: BagPoses
    first_image: int
    num_images: int
    stamps_ns: IntArray
    coordinate_frames: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def is_interleaved(self) -> bool:
        """Whether so many stamps repeat that messages of two times have been sorted into each other.

        A recorder on simulated time files messages under that time. Set back, it gives stamps twice, and an
        index, which sorts by time, mixes the two drives; the order in the file still tells them apart.
        """
        return self.num_images - len(self.stamps_ns) > MAX_REPEATED_SHARE * self.num_images


def read_bag_contents(
    bag: Bag, options: BagOptions, *, with_poses: bool, watch: WatchOpening | None = None
) -> BagContents:
    """Read all of a bag but the images.

    Parameters
    ----------
    bag
        The bag.
    options
        What to take of it where it cannot be guessed.
    with_poses
        Whether its poses are wanted.
    watch
        Is told how far the reading is.

    Raises
    ------
    RecordingError
        See ``BagRecording``; as DamagedBagError if the bag cannot be read on.
    """
    depth = find_bag_depth(bag, options)
    transforms, poses = find_pose_topics(bag.topics, options.pose_topic) if with_poses else ((), ())
    scan = scan_bag(
        bag,
        depth_topic=depth.topic,
        frame_id=depth.frame_id,
        map_frame=options.map_frame,
        transform_topics=[topic.name for topic in transforms],
        pose_topics=[topic.name for topic in poses],
        watch=watch,
    )
    chosen = find_chosen_topic((*transforms, *poses), options.pose_topic)
    found = find_bag_poses(
        scan.stretch,
        pose_topic=None if chosen is None else chosen.name,
        is_transform_topic=chosen is not None and chosen.type in TRANSFORMS,
        map_frame=options.map_frame if with_poses else None,
    )
    return BagContents(
        topics=bag.topics,
        depth=depth,
        poses=found,
        first_image=scan.stretch.first_index,
        num_images=scan.stretch.num_images,
        stamps_ns=scan.stretch.stamps_ns,
        coordinate_frames=scan.stretch.intake.coordinate_frames,
        notes=(*bag.notes, *depth.notes, *_find_oddities(depth, scan), *found.notes),
    )


def find_chosen_topic(topics: Sequence[BagTopic], name: str | None) -> BagTopic | None:
    """Return the topic that a user named, with or without its leading slash; ``None`` if none is."""
    if name is None:
        return None
    return next((topic for topic in topics if topic.name.lstrip("/") == name.lstrip("/")), None)


def find_pose_topics(
    topics: Sequence[BagTopic], wanted: str | None
) -> tuple[tuple[BagTopic, ...], tuple[BagTopic, ...]]:
    """Return the topics of transforms and of poses to read.

    Raises
    ------
    RecordingError
        If the user named one that is not there.
    """
    transforms = transform_topics(topics)
    if wanted is None:
        return transforms, topics_of_type(topics, ODOMETRY, *POSES)
    topic = find_topic(topics, wanted, *TRANSFORMS, ODOMETRY, *POSES, option="--pose-topic")
    if topic.type not in TRANSFORMS:
        return transforms, (topic,)
    static = [other for other in topics_of_type(topics, *TRANSFORMS) if other.name.endswith("tf_static")]
    return (topic, *(other for other in static if other != topic)), ()


def _find_oddities(depth: BagDepth, scan: BagScan) -> list[str]:
    notes = []
    if len(scan.stretches) > 1:
        num_resets = len(scan.stretches) - 1
        notes.append(
            f"the clock of {depth.topic} was set back {num_resets} time{'s' if num_resets > 1 else ''}; of "
            f"its {sum(scan.stretches)} images the {scan.stretch.num_images} of the longest stretch are used"
        )
    silence_ns = scan.end_ns - scan.depth_end_ns
    if silence_ns > MAX_SILENCE_NS:
        notes.append(f"{depth.topic} ends {silence_ns * 1e-9:.1f} s before the bag does")
    return notes
