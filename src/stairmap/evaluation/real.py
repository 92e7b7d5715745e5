"""The suite of real recordings: what was measured by hand is found, and where no stairs are, nothing is.

Recordings without poses are looked at frame by frame. Those with poses are also mapped, as
``stairmap run --up auto`` does it. None of them is part of the project; see docs/evaluation.md.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.config import Config
from stairmap.errors import StairmapError
from stairmap.map_levelling import find_level_map
from stairmap.pipeline import make_detector
from stairmap.recordings.frame_iterators import placed_frames
from stairmap.recordings.map_up import UP_AUTO
from stairmap.recordings.open import open_recording
from stairmap.session import MapSession


@dataclass(frozen=True, slots=True, kw_only=True)
class RealRecording:
    """A real recording.

    Attributes
    ----------
    folder
        Its name.
    truth
        Measured ``rise``, ``run``, ``width`` (m) and ``num_steps`` of the one stairway in it; ``None``: none.
    is_optional
        Whether it need not be found: too few steps to be called a stairway.
    """

    folder: str
    truth: Mapping[str, float] | None = None
    is_optional: bool = False


REAL_RECORDINGS = (
    RealRecording(
        folder="kinect_v2_test_stairs", truth={"rise": 0.104, "run": 0.274, "width": 0.81, "num_steps": 5}
    ),
    RealRecording(
        folder="xtion_two_steps_close", truth={"rise": 0.171, "run": 0.301, "num_steps": 2}, is_optional=True
    ),
    RealRecording(folder="no_stairs_kitchen_kinect_v1"),
    RealRecording(folder="no_stairs_lab_floor_realsense"),
    RealRecording(folder="no_stairs_objects_realsense"),
)
"""The recordings with what was measured in them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RealResult:
    """What one method made of one real recording.

    Attributes
    ----------
    recording, method
        Which.
    num_frames, num_detections, num_false_frames
        Frames, those with an observation, and those with one where there is no stairway.
    num_stairways
        Stairways in the map; ``None`` for a recording without poses.
    estimate
        The first observation's ``rise``, ``run``, ``width`` and ``num_steps``.
    rejections
        Why the first frame without an observation has none.
    frame_ms
        Median processor time per frame, ms.
    """

    recording: str
    method: str
    truth: Mapping[str, float] | None
    is_optional: bool
    num_frames: int
    num_detections: int
    num_false_frames: int
    num_stairways: int | None
    estimate: Mapping[str, float] | None
    rejections: tuple[str, ...]
    frame_ms: float

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON types."""
        return asdict(self)


def run_real_suite(
    folder: Path, methods: Sequence[str], *, config: Config | None = None, only: Sequence[str] = ()
) -> tuple[RealResult, ...]:
    """Run methods over the real recordings.

    Parameters
    ----------
    folder
        Holds the recordings' folders.
    methods
        Keys of ``stairmap.pipeline.METHODS``.
    config
        Configuration of all methods.
    only
        Keep recordings whose name holds one of these words.

    Raises
    ------
    StairmapError
        If a recording is not there or cannot be read.
    """
    results = []
    for recording in REAL_RECORDINGS:
        if only and not any(word in recording.folder for word in only):
            continue
        if not (folder / recording.folder).is_dir():
            raise StairmapError(
                f"suite real needs the recording '{recording.folder}', which is no part of stairmap; "
                "docs/evaluation.md says where it comes from; pass --data DIR with it in a folder 'real'"
            )
        for method in methods:
            results.append(_run_recording(folder, recording, method, Config() if config is None else config))
    return tuple(results)


def _run_recording(folder: Path, real: RealRecording, method: str, config: Config) -> RealResult:
    recording = open_recording(folder / real.folder)
    detector = make_detector(config, method=method)
    seconds: list[float] = []
    estimate: dict[str, float] | None = None
    rejections: tuple[str, ...] = ()
    num_detections = num_frames = 0
    for frame in recording:
        # With poses in a map that is not level, each frame's own floor tells up, unless an IMU did.
        own = frame if recording.trajectory is None else replace(frame, up=None)
        start = time.process_time()
        detection = detector.detect(own)
        seconds.append(time.process_time() - start)
        num_frames += 1
        num_detections += bool(detection)
        if detection and estimate is None:
            first = detection.observations[0]
            estimate = {
                "rise": first.rise, "run": first.run, "width": first.width, "num_steps": first.num_steps
            }  # fmt: skip
        if not detection and not rejections:
            rejections = tuple(str(rejection) for rejection in detection.rejections)
    return RealResult(
        recording=real.folder,
        method=method,
        truth=real.truth,
        is_optional=real.is_optional,
        num_frames=num_frames,
        num_detections=num_detections,
        num_false_frames=num_detections if real.truth is None else 0,
        num_stairways=_count_stairways(folder / real.folder, method, config),
        estimate=estimate,
        rejections=rejections,
        frame_ms=float(np.median(seconds)) * 1e3,
    )


def _count_stairways(folder: Path, method: str, config: Config) -> int | None:
    """Return the number of stairways that a map of the recording holds, if it has poses."""
    recording = open_recording(folder, up=UP_AUTO)
    if recording.trajectory is None:
        return None
    level_map = find_level_map(recording, UP_AUTO, max_depth=config.detection.max_depth)
    session = MapSession(config, method=method)
    for frame, map_from_camera in placed_frames(recording, level_map.trajectory):
        session.add(frame, map_from_camera)
    return len(session.stairways())
