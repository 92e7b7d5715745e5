"""One trial: a simulated drive, looked at by one or several methods, each judged against the truth."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.evaluation.drift import find_observed_flight
from stairmap.evaluation.frame_cache import recorded_frames, simulation_sum
from stairmap.evaluation.judging import FlightResult, TrialJudgement, judge_stairways
from stairmap.evaluation.truth import DriveTruth, find_truth
from stairmap.frame import DepthFrame
from stairmap.session import MapSession
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.simulate import Simulation


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialSpec:
    """What to simulate; equal specs give equal frames, bit for bit.

    Attributes
    ----------
    suite, scene, sensor, robot, seed
        Names and seed.
    width
        Width at which the sensor is read out, px; ``None``: its full one.
    num_frames
        Frames of the drive; ``None``: 10 Hz.
    """

    suite: str
    scene: str
    sensor: str
    robot: str
    seed: int
    width: int | None = None
    num_frames: int | None = None

    def __str__(self) -> str:
        width = "" if self.width is None else f" {self.width} px"
        return f"{self.scene}, {self.sensor}{width}, {self.robot}, seed {self.seed}"

    def folder_name(self) -> str:
        """Return a name for its files."""
        parts = (
            self.scene,
            self.sensor,
            self.width or "full",
            self.robot,
            self.seed,
            self.num_frames or "all",
        )
        return "_".join(str(part) for part in parts).replace("/", "-").replace(":", "-")

    def simulation(self, *, buildings: Path | None = None) -> Simulation:
        """Return the drive.

        Raises
        ------
        ValueError
            If there is no such scene, sensor or robot.
        """
        if self.robot not in ROBOTS:
            raise ValueError(f"unknown robot {self.robot!r}; choose one of: {', '.join(sorted(ROBOTS))}")
        native = make_sensor(self.sensor).camera.width
        sensor = make_sensor(self.sensor, factor=(self.width or native) / native)
        scene = make_scene(self.scene, self.seed, buildings=buildings)
        return Simulation(scene, sensor, ROBOTS[self.robot], seed=self.seed, num_frames=self.num_frames)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialResult:
    """What one method made of one trial.

    Attributes
    ----------
    spec, method
        Which trial and method.
    crash
        What went wrong, if the trial did not come to an end; then all else is empty.
    num_frames, num_detections, num_observations
        Frames, frames with an observation, and observations.
    num_false_frames
        Frames with an observation of something that is no stairway.
    frame_ms, mean_frame_ms
        Median and mean processor time of ``MapSession.add``, ms.
    query_ms
        Processor time of ``MapSession.stairways`` after the last frame, ms. The report's
        method does all of its fitting there.
    flights
        The true flights.
    false_stairways
        What was reported and is not there, or a second time.
    """

    spec: TrialSpec
    method: str
    crash: str | None = None
    num_frames: int = 0
    num_detections: int = 0
    num_observations: int = 0
    num_false_frames: int = 0
    frame_ms: float = float("nan")
    mean_frame_ms: float = float("nan")
    query_ms: float = float("nan")
    flights: tuple[FlightResult, ...] = ()
    false_flights: tuple[Mapping[str, Any], ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON types; what could not be judged is ``None``."""
        return {key: _without_nan(value) for key, value in asdict(self).items()}


class MethodRun:
    """One method at work on one drive.

    Parameters
    ----------
    method, config
        See ``MapSession``.
    truth
        What was to be found.
    """

    def __init__(self, method: str, config: Config, truth: DriveTruth) -> None:
        self.session = MapSession(config, method=method)
        self._method, self._truth = method, truth
        self._true_flights = tuple(true.flight for true in truth.flights)
        self._observed: list[list[int | None]] = []
        self._seconds: list[float] = []

    @property
    def num_observations(self) -> int:
        """Number of observations so far."""
        return sum(len(found) for found in self._observed)

    def process(self, frame: DepthFrame, believed_pose: Transform) -> None:
        """Let the method look at the next frame."""
        start = time.process_time()
        detection = self.session.add(frame, believed_pose)
        self._seconds.append(time.process_time() - start)
        true_pose = self._truth.true_poses[len(self._observed)]
        self._observed.append(
            [
                find_observed_flight(observation, true_pose, self._true_flights)
                for observation in detection.observations
            ]
        )

    def result(self, spec: TrialSpec) -> TrialResult:
        """Return the judgement after the last frame."""
        start = time.process_time()
        stairways = self.session.stairways()
        query_ms = (time.process_time() - start) * 1e3
        judgement: TrialJudgement = judge_stairways(stairways, self._truth, self._observed)
        return TrialResult(
            spec=spec,
            method=self._method,
            num_frames=len(self._observed),
            num_detections=sum(bool(found) for found in self._observed),
            num_observations=self.num_observations,
            num_false_frames=sum(None in found for found in self._observed),
            frame_ms=float(np.median(self._seconds)) * 1e3,
            mean_frame_ms=float(np.mean(self._seconds)) * 1e3,
            query_ms=query_ms,
            flights=judgement.flights,
            false_flights=judgement.false_flights,
        )


def run_trial(
    spec: TrialSpec,
    methods: Sequence[str],
    *,
    config: Config | None = None,
    buildings: Path | None = None,
    cache: Path | None = None,
) -> tuple[TrialResult, ...]:
    """Simulate a drive once and return what each method made of it.

    Parameters
    ----------
    spec
        What to simulate.
    methods
        Keys of ``stairmap.pipeline.METHODS``.
    config
        Configuration of all methods.
    buildings
        Folder of the buildings; see ``make_scene``.
    cache
        Folder that keeps the frames between runs; see ``frame_cache``.
    """
    simulation = spec.simulation(buildings=buildings)
    truth = find_truth(simulation)
    runs = [MethodRun(method, Config() if config is None else config, truth) for method in methods]
    folder = None if cache is None else cache / simulation_sum() / spec.folder_name()
    for frame, pose in zip(recorded_frames(simulation, folder), simulation.odometry_poses, strict=True):
        for run in runs:
            run.process(frame, pose)
    return tuple(run.result(spec) for run in runs)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
