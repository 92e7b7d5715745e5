"""Image-folder recordings: the layout of TUM RGB-D with a camera.json (docs/inputs.md); or a single organised
cloud."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stairmap.arrays import IntArray, Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.errors import RecordingError, TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.recordings.base import RecordingProblems, SkippedFrame
from stairmap.recordings.depth_files import open_depth_files
from stairmap.recordings.depth_list import ListedImage, load_depth_list
from stairmap.recordings.map_up import (
    UP_AUTO,
    check_up,
    find_up_disagreement,
    map_from_recorded_with_up,
    turned_trajectory,
)
from stairmap.recordings.pose_coverage import (
    check_pose_coverage,
    find_implausible_speed,
    find_pose_coverage,
)
from stairmap.recordings.pose_format import check_has_poses, trajectory_from_format
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.trajectory import Trajectory

DEPTH_LIST = "depth.txt"
"""The file that makes a folder a recording."""

CAMERA_FILE = "camera.json"
"""Intrinsics and depth scale."""

POSE_FILES = ("groundtruth.txt", "trajectory.txt")
"""Where poses are looked for, in this order."""


class ImageFolderRecording:
    """A folder with ``depth.txt``, ``camera.json``, PNG images and perhaps poses; or with organised clouds.

    Parameters
    ----------
    folder
        The folder; or an organised cloud (``.pcd``), a recording of one frame.
    camera
        Camera file to use instead of the folder's own.
    trajectory
        TUM trajectory to use instead of the folder's own.
    up
        Axis of the poses' coordinate frame that points up (``+z`` if not given), or ``auto``.
    pose_format
        See ``open_recording``.

    Raises
    ------
    RecordingError
        If a file is missing or malformed, a stamp does not increase, or an image lies outside the folder,
        is no 16-bit single-channel PNG, or has another size than the camera.
    CalibrationError
        If the camera file is unusable, or depth is implausible with its scale.
    TrajectoryError
        If poses are malformed.
    """

    def __init__(
        self,
        folder: Path,
        *,
        camera: Path | None = None,
        trajectory: Path | None = None,
        up: str | None = None,
        pose_format: str | None = None,
    ) -> None:
        self._folder = Path(folder)
        self._pose_format = pose_format
        up = None if up is None else check_up(up)
        is_single = self._folder.is_file()
        self._images = (
            (_single_image(self._folder),) if is_single else load_depth_list(self._folder / DEPTH_LIST)
        )
        self._stamps_ns: IntArray = np.array([image.stamp_ns for image in self._images], dtype=np.int64)
        camera = None if is_single and camera is None else camera or self._folder / CAMERA_FILE
        self._files = open_depth_files(self._images, camera)
        self._camera_file = self._files.camera_file
        notes = list(self._camera_file.notes)
        self._map_from_recorded, self._trajectory = self._load_trajectory(trajectory, up, notes)
        self._num_without_pose = self.num_frames
        if self._trajectory is not None:
            coverage = find_pose_coverage(self._trajectory, self._stamps_ns)
            self._num_without_pose = coverage.num_without
            notes += [str(coverage)] if coverage.num_without else []
            notes += filter(None, [find_implausible_speed(self._trajectory)])
        self._ups = [None] * self.num_frames if up == UP_AUTO else self._find_ups(notes)
        self._notes = tuple(notes)
        self._skipped: list[SkippedFrame] = []

    @property
    def name(self) -> str:
        """Name of the folder, or of the file without its ending."""
        path = self._folder.resolve()
        return path.stem if path.is_file() else path.name

    @property
    def camera(self) -> PinholeCamera:
        """The camera of all frames."""
        return self._camera_file.camera

    @property
    def num_frames(self) -> int:
        """Number of images that ``depth.txt`` lists."""
        return len(self._images)

    @property
    def time_range_ns(self) -> tuple[int, int]:
        """First and last stamp that ``depth.txt`` lists, in nanoseconds."""
        return self._images[0].stamp_ns, self._images[-1].stamp_ns

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all frames declared, in nanoseconds."""
        return self._stamps_ns

    @property
    def frame_id(self) -> str:
        """``map``: the format has no name for it."""
        return "map"

    @property
    def trajectory(self) -> Trajectory | None:
        """``map_from_camera`` at the stamps of the poses, in the map with z up; ``None`` without poses."""
        return self._trajectory

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) turn of the poses' coordinate frame into the map; identity unless ``up`` asks for one."""
        return self._map_from_recorded.copy()

    @property
    def problems(self) -> RecordingProblems:
        """What the latest iteration skipped, and what looks strange."""
        return RecordingProblems(
            skipped=tuple(self._skipped),
            num_frames_without_pose=self._num_without_pose,
            notes=self._notes,
        )

    def check_poses(self) -> Trajectory:
        """Return the trajectory if it gives at least one frame a pose.

        Raises
        ------
        TrajectoryError
            If there are no poses, or no frame has one.
        """
        if self._trajectory is None:
            raise TrajectoryError(
                f"expected poses in {self._folder / POSE_FILES[0]} or {POSE_FILES[1]}, found neither; "
                "pass --trajectory FILE (TUM format), or --odometry to find them from the depth, or look at "
                "single frames with: stairmap detect"
            )
        check_pose_coverage(self._trajectory, self._stamps_ns)
        return self._trajectory

    def __iter__(self) -> Iterator[DepthFrame]:
        """Read the frames one by one; damaged images are skipped and stand in ``problems``.

        Raises
        ------
        RecordingError
            At the end, if no image could be read.
        """
        yield from self._read(0, self.num_frames)
        if len(self._skipped) == self.num_frames:
            raise RecordingError(
                f"none of the {self.num_frames} images of {self._folder} can be read; the first: "
                f"{self._skipped[0]}"
            )

    def frames_between(self, first_ns: int, last_ns: int) -> Iterator[DepthFrame]:
        """Read the frames from one stamp to another, both included, nanoseconds; see ``__iter__``."""
        first = int(np.searchsorted(self._stamps_ns, first_ns, side="left"))
        yield from self._read(first, int(np.searchsorted(self._stamps_ns, last_ns, side="right")))

    def _read(self, first: int, end: int) -> Iterator[DepthFrame]:
        """Read the frames with these numbers."""
        skipped: list[SkippedFrame] = []
        self._skipped = skipped
        for image, up in zip(self._images[first:end], self._ups[first:end], strict=True):
            try:
                depth = self._files.load(image)
            except RecordingError as error:
                skipped.append(SkippedFrame(stamp_ns=image.stamp_ns, source=image.name, reason=str(error)))
                continue
            yield DepthFrame(stamp_ns=image.stamp_ns, depth=depth, camera=self.camera, up=up)

    def _load_trajectory(
        self, path: Path | None, up: str | None, notes: list[str]
    ) -> tuple[Transform, Trajectory | None]:
        """``map_from_recorded``, and the trajectory turned by it."""
        if path is None and self._folder.is_dir():
            found = [self._folder / name for name in POSE_FILES if (self._folder / name).exists()]
            path = found[0] if found else None
            if len(found) > 1:
                notes.append(f"poses are those of {found[0].name}; for {found[1].name} pass --trajectory")
        if path is None:
            if up not in (None, UP_AUTO):
                raise RecordingError(
                    f"--up {up} names an axis of the map, but {self._folder} has no poses; give 'up' in "
                    f"{CAMERA_FILE} instead, or --up {UP_AUTO}"
                )
            check_has_poses(None, self._pose_format)
            return np.eye(4), None
        map_from_recorded = map_from_recorded_with_up(up or "+z")
        return map_from_recorded, turned_trajectory(
            map_from_recorded, trajectory_from_format(load_tum_trajectory(path), self._pose_format)
        )

    def _find_ups(self, notes: list[str]) -> list[Vector | None]:
        """Up in the camera frame for each image: from its pose, else from the camera file."""
        ups: list[Vector | None] = [self._camera_file.up] * self.num_frames
        if self._trajectory is None:
            return ups
        indices = np.flatnonzero(self._trajectory.has_pose(self._stamps_ns))
        poses = self._trajectory.poses_at(self._stamps_ns[indices])
        for index, pose in zip(indices, poses, strict=True):
            ups[index] = pose[2, :3]
        if len(poses) and self._camera_file.up is not None:
            disagreement = find_up_disagreement(poses[0, 2, :3], self._camera_file.up)
            notes += [disagreement] if disagreement else []
        return ups


def _single_image(path: Path) -> ListedImage:
    return ListedImage(place=path.name, stamp_ns=0, name=path.name, path=path)
