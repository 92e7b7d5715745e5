"""What a live camera has shown so far: frame by frame, and with odometry as stairways in a map."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Transform, Vector
from stairmap.cli.odometry import config_with_drift
from stairmap.config import Config
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.observation import Detection
from stairmap.detection.orientation import estimate_up
from stairmap.errors import TrajectoryError
from stairmap.frame import DepthFrame
from stairmap.geometry import normalized
from stairmap.map_levelling import levelling_from_ups
from stairmap.modeling.mapper import StairwayMapper
from stairmap.pipeline import Modeler, StairwayPipeline
from stairmap.recordings.map_up import turned_trajectory
from stairmap.recordings.odometry_pieces import OdometryResult, PieceCollector
from stairmap.recordings.realsense import LiveFrame
from stairmap.recordings.registration import DepthOdometry, TrackedFrame
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.visualization.collecting import ReportCollector

FLOOR_PERIOD = 5
"""Without an accelerometer the floor is asked for up in every so many-th frame."""

MAP_PERIOD = 1.0
"""Shortest time between two models of the map while frames come, s."""

MAP_TIME_SHARE = 0.1
"""Share of the time that may go into these models."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveMap:
    """The map of a live camera.

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
    """

    stairways: tuple[Stairway, ...]
    trajectory: Trajectory
    odometry: OdometryResult
    config: Config
    notes: tuple[str, ...]


class LiveSession:
    """Takes the frames of a live camera one by one.

    Parameters
    ----------
    config, method
        See ``StairwayPipeline``.
    with_odometry
        Whether frames are also placed in a map.

    Attributes
    ----------
    collector
        Counts, reasons, and frames for the report.
    num_skipped
        Frames that the camera sent and nobody looked at.
    last_seen
        The newest frame's detection that holds stair edges; ``None`` before the first.
    stairways
        Those of the map, as of a second ago.

    Raises
    ------
    MissingPackageError
        With odometry, without the package for it.
    """

    def __init__(self, config: Config, *, method: str, with_odometry: bool) -> None:
        self.config, self.method = config, method
        self.collector = ReportCollector()
        pipeline = StairwayPipeline(config, method=method)
        self.detector = pipeline.detector
        self.num_skipped = 0
        self.last_seen: Detection | None = None
        self.stairways: tuple[Stairway, ...] = ()
        self._modeler = pipeline.modeler
        self._odometry = DepthOdometry() if with_odometry else None
        self._pieces = PieceCollector()
        self._ups: list[tuple[int, Vector]] = []
        self._up_sum: Vector = np.zeros(3)
        self._has_accelerometer = False
        self._map_due = time.monotonic() + MAP_PERIOD

    def process(self, live: LiveFrame) -> Detection:
        """Look at one frame; its stamp is after those before it."""
        frame = live.frame
        self.num_skipped += live.num_skipped
        tracked = None if self._odometry is None else self._track(frame)
        if frame.up is None and tracked is not None and tracked.piece_from_camera is not None:
            up = self._up_in_camera(tracked.piece_from_camera)
            frame = DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up)
        detection = self.detector.detect(frame)
        self.collector.add(frame, detection)
        self.last_seen = detection if detection else self.last_seen
        if tracked is not None:
            if tracked.piece_from_camera is not None:
                for observation in detection.observations:
                    self._modeler.add(observation)
            if time.monotonic() >= self._map_due:
                self._renew_stairways()
        return detection

    def find_map(self) -> LiveMap:
        """Return the map of all frames so far: the longest piece of the camera's way, level.

        Raises
        ------
        TrajectoryError
            If fewer than three successive frames fit together.
        """
        odometry = self._pieces.result()
        turn, note = self._levelling(odometry)
        trajectory = turned_trajectory(turn, odometry.trajectory)
        config = config_with_drift(self.config, odometry)
        self.stairways = self._modeler_with(config).stairways(trajectory)
        return LiveMap(
            stairways=self.stairways,
            trajectory=trajectory,
            odometry=odometry,
            config=config,
            notes=(note, *odometry.to_lines()),
        )

    def _modeler_with(self, config: Config) -> Modeler:
        """The modeler with all it has seen, under a configuration that knows the drift."""
        if not isinstance(self._modeler, StairwayMapper):
            return self._modeler
        modeler = StairwayMapper(config)
        modeler.restore(self._modeler.state())
        return modeler

    def _track(self, frame: DepthFrame) -> TrackedFrame:
        assert self._odometry is not None
        tracked = self._odometry.track(frame)
        self._pieces.add(tracked)
        pose = tracked.piece_from_camera
        if pose is None:
            return tracked
        if self._ups and self._ups[-1][0] != tracked.piece:
            self._up_sum = np.zeros(3)
        up = frame.up
        self._has_accelerometer |= up is not None
        if up is None and self.collector.num_frames % FLOOR_PERIOD == 0:
            depth = inverse_depth_from_frame(frame, max_depth=self.config.detection.max_depth)
            up = estimate_up(fit_surface_normals(depth))
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

    def _renew_stairways(self) -> None:
        """Model the map once more; one that is not level yet can wait."""
        started = time.monotonic()
        try:
            self.find_map()
        except TrajectoryError:
            self.stairways = ()
        took = time.monotonic() - started
        self._map_due = time.monotonic() + max(MAP_PERIOD, took / MAP_TIME_SHARE)
