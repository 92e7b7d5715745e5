"""Bags with the sweeps of a LiDAR as recordings: ``PointCloud2`` and Livox's own message (docs/clouds.md)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stairmap.arrays import IntArray, Transform
from stairmap.errors import RecordingError, TrajectoryError
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.contents import find_chosen_topic, find_pose_topics
from stairmap.recordings.bags.livox_message import sweep_from_livox
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.poses import BagPoses, find_bag_poses
from stairmap.recordings.bags.scan import BagScan, scan_bag
from stairmap.recordings.bags.stream import BagMessage, DamagedBagError
from stairmap.recordings.bags.topics import CLOUDS, TRANSFORMS, find_topic, guess_cloud_topic
from stairmap.recordings.base import RecordingProblems, SkippedFrame, WatchOpening
from stairmap.recordings.cloud_message import sweep_from_cloud
from stairmap.recordings.map_up import UP_AUTO, check_up, map_from_recorded_with_up, turned_trajectory
from stairmap.recordings.pose_coverage import find_implausible_speed
from stairmap.recordings.pose_format import check_has_poses, trajectory_from_format
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.sweep import Sweep
from stairmap.trajectory import Trajectory

POSE_STEP_NS = 20_000_000
"""Poses within a sweep are taken this far apart, nanoseconds: bodies swing at a few hertz."""

MAX_POSE_GAP_NS = 150_000_000
"""Poses farther apart are not interpolated, nanoseconds: SLAM gives ten a second, and their stamps
jitter."""

NUM_SWEEPS_PEEKED = 20
"""So many sweeps at most are read at opening to learn whether points carry times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepContents:
    """What a bag holds of a LiDAR.

    Attributes
    ----------
    topic, type, frame_id
        Topic and type of the sweeps, and their coordinate frame.
    span_ns
        Times of points after the stamp, from the first to the last; zeros where they carry none.
    poses
        Where the LiDAR was.
    scan
        The stamps, and how far the clock was set back.
    """

    topic: str
    type: str
    frame_id: str
    span_ns: tuple[int, int]
    poses: BagPoses
    scan: BagScan


