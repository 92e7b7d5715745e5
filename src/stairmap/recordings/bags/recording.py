"""Bags as recordings: ROS 1 and ROS 2, and the files of the RealSense recorder (docs/inputs.md)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from stairmap.arrays import DepthImage, IntArray, Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.errors import RecordingError, TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.bags.bag import Bag
from stairmap.recordings.bags.contents import BagContents, read_bag_contents
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.realsense_recorder import is_realsense_topic
from stairmap.recordings.bags.stream import BagMessage, DamagedBagError
from stairmap.recordings.base import RecordingProblems, SkippedFrame, WatchOpening
from stairmap.recordings.depth_message import depth_from_message
from stairmap.recordings.map_up import UP_AUTO, check_up, map_from_recorded_with_up, turned_trajectory
from stairmap.recordings.pose_coverage import (
    check_pose_coverage,
    find_implausible_speed,
    find_pose_coverage,
)
from stairmap.recordings.pose_format import check_has_poses, trajectory_from_format
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.trajectory import Trajectory


class BagRecording:
    """A bag with depth images, their camera and perhaps poses.

    It is read once when it is opened, for stamps and poses; images are decoded while one iterates and never
    kept, so memory does not grow with them.

    Parameters
    ----------
    path
        See ``Bag``.
    trajectory
        TUM trajectory to use instead of the bag's own poses.
    up
        Axis of the map's coordinate frame that points up (``+z`` if not given), or ``auto``.
    pose_format
        See ``open_recording``.
    options
        What to take of the bag where it cannot be guessed.
    watch
        Is told how far the reading at opening is.

    Raises
    ------
    RecordingError
        If it is no bag, or has no depth images, or it cannot be told which; the message lists what there is.
    CalibrationError
        If intrinsics are missing or unusable, or depth is implausible.
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
        up = None if up is None else check_up(up)
        self._bag = Bag(path)
        options = options or BagOptions()
        loaded = None if trajectory is None else load_tum_trajectory(trajectory)
        self._contents = self._read_contents(options, loaded is None, watch)
        self._own_poses = loaded is None
        notes = list(self._contents.notes)
        poses = self._contents.poses.trajectory if loaded is None else loaded
        check_has_poses(poses, pose_format)
        poses = None if poses is None else trajectory_from_format(poses, pose_format)
        if poses is None and up not in (None, UP_AUTO):
            raise RecordingError(
                f"--up {up} names an axis of the map, but {path} has no poses: {self._contents.poses.problem}"
            )
        self._map_from_recorded = np.eye(4) if poses is None else map_from_recorded_with_up(up or "+z")
        self._trajectory = None if poses is None else turned_trajectory(self._map_from_recorded, poses)
        self._num_without_pose = self.num_frames
        if self._trajectory is not None:
            coverage = find_pose_coverage(self._trajectory, self._contents.stamps_ns)
            self._num_without_pose = coverage.num_without
            notes += [str(coverage)] if coverage.num_without else []
            if coverage.num_without and self._own_poses and self._contents.poses.problem:
                notes.append(f"the first of them: {self._contents.poses.problem}")
            notes += filter(None, [find_implausible_speed(self._trajectory)])
        self._has_map_up = self._trajectory is not None and up != UP_AUTO
        self._camera_up = None if up == UP_AUTO else self._contents.depth.up
        self._notes = tuple(notes)
        self._skipped: list[SkippedFrame] = []

    @property
    def name(self) -> str:
        """Name of the bag without its ending."""
        return self._bag.name

    @property
    def camera(self) -> PinholeCamera:
        """The camera of all frames."""
        return self._contents.depth.camera

    @property
    def num_frames(self) -> int:
        """Number of depth images that count, those included that turn out to be damaged."""
        return self._contents.num_images

    @property
    def time_range_ns(self) -> tuple[int, int]:
        """First and last stamp of the depth images, in nanoseconds."""
        stamps_ns = self._contents.stamps_ns
        return int(stamps_ns[0]), int(stamps_ns[-1])

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all frames declared, in nanoseconds."""
        return self._contents.stamps_ns

    @property
    def frame_id(self) -> str:
        """Name of the map's coordinate frame; ``map`` without poses of the bag's own."""
        return self._contents.poses.frame_id if self._own_poses else "map"

    @property
    def trajectory(self) -> Trajectory | None:
        """``map_from_camera`` at the stamps of the images, in the map with z up; ``None`` without poses."""
        return self._trajectory

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) turn of the bag's map into the map with z up; identity unless ``up`` asks for one."""
        return self._map_from_recorded.copy()

    @property
    def problems(self) -> RecordingProblems:
        """What the latest iteration skipped, and what looks strange."""
        return RecordingProblems(
            skipped=tuple(self._skipped),
            num_frames_without_pose=self._num_without_pose,
            notes=self._notes,
        )

    @property
    def contents(self) -> BagContents:
        """What was taken of the bag, and what else it holds."""
        return self._contents

    @property
    def pose_source(self) -> str:
        """Where the poses come from, for a person."""
        return self._contents.poses.source if self._own_poses else "--trajectory"

    def check_poses(self) -> Trajectory:
        """Return the trajectory if it gives at least one frame a pose.

        Raises
        ------
        TrajectoryError
            If there are no poses, or no frame has one.
        """
        if self._trajectory is None:
            problem, clock = self._contents.poses.problem, ""
            if is_realsense_topic(self._contents.depth.topic):
                problem = "the RealSense recorder writes none"
                clock = ", its stamps counted from the start of the recording"
            raise TrajectoryError(
                f"expected poses in {self._bag.path}: {problem}; pass --trajectory FILE "
                f"(TUM format){clock}, or --odometry to find them from the depth, or look at single frames "
                "with: stairmap detect"
            )
        check_pose_coverage(self._trajectory, self._contents.stamps_ns)
        return self._trajectory

    def __iter__(self) -> Iterator[DepthFrame]:
        """Read the frames one by one; images that cannot be used are skipped and stand in ``problems``.

        Raises
        ------
        RecordingError
            At the end, if no image could be read.
        """
        skipped: list[SkippedFrame] = []
        self._skipped = skipped
        latest_ns = -1
        for message in self._images():
            stamp_ns = message.recorded_ns
            try:
                stamp_ns = header_of(message)[0]
                if stamp_ns <= latest_ns:
                    raise RecordingError(
                        f"its stamp is not after that of the image before, {latest_ns * 1e-9:.6f} s"
                    )
                depth = self._decode(message)
            except RecordingError as error:
                skipped.append(SkippedFrame(stamp_ns=stamp_ns, source=message.topic.name, reason=str(error)))
                continue
            latest_ns = stamp_ns
            yield DepthFrame(stamp_ns=stamp_ns, depth=depth, camera=self.camera, up=self._up(stamp_ns))
        if len(skipped) == self.num_frames:
            raise RecordingError(
                f"none of the {self.num_frames} images of {self._bag.path} can be read; the first: "
                f"{skipped[0]}"
            )

    def _read_contents(
        self, options: BagOptions, with_poses: bool, watch: WatchOpening | None
    ) -> BagContents:
        try:
            contents = read_bag_contents(self._bag, options, with_poses=with_poses, watch=watch)
            if not contents.is_interleaved:
                return contents
            with suppress(RecordingError):
                self._bag.read_in_order()
        except DamagedBagError:
            self._bag.read_in_order()
        return read_bag_contents(self._bag, options, with_poses=with_poses, watch=watch)

    def _images(self) -> Iterator[BagMessage]:
        """The messages of the stretch that counts."""
        first, end = self._contents.first_image, self._contents.first_image + self.num_frames
        for index, message in enumerate(self._bag.messages([self._contents.depth.topic])):
            if index >= end:
                return
            if index >= first:
                yield message

    def _decode(self, message: BagMessage) -> DepthImage:
        depth = depth_from_message(
            self._bag.decode(message), values_per_metre=self._contents.depth.values_per_metre
        )
        if depth.shape != (self.camera.height, self.camera.width):
            raise RecordingError(
                f"the image is {depth.shape[1]}x{depth.shape[0]}, the first one and its camera are "
                f"{self.camera.width}x{self.camera.height}"
            )
        return depth

    def _up(self, stamp_ns: int) -> Vector | None:
        """Up in the camera frame: from the pose, else from the camera file."""
        trajectory = self._trajectory if self._has_map_up else None
        if trajectory is None or not trajectory.has_pose(np.array([stamp_ns]))[0]:
            return self._camera_up
        up: Vector = trajectory.pose_at(stamp_ns)[2, :3]
        return up
