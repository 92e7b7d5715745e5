"""Calls of kernels as the detector makes them on simulated and real frames: what twins are compared on."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from analytic_stairs import AnalyticStairs, nosings, pose_looking
from solid_scenes import frame_of, pose_towards, room, stairs_solid
from stairmap import detection, kernels
from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.frame import DepthFrame
from stairmap.recordings.open import open_recording
from stairmap.simulation.triangle_mesh import make_block, make_rectangle

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)
REAL = ("kinect_v2_test_stairs", "no_stairs_people_kinect_v1", "no_stairs_lab_floor_realsense")
MAX_CALLS = 24
"""Calls of one kernel that are kept, evenly spread over the frames."""

Call = tuple[Any, ...]


@lru_cache
def recorded_calls(shared_data: Path) -> dict[str, list[Call]]:
    """Return the arguments of calls of each kernel, by its name."""
    calls: dict[str, list[Call]] = {name: [] for name in kernel_names()}
    restore = []

    def recorder(name: str, kernel: Callable[..., Any]) -> Callable[..., Any]:
        def record(*arguments: Any) -> Any:
            calls[name].append(arguments)
            return kernel(*arguments)

        return record

    for info in pkgutil.iter_modules(detection.__path__, "stairmap.detection."):
        module = importlib.import_module(info.name)
        for name in calls:
            if hasattr(module, name):
                restore.append((module, name, getattr(module, name)))
                setattr(module, name, recorder(name, getattr(module, name)))
    try:
        detector = StairEdgeDetector(Config())
        for frame in (*simulated_frames(), *real_frames(shared_data)):
            detector.detect(frame)
    finally:
        for module, name, kernel in restore:
            setattr(module, name, kernel)
    return {name: _spread(mine) for name, mine in calls.items()}


def kernel_names() -> tuple[str, ...]:
    """Return the names of all kernels."""
    return tuple(name for name in kernels.__all__ if name not in ("VARIANT", "describe_kernels"))


def simulated_frames() -> list[DepthFrame]:
    """Return stairs from below, above, oblique, as slabs, beside a clutter of boxes, and an empty room."""
    middle = (0.7, 0.0, 0.45)
    top = nosings(STAIRS)[-1].mean(axis=0)
    down = pose_looking((top[0] + 0.3, 0.0, top[2] + 1.3), yaw=np.pi, down=np.radians(42.0))
    slabs = [
        make_block((0.28 * k, -0.6, 0.17 * k + 0.13), (0.28 * k + 0.3, 0.6, 0.17 * k + 0.17))
        for k in range(8)
    ]
    boxes = [make_block((0.5 * k, -1.5, 0.0), (0.5 * k + 0.3, -0.9, 0.15 + 0.1 * k)) for k in range(4)]
    floor = make_rectangle((-9, -9), (9, 9), 0.0)
    frames = [
        frame_of([stairs_solid(STAIRS), room()], pose_towards(middle, distance=2.0, height=1.2)),
        frame_of([stairs_solid(STAIRS), room(), *boxes], pose_towards(middle, distance=1.6, height=0.3)),
        frame_of([stairs_solid(STAIRS), floor], down),
        frame_of([*slabs, room()], pose_towards(middle, distance=2.2, height=0.5)),
        frame_of([*boxes, room()], pose_towards(middle, distance=2.2, height=0.7)),
        frame_of([room()], pose_towards(middle, distance=2.2, height=0.7)),
    ]
    return [_noisy(frame, seed) for seed, frame in enumerate(frames)]


def _noisy(frame: DepthFrame, seed: int) -> DepthFrame:
    """The frame with the noise of a sensor that triangulates, and holes."""
    random = np.random.default_rng(seed)
    inverse = 1.0 / frame.depth + random.normal(0.0, 0.002, frame.depth.shape)
    inverse[random.random(frame.depth.shape) < 0.02] = np.nan
    return replace(frame, depth=(1.0 / inverse).astype(np.float32))


def real_frames(shared_data: Path) -> list[DepthFrame]:
    """Return the first frame of some real recordings, of those that are there."""
    folders = [shared_data / "real" / name for name in REAL]
    return [next(iter(open_recording(folder))) for folder in folders if folder.is_dir()]


def _spread(calls: Sequence[Call]) -> list[Call]:
    chosen = np.unique(np.linspace(0, len(calls) - 1, MAX_CALLS).astype(int)) if calls else []
    return [calls[index] for index in chosen]
