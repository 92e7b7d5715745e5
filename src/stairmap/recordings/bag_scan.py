"""One pass over a bag: the stamps of its depth images and what it says about poses, but no image."""

from __future__ import annotations

from array import array
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from stairmap.arrays import IntArray
from stairmap.errors import RecordingError
from stairmap.recordings.bag_file import Bag
from stairmap.recordings.bag_stream import BagMessage
from stairmap.recordings.bag_topics import TRANSFORMS
from stairmap.recordings.message_decoding import header_of
from stairmap.recordings.pose_message import transform_from_pose_message, transforms_from_tf
from stairmap.recordings.transform_buffer import plain_name
from stairmap.recordings.transform_history import TransformHistory
from stairmap.recordings.transform_intake import TransformIntake

MAX_STEP_BACK_NS = 1_000_000_000
"""A stamp that is earlier than the latest by more than this, nanoseconds, means that the clock was reset."""


@dataclass(slots=True)
class PoseTopic:
    """Poses of one topic.

    Attributes
    ----------
    parent, child
        Coordinate frames of the latest message; the child is empty where messages do not name it.
    history
        ``parent_from_child``.
    num_invalid
        Messages whose pose is no rigid transform.
    """

    parent: str = ""
    child: str = ""
    history: TransformHistory = field(default_factory=TransformHistory)
    num_invalid: int = 0


class ScannedStretch:
    """A stretch of a bag without a jump of the clock.

    Parameters
    ----------
    intake
        Where transforms go.
    first_index
        Number of the first depth message, counted over the whole bag.
    """

    def __init__(self, intake: TransformIntake, first_index: int) -> None:
        self.intake = intake
        self.first_index = first_index
        self.num_images = 0
        self.pose_topics: dict[str, PoseTopic] = {}
        self._stamps_ns = array("q")

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) increasing stamps of the depth images; those that do not increase are left out."""
        return np.array(self._stamps_ns, dtype=np.int64)

    def steps_back(self, stamp_ns: int) -> bool:
        """Tell whether a stamp is far before the latest one."""
        return bool(self._stamps_ns) and stamp_ns < self._stamps_ns[-1] - MAX_STEP_BACK_NS

    def add_image(self, stamp_ns: int | None) -> None:
        """Count a depth image; without a stamp if it has none that can be read."""
        self.num_images += 1
        if stamp_ns is not None and (not self._stamps_ns or stamp_ns > self._stamps_ns[-1]):
            self._stamps_ns.append(stamp_ns)


@dataclass(frozen=True, slots=True, kw_only=True)
class BagScan:
    """What a pass over a bag found.

    Attributes
    ----------
    stretch
        The stretch with most depth images.
    stretches
        How many images each stretch has; more than one if the clock was reset.
    depth_end_ns, end_ns
        When the last depth image, and the last message of all that were read, was recorded.
    """

    stretch: ScannedStretch
    stretches: tuple[int, ...]
    depth_end_ns: int
    end_ns: int


def scan_bag(
    bag: Bag,
    *,
    depth_topic: str,
    frame_id: str,
    transform_topics: Collection[str],
    pose_topics: Collection[str],
) -> BagScan:
    """Read the headers of all depth images and all poses.

    Parameters
    ----------
    bag
        The bag.
    depth_topic, frame_id
        Topic of the images and their coordinate frame.
    transform_topics, pose_topics
        Topics of ``TFMessage``, and of odometry or stamped poses.

    Raises
    ------
    RecordingError
        If no depth image has a stamp; as DamagedBagError if the bag cannot be read on.
    """
    stretches = [ScannedStretch(TransformIntake(frame_id), 0)]
    depth_end_ns = end_ns = num_images = 0
    for message in bag.messages({depth_topic, *transform_topics, *pose_topics}):
        stretch = stretches[-1]
        end_ns = max(end_ns, message.recorded_ns)
        if message.topic.name != depth_topic:
            _add_poses(bag, message, stretch)
            continue
        depth_end_ns = max(depth_end_ns, message.recorded_ns)
        stamp_ns = _stamp_of(message)
        if stamp_ns is not None and stretch.steps_back(stamp_ns):
            stretch = ScannedStretch(stretch.intake.with_static_only(), num_images)
            stretches.append(stretch)
        stretch.add_image(stamp_ns)
        num_images += 1
    longest = max(stretches, key=lambda stretch: stretch.num_images)
    if not len(longest.stamps_ns):
        raise RecordingError(f"topic {depth_topic}: no image has a header that can be read")
    return BagScan(
        stretch=longest,
        stretches=tuple(stretch.num_images for stretch in stretches),
        depth_end_ns=depth_end_ns,
        end_ns=end_ns,
    )


def _stamp_of(message: BagMessage) -> int | None:
    try:
        return header_of(message)[0]
    except RecordingError:
        return None


def _add_poses(bag: Bag, message: BagMessage, stretch: ScannedStretch) -> None:
    try:
        decoded = bag.decode(message)
    except RecordingError:
        return
    if message.topic.type in TRANSFORMS:
        is_static = message.topic.name.endswith("tf_static")
        for parent, child, stamp_ns, transform in transforms_from_tf(decoded):
            stretch.intake.take(parent, child, stamp_ns, transform, is_static=is_static)
        return
    poses = stretch.pose_topics.setdefault(message.topic.name, PoseTopic())
    parent, child, stamp_ns, transform = transform_from_pose_message(decoded)
    if transform is None:
        poses.num_invalid += 1
        return
    poses.parent, poses.child = plain_name(parent), plain_name(child)
    poses.history.add(stamp_ns, transform)
