"""Map stairways with a camera that has no poses: they come from the registration of its depth images.

The map is that of the longest piece of the camera's way, turned so that z is up as the accelerometer or the
floor says.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Transform, Vector
from stairmap.config import Config
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.observation import Detection
from stairmap.detection.orientation import estimate_up
from stairmap.drop import Drop
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.geometry import normalized
from stairmap.map_levelling import levelling_from_ups
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recordings.map_up import turned_trajectory
from stairmap.recordings.odometry import config_with_drift
from stairmap.recordings.odometry_pieces import OdometryResult, PieceCollector
from stairmap.recordings.registration import DepthOdometry, TrackedFrame
from stairmap.session import MapSession
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

FLOOR_PERIOD = 5
"""Without an accelerometer the floor is asked for up in every so many-th frame: asking costs a third of a
detection."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryMap:
    """A map whose poses come from depth.

    Attributes
    ----------
    stairways
        In the level map.
    trajectory
        ``map_from_camera`` in the level map.
    odometry
        How good the poses are.
    config
        With the drift of the poses.
    notes
        How the map was made, one sentence each.
    drops
        Where the ground ends and goes on lower, in the level map.
    camera_height
        Height of the camera above the ground that it moves on, m; ``None`` where not known.
    """

    stairways: tuple[Stairway, ...]
    trajectory: Trajectory
    odometry: OdometryResult
    config: Config
    notes: tuple[str, ...]
    drops: tuple[Drop, ...] = ()
    camera_height: float | None = None


class OdometrySession:
    """Takes frames without poses one by one.

    Parameters
    ----------
    config, method
        See ``MapSession``.

    Attributes
    ----------
    last_frame
        The newest frame as it was looked at, with up where it is known; ``None`` before the first.

    Raises
    ------
    MissingPackageError
        Without the package for odometry.
    """

    def __init__(self, config: Config | None = None, *, method: str = DEFAULT_METHOD) -> None:
        # Its frames have no pose: each piece of the way has its own coordinate frame, and none is level yet.
        self._session = MapSession(config, method=method)
        self._odometry = DepthOdometry()
        self._pieces = PieceCollector()
        self.last_frame: DepthFrame | None = None
        self._num_frames = 0
        self._ups: list[tuple[int, Vector]] = []
        self._up_sum: Vector = np.zeros(3)
        self._has_accelerometer = False

    def add(self, frame: DepthFrame) -> Detection:
        """Look at one frame; its stamp is after those before it.

        Returns
        -------
        Detection
            With up from the frame itself, or from the floor in it and in the frames before.
        """
        tracked = self._track(frame)
        self._num_frames += 1
        is_placed = tracked.piece_from_camera is not None
        if frame.up is None and tracked.piece_from_camera is not None:
            up = self._up_in_camera(tracked.piece_from_camera)
            frame = DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up)
        self.last_frame = frame
        # A frame that fits nowhere must not enter the map between two that do.
        return self._session.add(frame, None) if is_placed else self._session.detect(frame)

    def find_map(self) -> OdometryMap:
        """Return the map of all frames so far: the longest piece of the camera's way, level.

        Raises
        ------
        TrajectoryError
            If fewer than three successive frames fit together, or nothing tells which way is up.
        """
        odometry = self._pieces.result()
        turn, note = self._levelling(odometry)
        trajectory = turned_trajectory(turn, odometry.trajectory)
        config = config_with_drift(self._session.config, odometry)
        session = self._session_with(config)
        return OdometryMap(
            stairways=session.stairways(trajectory),
            drops=session.drops(trajectory),
            camera_height=session.camera_height,
            trajectory=trajectory,
            odometry=odometry,
            config=config,
            notes=(note, *odometry.to_lines()),
        )

    def _session_with(self, config: Config) -> MapSession:
        """The session with all it has seen, under a configuration that knows the drift."""
        if not self._session.is_restorable:
            return self._session
        session = MapSession(config, method=self._session.method)
        session.restore(self._session.state())
        return session

    def _track(self, frame: DepthFrame) -> TrackedFrame:
        tracked = self._odometry.track(frame)
        self._pieces.add(tracked)
        pose = tracked.piece_from_camera
        if pose is None:
            return tracked
        if self._ups and self._ups[-1][0] != tracked.piece:
            self._up_sum = np.zeros(3)
        up = frame.up
        self._has_accelerometer |= up is not None
        if up is None and self._num_frames % FLOOR_PERIOD == 0:
            max_depth = self._session.config.detection.max_depth
            up = estimate_up(fit_surface_normals(inverse_depth_from_frame(frame, max_depth=max_depth)))
        if up is not None:
            in_piece = pose[:3, :3] @ up
            self._ups.append((tracked.piece, in_piece))
            self._up_sum = self._up_sum + in_piece
        return tracked

    def _up_in_camera(self, piece_from_camera: Transform) -> Vector | None:
        """Up as the floor has told so far; ``None`` while it has not."""
        if not self._up_sum.any():
            return None
        return normalized(piece_from_camera[:3, :3].T @ self._up_sum)

    def _levelling(self, odometry: OdometryResult) -> tuple[Transform, str]:
        """The turn that makes z point up in the longest piece, and a sentence about it."""
        ups: Float64Array = np.array([up for piece, up in self._ups if piece == odometry.piece])
        source = "the accelerometer" if self._has_accelerometer else "the floor"
        try:
            levelling = levelling_from_ups(ups.reshape(-1, 3), num_asked=len(ups))
        except TrajectoryError as error:
            raise TrajectoryError(
                f"{source} told up in {len(ups)} of {len(odometry.trajectory)} frames, which are too few or "
                "do not agree: let the camera see the floor"
            ) from error
        spread_deg = np.degrees(levelling.spread)
        return levelling.map_from_recorded, (
            f"the map is level by {source} in {levelling.num_agreeing} frames that agree within "
            f"{spread_deg:.1f} deg (median)"
        )