class SweepRecording:
    """A bag with the sweeps of a LiDAR and its poses.

    It is read once when it is opened, for stamps and poses; sweeps are decoded while one iterates and never
    kept.

    Parameters
    ----------
    path
        See ``Bag``.
    trajectory
        TUM trajectory of the LiDAR to use instead of the bag's own poses.
    up
        Axis of the map's coordinate frame that points up, ``+z`` if not given.
    pose_format
        See ``open_recording``.
    options
        What to take of the bag where it cannot be guessed.
    watch
        Is told how far the reading at opening is.

    Raises
    ------
    RecordingError
        If it is no bag, or has no sweeps, or it cannot be told which; the message lists what there is.
    TrajectoryError
        If poses that were asked for are not there or malformed.
    """

    def __init__(
        self,
        path: Path,
        *,
        trajectory: Path | None = None,
        up: str | None = None,
        pose_format: str | None = None,
        options: BagOptions | None = None,
        watch: WatchOpening | None = None,
    ) -> None:
        if up is not None and check_up(up) == UP_AUTO:
            raise RecordingError(
                f"--up {UP_AUTO} asks the floor in depth images, but {path} is read as sweeps; name the axis "
                "of the map that points up, such as --up=-y"
            )
        self._bag = Bag(path)
        options = options or BagOptions()
        loaded = None if trajectory is None else load_tum_trajectory(trajectory)
        self._own_poses = loaded is None
        self._contents = self._read(options, watch)
        poses = self._contents.poses.trajectory if loaded is None else loaded
        check_has_poses(poses, pose_format)
        poses = None if poses is None else trajectory_from_format(poses, pose_format)
        self._map_from_recorded = map_from_recorded_with_up(up or "+z")
        self._trajectory = None if poses is None else turned_trajectory(self._map_from_recorded, poses)
        self._notes = self._find_notes()
        self._skipped: list[SkippedFrame] = []

    @property
    def name(self) -> str:
        """Name of the bag without its ending."""
        return self._bag.name

    @property
    def num_sweeps(self) -> int:
        """Number of sweeps that count, those included that turn out to be damaged."""
        return self._contents.scan.stretch.num_images

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all sweeps declared, in nanoseconds."""
        return self._contents.scan.stretch.stamps_ns

    @property
    def frame_id(self) -> str:
        """Name of the map's coordinate frame; ``map`` without poses of the bag's own."""
        return self._contents.poses.frame_id if self._own_poses else "map"

    @property
    def contents(self) -> SweepContents:
        """What was taken of the bag."""
        return self._contents

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) turn of the bag's map into the map with z up; identity unless ``up`` asks for one."""
        return self._map_from_recorded.copy()

    @property
    def problems(self) -> RecordingProblems:
        """What the latest iteration skipped, and what looks strange."""
        return RecordingProblems(skipped=tuple(self._skipped), notes=self._notes)

    def check_poses(self) -> Trajectory:
        """Return ``map_from_sensor`` if it gives at least one sweep a pose.

        Raises
        ------
        TrajectoryError
            If there are no poses, or no sweep has one.
        """
        if self._trajectory is None:
            raise TrajectoryError(
                f"expected poses of the LiDAR in {self._bag.path}: {self._contents.poses.problem}; pass "
                "--trajectory FILE (TUM format) with poses of the LiDAR's own coordinate frame"
            )
        if not self._trajectory.has_pose(self.stamps_ns, max_gap_ns=MAX_POSE_GAP_NS).any():
            first, last = self.stamps_ns[[0, -1]] * 1e-9
            pose_first, pose_last = self._trajectory.stamps_ns[[0, -1]] * 1e-9
            raise TrajectoryError(
                f"none of the {self.num_sweeps} sweeps has a pose: sweeps run from {first:.3f} to {last:.3f} "
                f"s, poses from {pose_first:.3f} to {pose_last:.3f} s; give poses of the same clock "
                "at 7 Hz or more"
            )
        return self._trajectory

    def __iter__(self) -> Iterator[Sweep]:
        """Read the sweeps one by one; those that cannot be used are skipped and stand in ``problems``.

        Raises
        ------
        RecordingError
            At the end, if no sweep could be read.
        """
        skipped = self._skipped = []
        latest_ns = -1
        for message in self._messages():
            stamp_ns = message.recorded_ns
            try:
                stamp_ns = header_of(message)[0]
                if stamp_ns <= latest_ns:
                    raise RecordingError(
                        f"its stamp is not after that of the sweep before, {latest_ns * 1e-9:.6f} s"
                    )
                sweep = self._decode(message)
            except RecordingError as error:
                skipped.append(SkippedFrame(stamp_ns=stamp_ns, source=message.topic.name, reason=str(error)))
                continue
            latest_ns = stamp_ns
            yield sweep
        if len(skipped) == self.num_sweeps:
            raise RecordingError(
                f"none of the {self.num_sweeps} sweeps of {self._bag.path} can be read; the first: "
                f"{skipped[0]}"
            )

    def _messages(self) -> Iterator[BagMessage]:
        """The messages of the stretch that counts."""
        stretch = self._contents.scan.stretch
        for index, message in enumerate(self._bag.messages([self._contents.topic])):
            if index >= stretch.first_index + stretch.num_images:
                return
            if index >= stretch.first_index:
                yield message

    def _decode(self, message: BagMessage) -> Sweep:
        if self._contents.type == CLOUDS[0]:
            return sweep_from_cloud(self._bag.decode(message))
        return sweep_from_livox(message)

    def _read(self, options: BagOptions, watch: WatchOpening | None) -> SweepContents:
        with suppress(DamagedBagError):
            return self._read_contents(options, watch)
        self._bag.read_in_order()
        return self._read_contents(options, watch)

    def _read_contents(self, options: BagOptions, watch: WatchOpening | None) -> SweepContents:
        if options.cloud_topic is None:
            topic = guess_cloud_topic(self._bag.topics)
        else:
            topic = find_topic(self._bag.topics, options.cloud_topic, *CLOUDS, option="--cloud-topic")
        frame_id, span_ns = self._peek(topic.name, topic.type)
        transforms, poses = (
            find_pose_topics(self._bag.topics, options.pose_topic) if self._own_poses else ((), ())
        )
        scan = scan_bag(
            self._bag,
            depth_topic=topic.name,
            frame_id=frame_id,
            map_frame=options.map_frame,
            transform_topics=[other.name for other in transforms],
            pose_topics=[other.name for other in poses],
            watch=watch,
        )
        chosen = find_chosen_topic((*transforms, *poses), options.pose_topic)
        found = find_bag_poses(
            scan.stretch,
            pose_topic=None if chosen is None else chosen.name,
            is_transform_topic=chosen is not None and chosen.type in TRANSFORMS,
            map_frame=options.map_frame if self._own_poses else None,
            stamps_ns=_with_times_between(scan.stretch.stamps_ns, span_ns),
        )
        return SweepContents(
            topic=topic.name, type=topic.type, frame_id=frame_id, span_ns=span_ns, poses=found, scan=scan
        )

    def _peek(self, topic: str, kind: str) -> tuple[str, tuple[int, int]]:
        """Return coordinate frame and span of the points' times of the first sweep with points.

        Raises
        ------
        RecordingError
            If none of the first sweeps can be read.
        """
        reason = "none has a point"
        for count, message in enumerate(self._bag.messages([topic])):
            if count >= NUM_SWEEPS_PEEKED:
                break
            try:
                frame_id = header_of(message)[1]
                is_cloud = kind == CLOUDS[0]
                sweep = sweep_from_cloud(self._bag.decode(message)) if is_cloud else sweep_from_livox(message)
            except RecordingError as error:
                reason = str(error)
                continue
            if len(sweep):
                offsets = sweep.offsets_ns
                span = (0, 0) if offsets is None else (int(offsets.min()), int(offsets.max()))
                return frame_id.lstrip("/"), span
        raise RecordingError(f"topic {topic}: no sweep can be used; the last reason: {reason}")

    def _find_notes(self) -> tuple[str, ...]:
        contents, notes = self._contents, [*self._bag.notes]
        num_resets = len(contents.scan.stretches) - 1
        if num_resets:
            times = "once" if num_resets == 1 else f"{num_resets} times"
            notes.append(
                f"the clock of {contents.topic} was set back {times}; of its {sum(contents.scan.stretches)} "
                f"sweeps the {self.num_sweeps} of the longest stretch are used"
            )
        notes += contents.poses.notes if self._own_poses else ()
        if contents.span_ns == (0, 0):
            notes.append(
                f"the points of {contents.topic} carry no times: sweeps are used as they are, bent by the "
                "robot's motion"
            )
        if self._trajectory is not None:
            notes += filter(None, [find_implausible_speed(self._trajectory)])
        return tuple(notes)


def _with_times_between(stamps_ns: IntArray, span_ns: tuple[int, int]) -> IntArray:
    """Return the stamps and the times of points after each, ``POSE_STEP_NS`` apart, increasing."""
    steps = np.arange(span_ns[0], span_ns[1] + POSE_STEP_NS, POSE_STEP_NS)
    offsets = np.unique(np.append(steps, 0))
    return np.unique((stamps_ns[:, None] + offsets).ravel())
