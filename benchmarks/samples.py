"""Frames to measure times with."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from stairmap.arrays import Transform
from stairmap.delmerico2013 import lines as report_lines
from stairmap.evaluation.frame_cache import recorded_frames, simulation_sum
from stairmap.evaluation.trials import TrialSpec
from stairmap.frame import DepthFrame
from stairmap.session import frame_with_up

T = TypeVar("T")

DRIVES = (
    ("davis_rear", "packbot"),
    ("half_turn", "spot"),
    ("cluttered", "go2"),
    ("open_risers", "humanoid"),
    ("cluttered_room", "turtlebot"),
)
"""Scenes and robots whose frames are used."""

FRAMES_PER_DRIVE = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """A frame with its up, its pose and its 8-bit image."""

    frame: DepthFrame
    pose: Transform
    grey: np.ndarray
    has_stairs: bool


def load_samples(width: int, cache: Path | None) -> list[Sample]:
    """Return the frames of all drives at one width."""
    samples = []
    for place, (scene, robot) in enumerate(DRIVES):
        spec = TrialSpec(
            suite="speed", scene=scene, sensor="kinect_v1", robot=robot, seed=0, width=width,
            num_frames=FRAMES_PER_DRIVE,
        )  # fmt: skip
        simulation = spec.simulation()
        folder = None if cache is None else cache / simulation_sum() / spec.folder_name()
        # Every scene has its stairs at the origin; in one long run they must not lie on each other.
        poses = simulation.odometry_poses.copy()
        poses[:, 1, 3] += 50.0 * place
        for frame, pose in zip(recorded_frames(simulation, folder), poses, strict=True):
            grey = report_lines.grey_from_depth(np.nan_to_num(frame.depth))
            has_stairs = bool(simulation.scene.stairways)
            samples.append(
                Sample(frame=frame_with_up(frame, pose), pose=pose, grey=grey, has_stairs=has_stairs)
            )
    return samples


def timed(work: Callable[..., T], *arguments: object) -> tuple[T, float]:
    """Return what the work returns, and the seconds of this thread's processor time that it took."""
    start = time.thread_time()
    result = work(*arguments)
    return result, time.thread_time() - start
