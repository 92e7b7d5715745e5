"""The thread that looks at sweeps: places the points of each, gathers windows, and hands them to the map."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Thread

import numpy as np

from stairmap.arrays import IntArray
from stairmap.config import Config
from stairmap.errors import StairmapError, TransformLookupError, TransformProblem
from stairmap.recordings.cloud_message import sweep_from_cloud
from stairmap.sweep import Sweep
from stairmap.sweep_session import detect_in_window
from stairmap.sweep_window import SweepWindow, WindowGatherer
from stairmap.trajectory import Trajectory
from stairmap_ros.live_map import LiveMap
from stairmap_ros.node_config import NodeConfig
from stairmap_ros.node_status import NodeStatus
from stairmap_ros.points_in import PointsIn, WaitingSweep
from stairmap_ros.transforms_in import TransformsIn

WAIT = 0.1
"""How long the worker sleeps at most, s."""

RETRY = 0.02
"""How long it sleeps before it looks for a transform again, s."""

POSE_STEP_NS = 20_000_000
"""Poses within a sweep are looked up this far apart, nanoseconds."""


class SweepWorker:
    """Looks at sweeps, in their order, while the node is active.

    Parameters
    ----------
    own, config
        Coordinate frames, and the configuration of the stages.
    points, transforms
        Sweeps that wait, and where they were taken.
    live_map
        What windows enter.
    status
        Where what is wrong with them is noted.
    now_ns
        Gives the ROS time, nanoseconds.
    looked
        Called after each window.
    """

    def __init__(
        self,
        own: NodeConfig,
        config: Config,
        *,
        points: PointsIn,
        transforms: TransformsIn,
        live_map: LiveMap,
        status: NodeStatus,
        now_ns: Callable[[], int],
        looked: Callable[[], None],
    ) -> None:
        self._own, self._config = own, config
        self._points, self._transforms = points, transforms
        self._live_map, self._status, self._now_ns = live_map, status, now_ns
        self._looked = looked
        self._gatherer = WindowGatherer()
        self._latest_ns = 0
        points.open()
        self._thread = Thread(target=self._work, name="stairmap sweeps", daemon=True)
        self._thread.start()

    @property
    def is_alive(self) -> bool:
        """False after an error that nobody foresaw."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop looking, after the window at hand."""
        self._points.shut()
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while self._points.is_open:
            waiting = self._points.next(WAIT)
            if waiting is None:
                continue
            try:
                self._look(waiting)
            except StairmapError as error:
                self._status.refuse(str(error), time.monotonic())

    def _look(self, waiting: WaitingSweep) -> None:
        sweep = sweep_from_cloud(waiting.message)
        if sweep.stamp_ns <= self._latest_ns:
            # A clock that was set back: points of before do not belong to these.
            self._gatherer = WindowGatherer()
        self._latest_ns = sweep.stamp_ns
        frame = self._own.lidar_frame or waiting.message.header.frame_id
        path = self._find_path(sweep, frame, waiting.arrived)
        if path is None:
            return
        window = self._gatherer.add(sweep, path)
        if window is None or window.is_seen_before:
            return
        self._finish(window)

    def _finish(self, window: SweepWindow) -> None:
        detection = detect_in_window(window, self._config)
        try:
            body = self._transforms.lookup(self._own.map_frame, self._own.path_frame, window.stamp_ns)
        except TransformLookupError:
            body = None
        self._live_map.take_points(detection, window.map_from_sensor, body)
        self._looked()
        self._status.processed(detection, time.monotonic())
        self._status.published((self._now_ns() - window.stamp_ns) * 1e-9)

    def _find_path(self, sweep: Sweep, frame: str, arrived: float) -> Trajectory | None:
        """Poses of the LiDAR over the time of a sweep, waited for; ``None`` if they do not come."""
        offsets = sweep.offsets_ns
        first, last = (
            (0, 0) if offsets is None or not len(offsets) else (int(offsets.min()), int(offsets.max()))
        )
        grid = np.unique(np.append(np.arange(first, last + POSE_STEP_NS, POSE_STEP_NS).clip(max=last), 0))
        stamps = sweep.stamp_ns + grid
        while self._points.is_open:
            found = self._look_up(stamps, frame)
            if not isinstance(found, TransformLookupError):
                self._status.set_problem("lidar", None)
                return found
            may_come = found.problem in (TransformProblem.NOT_YET, TransformProblem.UNKNOWN_FRAME)
            if not may_come or time.monotonic() - arrived > self._own.max_transform_wait:
                self._status.set_problem("lidar", f"no pose of the LiDAR: {found}")
                return None
            time.sleep(RETRY)
        return None

    def _look_up(self, stamps_ns: IntArray, frame: str) -> Trajectory | TransformLookupError:
        destination = self._own.map_frame
        try:
            poses = [self._transforms.lookup(destination, frame, stamp) for stamp in stamps_ns.tolist()]
        except TransformLookupError as error:
            return error
        return Trajectory(stamps_ns=stamps_ns, map_from_camera=np.array(poses))
