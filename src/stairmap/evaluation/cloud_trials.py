"""Trials without a camera: finished maps, and drives with a LiDAR; judged as drives with a camera are."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from stairmap.arrays import Mask, Points
from stairmap.config import Config
from stairmap.evaluation.drift import find_observed_flight
from stairmap.evaluation.judging import judge_stairways
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.evaluation.truth import DriveTruth, TrueFlight
from stairmap.map_scan import MapScan
from stairmap.recordings.clouds.cloud import Cloud
from stairmap.simulation.finished_maps import MAP_KINDS, MIN_RETURNS, FinishedMap
from stairmap.simulation.lidars import LIDARS
from stairmap.simulation.odometry import find_drift
from stairmap.simulation.robots import ROBOTS
from stairmap.simulation.scene import Scene
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.sweep_visibility import MIN_STEPS, ReturnCounter
from stairmap.simulation.sweeps import LidarDrive
from stairmap.stairway import Stairway
from stairmap.sweep_session import SweepSession

FINISHED_MAPS, SWEEPS = "clouds", "sweeps"
"""Names of the two suites."""

SEEN_DISTANCE = 4.0
"""A flight must be found when a LiDAR came so near, m, and measured three of its steps from there, not from
aside (``stairmap.simulation.sweep_visibility``)."""

SEEN_SHARE = 0.7
"""A flight must be found in a finished map when the scanner saw this share of its steps."""

METHOD = "stairmap"
"""The report's method needs depth images."""


def run_cloud_trial(
    spec: TrialSpec,
    methods: Sequence[str],
    *,
    config: Config | None = None,
    buildings: Path | None = None,
    cache: Path | None = None,
) -> tuple[TrialResult, ...]:
    """Measure a scene without a camera and judge what was found; see ``run_trial``."""
    del methods, cache
    config = Config() if config is None else config
    scene = make_scene(spec.scene, spec.seed, buildings=buildings)
    run = _run_map if spec.suite == FINISHED_MAPS else _run_drive
    return (run(spec, scene, config),)


def _run_map(spec: TrialSpec, scene: Scene, config: Config) -> TrialResult:
    finished = FinishedMap(scene, MAP_KINDS[spec.sensor], seed=spec.seed)
    returns = [np.zeros(flight.num_risers, dtype=np.int64) for flight in finished.flights]
    parts: list[Points] = []
    for part in finished.parts():
        parts.append(part.points.astype(np.float32))
        returns = [total + found for total, found in zip(returns, part.returns, strict=True)]

    def read() -> Iterator[Points]:
        for points in parts:
            yield points.astype(np.float64)

    cloud = Cloud(
        path=Path("map"), kind="simulated", num_points=sum(map(len, parts)), read=read, is_metric=True
    )
    start = time.process_time()
    scan = MapScan([cloud], up="+z", config=config)
    scan.read()
    result = scan.find_stairways()
    seconds = time.process_time() - start
    seen = [counts >= MIN_RETURNS for counts in returns]
    truth = _truth(scene, seen, [bool(mask.mean() >= SEEN_SHARE) for mask in seen], finished.drift[None])
    flights = tuple(true.flight for true in truth.flights)
    observed = [[find_observed_flight(item, np.eye(4), flights) for item in result.observations]]
    return _result(spec, truth, result.stairways, observed, frame_ms=seconds * 1e3)


def _run_drive(spec: TrialSpec, scene: Scene, config: Config) -> TrialResult:
    drive = LidarDrive(
        scene, LIDARS[spec.sensor], ROBOTS[spec.robot], seed=spec.seed, num_frames=spec.num_frames
    )
    stairways = (*scene.stairways, *scene.optional_stairways)
    flights = tuple(flight for stairway in stairways for flight in stairway.flights)
    returns, session = ReturnCounter(flights), SweepSession(config)
    seconds, results, stamps = 0.0, [], []
    for index, found in enumerate(drive.sweeps()):
        returns.add(found.true_points, drive.true_path.map_from_camera[index, :3, 3])
        start = time.process_time()
        results.append(session.add(found.sweep, drive.odometry_path))
        seconds += time.process_time() - start
    start = time.process_time()
    results.append(session.finish())
    seconds += time.process_time() - start
    observed: list[list[int | None]] = []
    for window in (item for item in results if item is not None):
        true_pose = drive.true_path.pose_at(window.window.stamp_ns)
        stamps.append(window.window.stamp_ns)
        observed.append(
            [find_observed_flight(item, true_pose, flights) for item in window.detection.observations]
        )
    start = time.process_time()
    reported = session.stairways()
    query_ms = (time.process_time() - start) * 1e3
    seen = [item.is_measured(SEEN_DISTANCE) for item in returns.result()]
    rows = np.searchsorted(drive.true_path.stamps_ns, np.array(stamps, dtype=np.int64))
    drifts = find_drift(drive.odometry_path.map_from_camera, drive.true_path.map_from_camera)[rows]
    truth = _truth(scene, seen, [int(np.count_nonzero(mask)) >= MIN_STEPS for mask in seen], drifts)
    ms = seconds * 1e3 / max(len(drive), 1)
    return _result(spec, truth, reported, observed, frame_ms=ms, query_ms=query_ms)


def _truth(scene: Scene, seen: Sequence[Mask], must: Sequence[bool], drifts: Points) -> DriveTruth:
    flights = []
    stairways = [(stairway, False) for stairway in scene.stairways]
    stairways += [(stairway, True) for stairway in scene.optional_stairways]
    named = [
        (stairway.id, index, flight, is_optional)
        for stairway, is_optional in stairways
        for index, flight in enumerate(stairway.flights)
    ]
    for (stairway_id, index, flight, is_optional), mask, is_near in zip(named, seen, must, strict=True):
        flights.append(
            TrueFlight(
                stairway_id=stairway_id,
                flight_index=index,
                flight=flight,
                is_optional=is_optional,
                must_be_found=is_near and not is_optional,
                num_near_frames=0,
                surely_seen=mask,
                possibly_seen=np.ones(flight.num_risers, dtype=bool),
            )
        )
    return DriveTruth(flights=tuple(flights), drifts=drifts, true_poses=np.zeros((0, 4, 4)))


def _result(
    spec: TrialSpec,
    truth: DriveTruth,
    stairways: Sequence[Stairway],
    observed: list[list[int | None]],
    *,
    frame_ms: float,
    query_ms: float = 0.0,
) -> TrialResult:
    judgement = judge_stairways(stairways, truth, observed)
    return TrialResult(
        spec=spec,
        method=METHOD,
        num_frames=len(observed),
        num_detections=sum(bool(found) for found in observed),
        num_observations=sum(map(len, observed)),
        num_false_frames=sum(None in found for found in observed),
        frame_ms=frame_ms,
        mean_frame_ms=frame_ms,
        query_ms=query_ms,
        flights=judgement.flights,
        false_flights=judgement.false_flights,
    )
