"""The only place where the stages meet: frames and poses in, stairways out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.delmerico2013.detector import Delmerico2013Detector
from stairmap.delmerico2013.modeler import Delmerico2013Modeler
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.observation import Detection, StairObservation
from stairmap.detection.orientation import POSE_UP_STD
from stairmap.errors import ConfigError
from stairmap.frame import DepthFrame
from stairmap.modeling.mapper import StairwayMapper
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory


class Detector(Protocol):
    """Finds stair edges in one frame."""

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Return the observations of one frame, or the reasons why there are none."""
        ...


class Modeler(Protocol):
    """Makes stairways of observations; keeps them in the camera frame with their stamps."""

    def add(self, observation: StairObservation) -> None:
        """Take in one observation, at a cost that does not depend on how many came before."""
        ...

    def stairways(self, trajectory: Trajectory) -> tuple[Stairway, ...]:
        """Return the stairways as this trajectory places them."""
        ...


METHODS: dict[str, tuple[Callable[[Config], Detector], Callable[[Config], Modeler]]] = {
    "stairmap": (StairEdgeDetector, StairwayMapper),
    "delmerico2013": (Delmerico2013Detector, Delmerico2013Modeler),
}
"""Detector and modeler of each method, by the name that ``--method`` takes."""


class StairwayPipeline:
    """Runs one method over a stream of frames.

    Parameters
    ----------
    config
        Configuration of all stages.
    method
        A key of ``METHODS``.

    Raises
    ------
    ConfigError
        If there is no such method.
    """

    def __init__(self, config: Config | None = None, *, method: str = "stairmap") -> None:
        if method not in METHODS:
            raise ConfigError(f"unknown method {method!r}; choose one of: {', '.join(sorted(METHODS))}")
        config = Config() if config is None else config
        make_detector, make_modeler = METHODS[method]
        self.detector = make_detector(config)
        self.modeler = make_modeler(config)
        self._stamps_ns: list[int] = []
        self._poses: list[Transform] = []

    def process(self, frame: DepthFrame, map_from_camera: Transform, *, trace: bool = False) -> Detection:
        """Look at one frame taken at a known pose and model what it shows.

        Parameters
        ----------
        frame
            Depth image; its ``up`` is taken from the pose when it has none.
        map_from_camera
            (4, 4) pose of the camera's optical coordinate frame in a map with z up.
        trace
            Whether the detection also carries what pictures need.
        """
        if frame.up is None:
            up = np.array(map_from_camera[2, :3])
            frame = DepthFrame(stamp_ns=frame.stamp_ns, depth=frame.depth, camera=frame.camera, up=up, up_std=POSE_UP_STD)
        detection = self.detector.detect(frame, trace=trace)
        self._stamps_ns.append(frame.stamp_ns)
        self._poses.append(map_from_camera)
        for observation in detection.observations:
            self.modeler.add(observation)
        return detection

    def trajectory(self) -> Trajectory:
        """Return the poses that were given so far.

        Raises
        ------
        TrajectoryError
            If no frame was processed yet, or the stamps did not increase.
        """
        return Trajectory(stamps_ns=np.array(self._stamps_ns), map_from_camera=np.array(self._poses))

    def stairways(self, trajectory: Trajectory | None = None) -> tuple[Stairway, ...]:
        """Return the stairways found so far.

        Parameters
        ----------
        trajectory
            Corrected poses, as after a loop closure; without it, those given to ``process``.
        """
        if not self._stamps_ns:
            return ()
        return self.modeler.stairways(self.trajectory() if trajectory is None else trajectory)
