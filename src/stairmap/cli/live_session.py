"""What a live camera has shown so far, for the table on the terminal and the results at the end."""

from __future__ import annotations

import time

from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.errors import TrajectoryError
from stairmap.odometry_session import OdometryMap, OdometrySession
from stairmap.pipeline import make_detector
from stairmap.recordings.realsense import LiveFrame
from stairmap.stairway import Stairway
from stairmap.visualization.collecting import ReportCollector

MAP_PERIOD = 1.0
"""Shortest time between two models of the map while frames come, s."""

MAP_TIME_SHARE = 0.1
"""Share of the time that may go into these models."""


class LiveSession:
    """Takes the frames of a live camera one by one.

    Parameters
    ----------
    config, method
        See ``MapSession``.
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
        self.method = method
        self.collector = ReportCollector()
        self.num_skipped = 0
        self.last_seen: Detection | None = None
        self.stairways: tuple[Stairway, ...] = ()
        self._mapping = OdometrySession(config, method=method) if with_odometry else None
        self.detector = make_detector(config, method=method)
        self._map_due = time.monotonic() + MAP_PERIOD

    def process(self, live: LiveFrame) -> Detection:
        """Look at one frame; its stamp is after those before it."""
        self.num_skipped += live.num_skipped
        frame = live.frame
        if self._mapping is None:
            detection = self.detector.detect(frame)
        else:
            detection = self._mapping.add(frame)
            frame = self._mapping.last_frame or frame
        self.collector.add(frame, detection)
        self.last_seen = detection if detection else self.last_seen
        if self._mapping is not None and time.monotonic() >= self._map_due:
            self._renew_stairways()
        return detection

    def find_map(self) -> OdometryMap:
        """Return the map of all frames so far; see ``OdometrySession``.

        Raises
        ------
        TrajectoryError
            If there is none.
        """
        if self._mapping is None:
            raise TrajectoryError("expected a live session with odometry; without it there is no map")
        found = self._mapping.find_map()
        self.stairways = found.stairways
        return found

    def _renew_stairways(self) -> None:
        """Model the map once more; one that is not level yet can wait."""
        started = time.monotonic()
        try:
            self.find_map()
        except TrajectoryError:
            self.stairways = ()
        took = time.monotonic() - started
        self._map_due = time.monotonic() + max(MAP_PERIOD, took / MAP_TIME_SHARE)
