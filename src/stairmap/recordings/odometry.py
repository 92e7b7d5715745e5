"""A recording without poses, with poses from the registration of its depth frames (``--odometry``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from stairmap.arrays import IntArray, Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.errors import RecordingError
from stairmap.frame import DepthFrame
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.base import Recording, RecordingProblems
from stairmap.recordings.map_up import UP_AUTO, map_from_recorded_with_up, turned_trajectory
from stairmap.recordings.odometry_pieces import OdometryResult, PieceCollector
from stairmap.recordings.open import open_recording
from stairmap.recordings.registration import DepthOdometry, TrackState
from stairmap.trajectory import Trajectory
from stairmap.transforms import rotation_between, transform_from_parts


def open_without_poses(path: Path, *, bag: BagOptions | None = None) -> Recording:
    """Open a recording for ``OdometryRecording``: the poses that it may have tell nothing, up neither.

    Raises
    ------
    RecordingError
        See ``open_recording``.
    """
    recording = open_recording(path, bag=bag)
    return recording if recording.trajectory is None else open_recording(path, up=UP_AUTO, bag=bag)


def config_with_drift(config: Config, odometry: OdometryResult) -> Config:
    """Return a configuration with the drift of poses from depth, where the user did not set one."""
    measured = {
        "pose_drift": round(odometry.drift, 4),
        "pose_heading_drift_deg": round(odometry.heading_drift_deg, 3),
    }
    update = {key: value for key, value in measured.items() if key not in config.modeling.model_fields_set}
    return config.model_copy(update={"modeling": config.modeling.model_copy(update=update)})


class OdometryRecording:
    """A recording whose poses come from the registration of its depth frames.

    Making it reads all frames once; memory grows by a pose per frame only.

    Parameters
    ----------
    recording
        See ``open_without_poses``.
    up
        Which axis of the first camera's optical coordinate frame points up; ``None``: what the first frame
        says (``up`` of camera.json), and if that says nothing, ``auto``.
    on_frame
        Called after each frame.

    Attributes
    ----------
    odometry
        How good the poses are.
    up
        What levels the map, for ``find_level_map``.

    Raises
    ------
    MissingPackageError
        Without the package small_gicp.
    TrajectoryError
        If fewer than three successive frames can be registered.
    """

    def __init__(
        self, recording: Recording, *, up: str | None = None, on_frame: Callable[[], None] | None = None
    ) -> None:
        self._recording = recording
        odometry, pieces = DepthOdometry(), PieceCollector()
        ups: dict[int, Vector] = {}
        for frame in recording:
            tracked = odometry.track(frame)
            pieces.add(tracked)
            if frame.up is not None and tracked.state is TrackState.START:
                ups[frame.stamp_ns] = frame.up
            if on_frame is not None:
                on_frame()
        self.odometry = pieces.result()
        first_up = ups.get(int(self.odometry.trajectory.stamps_ns[0]))
        self._map_from_recorded = np.eye(4)
        if up is not None:
            self._map_from_recorded = map_from_recorded_with_up(up)
        elif first_up is not None:
            turn = rotation_between(first_up, np.array([0.0, 0.0, 1.0]))
            self._map_from_recorded = transform_from_parts(turn, np.zeros(3))
        self.up = UP_AUTO if up is None and first_up is None else up
        self._trajectory = turned_trajectory(self._map_from_recorded, self.odometry.trajectory)

    @property
    def name(self) -> str:
        """Name of the recording itself."""
        return self._recording.name

    @property
    def camera(self) -> PinholeCamera:
        """The camera of all frames."""
        return self._recording.camera

    @property
    def num_frames(self) -> int:
        """Number of frames that the recording declares."""
        return self._recording.num_frames

    @property
    def time_range_ns(self) -> tuple[int, int]:
        """Stamps of the first and last frame declared, in nanoseconds."""
        return self._recording.time_range_ns

    @property
    def stamps_ns(self) -> IntArray:
        """(N,) stamps of all frames declared, in nanoseconds."""
        return self._recording.stamps_ns

    @property
    def frame_id(self) -> str:
        """Name of the map's coordinate frame."""
        return "map"

    @property
    def trajectory(self) -> Trajectory:
        """``map_from_camera``, in the map with z up unless ``up`` is ``auto``."""
        return self._trajectory

    @property
    def map_from_recorded(self) -> Transform:
        """(4, 4) turn of the first camera's optical coordinate frame into the map."""
        return self._map_from_recorded.copy()

    @property
    def problems(self) -> RecordingProblems:
        """Those of the recording itself, and what is to be said about the poses."""
        own = self._recording.problems
        notes = tuple(note for note in own.notes if "have no pose" not in note)
        return RecordingProblems(
            skipped=own.skipped,
            num_frames_without_pose=self.odometry.num_frames - len(self.odometry.trajectory),
            notes=(*self.odometry.to_lines(), *notes),
        )

    def check_poses(self) -> Trajectory:
        """Return the trajectory: there is none without poses."""
        return self._trajectory

    def __iter__(self) -> Iterator[DepthFrame]:
        """Read the frames again; their ``up`` is that of their pose, or none for ``auto``."""
        for frame in self._recording:
            up = None
            if self.up != UP_AUTO and self._trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                up = self._trajectory.pose_at(frame.stamp_ns)[2, :3]
            yield DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up)


def check_no_trajectory(is_given: bool) -> None:
    """Refuse poses from a file beside poses from depth.

    Raises
    ------
    RecordingError
        If both are asked for.
    """
    if is_given:
        raise RecordingError("expected --trajectory or --odometry, got both; leave one out")
