"""What 10,000 frames and 10,000 observations cost."""

from __future__ import annotations

import gc
import os
import statistics
from dataclasses import replace
from pathlib import Path

import numpy as np
from samples import FRAMES_PER_DRIVE, Sample, timed

from stairmap.arrays import Transform
from stairmap.detection.observation import StairObservation
from stairmap.evaluation.table_format import format_table
from stairmap.pipeline import METHODS, make_detector, make_modeler
from stairmap.session import MapSession
from stairmap.simulation.odometry import close_loop
from stairmap.trajectory import Trajectory

FRAME_NS = 100_000_000


def measure_growth(samples: list[Sample], num_frames: int) -> str:
    """Return the table of time per frame and memory early and late in a long run."""
    rows = []
    for method in METHODS:
        session = MapSession(method=method)
        seconds, memory = [], {}
        num_observations = 0
        for count in range(num_frames):
            sample = samples[count % len(samples)]
            frame = replace(sample.frame, stamp_ns=count * FRAME_NS)
            detection, spent = timed(session.add, frame, sample.pose)
            seconds.append(spent)
            num_observations += len(detection.observations)
            if count + 1 in (len(samples), num_frames):
                gc.collect()
                memory[count + 1] = resident_mb()
        # The same frames early and late: the second round and the last whole one.
        size = len(samples)
        last = (num_frames // size - 1) * size
        early, late = seconds[size : 2 * size], seconds[last : last + size]
        rows.append(
            [
                method,
                f"{1e3 * statistics.median(early):.2f}",
                f"{1e3 * statistics.median(late):.2f}",
                f"{100 * (statistics.median(late) / statistics.median(early) - 1):+.1f} %",
                str(num_observations),
                f"{memory[size]:.0f}",
                f"{memory[num_frames]:.0f}",
                f"{memory[num_frames] - memory[size]:+.1f}",
            ]
        )
    size = len(samples)
    header = (
        "method", f"ms per frame, {size + 1}-{2 * size}", f"at {num_frames:,}", "change", "observations",
        f"memory at {size}, MB", f"at {num_frames:,}, MB", "growth, MB",
    )  # fmt: skip
    note = f"{size} frames in a circle, stamps going on; `add` only. Memory is the process's resident set."
    return note + "\n\n" + format_table(header, rows)


def measure_queries(samples: list[Sample], num_observations: int = 10_000) -> str:
    """Return the time of ``stairways()`` before and after the trajectory has changed."""
    rows = []
    for method in METHODS:
        detector, modeler = make_detector(method=method), make_modeler(method=method)
        seen: list[tuple[StairObservation, Transform]] = [
            (observation, sample.pose)
            for sample in samples
            for observation in detector.detect(sample.frame).observations
        ]
        if not seen:
            continue
        stamps, poses = [], []
        for count in range(num_observations):
            observation, pose = seen[count % len(seen)]
            stamps.append(count * FRAME_NS)
            poses.append(pose)
            modeler.add(replace(observation, stamp_ns=count * FRAME_NS))
        true_poses, stamps_ns = np.array(poses), np.array(stamps)
        drifted_poses = true_poses.copy()
        drifted_poses[:, :2, 3] += np.linspace(0, 0.3, num_observations)[:, None]
        drifted = Trajectory(stamps_ns=stamps_ns, map_from_camera=drifted_poses)
        closed_poses = close_loop(stamps_ns, drifted_poses, true_poses)
        closed = Trajectory(stamps_ns=stamps_ns, map_from_camera=closed_poses)
        _, first = timed(modeler.stairways, drifted)
        again = statistics.median(timed(modeler.stairways, drifted)[1] for _ in range(3))
        stairways, after = timed(modeler.stairways, closed)
        rows.append([method, str(len(stairways)), *(f"{1e3 * value:.1f}" for value in (first, again, after))])
    header = (
        "method",
        "stairways",
        "first query ms",
        "same trajectory again ms",
        "after the loop closure ms",
    )
    note = (
        "The drives' observations again and again, on a trajectory that drifts by 0.4 m "
        "and is then corrected."
    )
    return note + "\n\n" + format_table(header, rows)


NUM_PLACES, PLACE_SPACING = 100, 60.0
"""Stairways of a large map, and how far apart they stand in rows of ten, m."""


def measure_large_queries(samples: list[Sample], num_observations: int = 100_000) -> str:
    """Return the time of ``stairways()`` of the default method with 100 stairways."""
    detector, modeler = make_detector(), make_modeler()
    # One drive, again and again at other places.
    seen = [
        (observation, sample.pose)
        for sample in samples[:FRAMES_PER_DRIVE]
        for observation in detector.detect(sample.frame).observations
    ]
    true_poses, stamps_ns = np.zeros((num_observations, 4, 4)), np.arange(num_observations) * FRAME_NS
    for count in range(num_observations):
        observation, pose = seen[count % len(seen)]
        place = count * NUM_PLACES // num_observations
        true_poses[count] = pose
        true_poses[count, :2, 3] += PLACE_SPACING * np.array([place % 10, place // 10])
        modeler.add(replace(observation, stamp_ns=int(stamps_ns[count])))
    drifted_poses = true_poses.copy()
    drifted_poses[:, :2, 3] += np.linspace(0, 0.3, num_observations)[:, None]
    last = num_observations - 1
    before = Trajectory(stamps_ns=stamps_ns[:last], map_from_camera=drifted_poses[:last])
    drifted = Trajectory(stamps_ns=stamps_ns, map_from_camera=drifted_poses)
    copy = Trajectory(stamps_ns=stamps_ns.copy(), map_from_camera=drifted_poses.copy())
    closed_poses = close_loop(stamps_ns, drifted_poses, true_poses)
    closed = Trajectory(stamps_ns=stamps_ns, map_from_camera=closed_poses)
    queries = {
        "first query": before,
        "one observation more": drifted,
        "nothing changed": copy,
        "after a loop closure": closed,
    }
    rows = []
    for name, trajectory in queries.items():
        stairways, spent = timed(modeler.stairways, trajectory)
        rows.append([name, str(len(stairways)), f"{1e3 * spent:.1f}"])
    note = f"{num_observations:,} observations of {NUM_PLACES} stairways, default method, processor time."
    return note + "\n\n" + format_table(("query", "stairways", "ms"), rows)


def resident_mb() -> float:
    """Return the memory that this process holds, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
