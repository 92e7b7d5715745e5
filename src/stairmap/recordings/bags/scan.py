"""One pass over a bag: the stamps of its depth images and what it says about poses, but no image."""

from __future__ import annotations

from array import array
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from stairmap.arrays import IntArray, Transform
from stairmap.errors import RecordingError
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.pose_message import transform_from_pose_message, transforms_from_tf
from stairmap.recordings.bags.stream import BagMessage
from stairmap.recordings.bags.topics import TRANSFORMS
from stairmap.recordings.bags.transform_intake import TransformIntake
from stairmap.recordings.base import WatchOpening
from stairmap.recordings.transform_buffer import plain_name
from stairmap.recordings.transform_history import TransformHistory

MAX_WAITING = 10_000
"""So many poses at most wait for the next depth image."""

WATCH_EVERY = 100
"""Messages between two reports of how far a pass is."""

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

    @property
    def last_ns(self) -> int:
        """Stamp of the latest depth image, in nanoseconds; 0 before the first."""
        return self._stamps_ns[-1] if self._stamps_ns else 0

    def add_pose(
        self, topic: str, parent: str, child: str, stamp_ns: int, transform: Transform | None
    ) -> None:
        """Take a (4, 4) ``parent_from_child`` of a topic of poses; ``None`` is counted as invalid."""
        poses = self.pose_topics.setdefault(topic, PoseTopic())
        if transform is None:
            poses.num_invalid += 1
            return
        poses.parent, poses.child = plain_name(parent), plain_name(child)
        poses.history.add(stamp_ns, transform)

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
    map_frame: str | None,
    transform_topics: Collection[str],
    pose_topics: Collection[str],
    watch: WatchOpening | None = None,
) -> BagScan:
    """Read the headers of all depth images and all poses.

    Parameters
    ----------
    bag
        The bag.
    depth_topic, frame_id
        Topic of the images and their coordinate frame.
    map_frame
        Coordinate frame that the user wants as the map.
    transform_topics, pose_topics
        Topics of ``TFMessage``, and of odometry or stamped poses.
    watch
        Is told how far the pass is.

    Raises
    ------
    RecordingError
        If no depth image has a stamp; as DamagedBagError if the bag cannot be read on.
    """
    stretches = [ScannedStretch(TransformIntake(frame_id, also=map_frame), 0)]
    waiting: list[BagMessage] = []
    depth_end_ns = end_ns = num_images = 0
    names = {depth_topic, *transform_topics, *pose_topics}
    total = sum(topic.num_messages for topic in bag.topics if topic.name in names)
    for count, message in enumerate(bag.messages(names)):
        if watch is not None and count % WATCH_EVERY == 0:
            watch(count, total)
        stretch = stretches[-1]
        end_ns = max(end_ns, message.recorded_ns)
        if message.topic.name != depth_topic:
            waiting.append(message)
            if len(waiting) > MAX_WAITING:
                _add_poses(bag, waiting, stretch)
            continue
        depth_end_ns = max(depth_end_ns, message.recorded_ns)
        stamp_ns = _stamp_of(message)
        if stamp_ns is not None and stretch.steps_back(stamp_ns):
            stretches.append(ScannedStretch(stretch.intake.with_static_only(), num_images))
            _add_poses(bag, waiting, stretch, stretches[-1], stamp_ns)
        else:
            _add_poses(bag, waiting, stretch)
        stretches[-1].add_image(stamp_ns)
        num_images += 1
    _add_poses(bag, waiting, stretches[-1])
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


def _add_poses(
    bag: Bag,
    waiting: list[BagMessage],
    stretch: ScannedStretch,
    next_stretch: ScannedStretch | None = None,
    next_ns: int = 0,
) -> None:
    """Empty the list of messages into a stretch, or each into that of two whose image is nearer in time."""

    def choose(stamp_ns: int) -> ScannedStretch:
        if next_stretch is None or abs(stamp_ns - stretch.last_ns) < abs(stamp_ns - next_ns):
            return stretch
        return next_stretch

    for message in waiting:
        try:
            decoded = bag.decode(message)
        except RecordingError:
            continue
        name = message.topic.name
        if message.topic.type not in TRANSFORMS:
            parent, child, stamp_ns, transform = transform_from_pose_message(decoded)
            choose(stamp_ns).add_pose(name, parent, child, stamp_ns, transform)
            continue
        for parent, child, stamp_ns, transform in transforms_from_tf(decoded):
            choose(stamp_ns).intake.take(
                parent, child, stamp_ns, transform, is_static=name.endswith("tf_static")
            )
    waiting.clear()
