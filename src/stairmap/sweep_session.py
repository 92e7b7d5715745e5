"""Map stairways from the sweeps of a LiDAR as they come in.

session = SweepSession()
for sweep in recording:
    session.add(sweep, trajectory)
session.finish()
print(session.stairways())
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stairmap.clouds.detector import detect_points
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.session import MapSession
from stairmap.stairway import Stairway
from stairmap.sweep import Sweep
from stairmap.sweep_sightlines import refined_by_sightlines
from stairmap.sweep_window import MAX_POSE_GAP_NS, SweepWindow, WindowGatherer
from stairmap.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowResult:
    """A window of sweeps and what was found in it, in the sensor's frame of the window."""

    window: SweepWindow
    detection: Detection


class SweepSession:
    """Gathers sweeps into windows, detects stairs in each, and models them in one map.

    Parameters
    ----------
    config
        Configuration of all stages; the default one if not given.

    Attributes
    ----------
    map_session
        The map: its poses are those of the middles of windows.
    num_sweeps, num_without_pose, num_windows
        How many came in, how many of these had no pose, and how many windows were looked at.
    """

    def __init__(self, config: Config | None = None) -> None:
        self.config = Config() if config is None else config
        self.map_session = MapSession(self.config)
        self.num_sweeps = 0
        self.num_without_pose = 0
        self.num_windows = 0
        self._gatherer = WindowGatherer()

    def add(self, sweep: Sweep, trajectory: Trajectory) -> WindowResult | None:
        """Take in a sweep.

        Parameters
        ----------
        sweep
            Newer than those before it. One without a pose is left out.
        trajectory
            ``map_from_sensor`` over its time at least, in a map with z up.

        Returns
        -------
        The window that it completes, with what was found in it; ``None`` in between, and where the robot has
        stood still for so long that a window tells nothing new.

        Raises
        ------
        MapFullError
            See ``MapSession.add``.
        """
        self.num_sweeps += 1
        if not trajectory.has_pose(np.array([sweep.stamp_ns]), max_gap_ns=MAX_POSE_GAP_NS)[0]:
            self.num_without_pose += 1
        return self._look_at(self._gatherer.add(sweep, trajectory))

    def finish(self) -> WindowResult | None:
        """Look at the sweeps that fill no window yet, as after the last one."""
        return self._look_at(self._gatherer.finish())

    def stairways(self, trajectory: Trajectory | None = None) -> tuple[Stairway, ...]:
        """Return the stairways found so far, by id; see ``MapSession.stairways``."""
        return self.map_session.stairways(trajectory)

    def _look_at(self, window: SweepWindow | None) -> WindowResult | None:
        if window is None or window.is_seen_before:
            return None
        detection = detect_in_window(window, self.config)
        self.map_session.take_points(detection, window.map_from_sensor)
        self.num_windows += 1
        return WindowResult(window=window, detection=detection)


def detect_in_window(window: SweepWindow, config: Config) -> Detection:
    """Detect the stairs in a window, in its sensor's frame; heights without a tread in view by sightlines."""
    detection = detect_points(
        window.points, up=window.up, noise=window.noise, config=config, stamp_ns=window.stamp_ns
    )
    if not detection:
        return detection
    ends = np.concatenate([window.points, window.far_points])
    view_index = np.concatenate([window.view_index, window.far_view_index])
    refined = tuple(
        refined_by_sightlines(observation, ends, window.viewpoints, view_index)
        for observation in detection.observations
    )
    return replace(detection, observations=refined)
