"""Read a run folder back: ``stairways.json`` and ``detections.jsonl``."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from stairmap.arrays import Points, readonly
from stairmap.detection.observation import Rejection, View
from stairmap.drop import Drop
from stairmap.errors import ResultsError, TrajectoryError
from stairmap.export.history import HISTORY_FILE, load_history
from stairmap.export.killed_run_drops import drops_of_killed_run
from stairmap.export.results import DETECTIONS_FILE, READABLE_SCHEMAS, STAIRWAYS_FILE, TRAJECTORY_FILE
from stairmap.input_files import (
    CheckedModel,
    Place,
    Stamp,
    parse_json,
    quoted,
    read_lines,
    read_text,
    shown,
    validated,
)
from stairmap.recordings.tum_trajectory import load_tum_trajectory, load_unfinished_trajectory
from stairmap.saved_drop import MAX_DROP_DEPTH, MAX_DROPS, SavedDrop
from stairmap.saved_stairway import MAX_STAIRWAYS, Count, SavedStairway
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

__all__ = [
    "ResultsError",
    "RunResults",
    "SavedDetection",
    "SavedObservation",
    "is_unfinished",
    "load_detections",
    "load_run_trajectory",
    "load_stairways",
    "nan_for_null",
]


MAX_CAMERA_HEIGHT = 100.0
"""Largest height of a camera above the ground, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResults:
    """What ``stairways.json`` holds.

    Attributes
    ----------
    software
        Program and version that wrote it.
    frame_id
        Name of the coordinate frame of all positions.
    num_frames
        Number of frames that were looked at.
    stairways
        The stairways; numbers that were not known are NaN.
    drops
        Where the ground ends and goes on lower; none in files that do not tell.
    camera_height
        Height of the camera above the ground that it moved on, m; ``None`` where not known.
    is_finished
        Whether the run came to its end; otherwise these are the last stairways that its history knows.
    """

    software: str
    frame_id: str
    num_frames: int
    stairways: tuple[Stairway, ...]
    drops: tuple[Drop, ...] = ()
    camera_height: float | None = None
    is_finished: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedObservation:
    """One observation as ``detections.jsonl`` keeps it; lengths in m, ``edges`` (N, 2, 3), camera frame."""

    view: View
    rise: float
    run: float
    width: float
    num_steps: int
    edges: Points

    def __post_init__(self) -> None:
        object.__setattr__(self, "edges", readonly(self.edges).reshape(-1, 2, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedDetection:
    """One line of ``detections.jsonl``; true when it holds an observation.

    ``camera_height``, m, is above the ground in view; ``drops`` are its edges: (2, 3) ends, m, camera frame,
    and depth, m. Lines of earlier versions tell neither.
    """

    stamp_ns: int
    observations: tuple[SavedObservation, ...]
    rejections: tuple[Rejection, ...]
    camera_height: float | None = None
    drops: tuple[tuple[list[list[float]], float | None], ...] = ()

    def __bool__(self) -> bool:
        return bool(self.observations)


class _StairwaysFile(CheckedModel):
    """``stairways.json`` without its schema."""

    software: str
    frame_id: str
    num_frames: Count
    stairways: Annotated[list[SavedStairway], Field(max_length=MAX_STAIRWAYS)]
    drops: Annotated[list[SavedDrop], Field(max_length=MAX_DROPS)] = Field(default_factory=list)
    camera_height: Annotated[float, Field(gt=0, le=MAX_CAMERA_HEIGHT)] | None = None


class _ObservationLine(CheckedModel):
    """An observation in a line of ``detections.jsonl``."""

    view: View
    rise: float
    run: float
    width: float
    num_steps: Count
    edges: Annotated[
        list[Annotated[list[Place], Field(min_length=2, max_length=2)]], Field(max_length=10_000)
    ]


class _RejectionLine(CheckedModel):
    """A rejection in a line of ``detections.jsonl``."""

    rule: str
    measured: float | None
    limit: float | None
    unit: str


class _EdgeLine(CheckedModel):
    """An edge of the ground in a line of ``detections.jsonl``."""

    edge: Annotated[list[Place], Field(min_length=2, max_length=2)]
    depth: Annotated[float, Field(gt=0, le=MAX_DROP_DEPTH)] | None


class _DetectionLine(CheckedModel):
    """A line of ``detections.jsonl``."""

    stamp_ns: Stamp
    observations: list[_ObservationLine]
    rejections: list[_RejectionLine]
    camera_height: Annotated[float, Field(gt=0, le=MAX_CAMERA_HEIGHT)] | None = None
    drops: Annotated[list[_EdgeLine], Field(max_length=1_000)] = Field(default_factory=list)


def load_stairways(path: Path) -> RunResults:
    """Read ``stairways.json``; in the folder of a run that was killed, the last stairways of its history.

    Parameters
    ----------
    path
        The file, or the run folder that holds it.

    Raises
    ------
    ResultsError
        If there is no such file, it is not JSON, has another schema, lacks a key, or a value is impossible.
    """
    if path.is_dir():
        if is_unfinished(path):
            return _load_unfinished(path)
        path = path / STAIRWAYS_FILE
    try:
        text = read_text(path, error_type=ResultsError)
    except ResultsError as error:
        raise ResultsError(f"{error}; name a run folder") from error
    try:
        values = parse_json(text)
    except ValueError as error:
        raise ResultsError(f"{shown(path)} is not a JSON file: {error}") from error
    if not isinstance(values, dict):
        raise ResultsError(f"{shown(path)} must hold one JSON object, got {type(values).__name__}")
    schema = values.get("schema")
    if isinstance(schema, bool) or schema not in READABLE_SCHEMAS:
        known = " and ".join(str(readable) for readable in READABLE_SCHEMAS)
        found = f"schema {quoted(json.dumps(schema), marks=False)}" if "schema" in values else "no schema"
        raise ResultsError(f"{shown(path)} has {found}, this version of stairmap reads schemas {known}")
    try:
        saved = validated(_StairwaysFile, values)
        check_unique_ids([stairway.id for stairway in saved.stairways])
    except ValueError as error:
        raise ResultsError(f"{shown(path)}: {error}") from error
    return RunResults(
        software=saved.software,
        frame_id=saved.frame_id,
        num_frames=saved.num_frames,
        stairways=tuple(Stairway.from_saved(stairway) for stairway in saved.stairways),
        drops=tuple(Drop.from_saved(drop) for drop in saved.drops),
        camera_height=saved.camera_height,
    )


def check_unique_ids(ids: Sequence[int]) -> None:
    """Refuse an id that two stairways have.

    Raises
    ------
    ValueError
        If there is one.
    """
    if len(set(ids)) < len(ids):
        double = next(number for number in ids if ids.count(number) > 1)
        raise ValueError(f"stairways: two have the id {double}")


def is_unfinished(run: Path) -> bool:
    """Whether a folder is that of a run that was killed before it could write its results."""
    if (run / STAIRWAYS_FILE).exists():
        return False
    return any((run / name).is_file() for name in (HISTORY_FILE, TRAJECTORY_FILE))


def _load_unfinished(run: Path) -> RunResults:
    stairways: tuple[Stairway, ...] = ()
    for known in load_history(run):
        stairways = known.stairways
    detections = tuple(load_detections(run)) if (run / DETECTIONS_FILE).is_file() else ()
    drops, camera_height = drops_of_killed_run(detections, load_run_trajectory(run), stairways)
    return RunResults(
        software="",
        frame_id="map",
        num_frames=len(detections),
        stairways=stairways,
        drops=drops,
        camera_height=camera_height,
        is_finished=False,
    )


def load_run_trajectory(run: Path) -> Trajectory | None:
    """Read ``trajectory.tum`` of a run folder; ``None`` where there is none, or no pose in it.

    Of a run that was killed, a last line that is cut off is passed over.

    Raises
    ------
    TrajectoryError
        If it cannot be read.
    """
    path = run / TRAJECTORY_FILE
    if not path.exists():
        return None
    try:
        return load_tum_trajectory(path)
    except TrajectoryError:
        # On a full disk, the file may be the one that grew although the run came to its end.
        return load_unfinished_trajectory(path)


def load_detections(path: Path) -> Iterator[SavedDetection]:
    """Read ``detections.jsonl``, one frame at a time.

    A last line that a killed run left unfinished is passed over.

    Parameters
    ----------
    path
        The file, or the run folder that holds it.

    Raises
    ------
    ResultsError
        If there is no such file, or a line is not what stairmap writes.
    """
    path = path / DETECTIONS_FILE if path.is_dir() else path
    for number, (line, is_whole) in enumerate(read_lines(path, error_type=ResultsError), start=1):
        try:
            yield _saved_detection(line)
        except ValueError as error:  # noqa: PERF203
            if is_whole:
                raise ResultsError(f"{shown(path)}, line {number} cannot be read: {error}") from error


def _saved_detection(text: str) -> SavedDetection:
    line = validated(_DetectionLine, parse_json(text))
    return SavedDetection(
        stamp_ns=line.stamp_ns,
        observations=tuple(
            SavedObservation(**{**dict(observation), "edges": np.array(observation.edges)})
            for observation in line.observations
        ),
        rejections=tuple(
            Rejection(
                rule=rejection.rule,
                measured=math.nan if rejection.measured is None else rejection.measured,
                limit=math.nan if rejection.limit is None else rejection.limit,
                unit=rejection.unit,
            )
            for rejection in line.rejections
        ),
        camera_height=line.camera_height,
        drops=tuple((edge.edge, edge.depth) for edge in line.drops),
    )


def nan_for_null(values: Any) -> Any:
    """Return nested JSON types with NaN for every ``null``: a number that is not known."""
    if isinstance(values, dict):
        return {key: nan_for_null(value) for key, value in values.items()}
    if isinstance(values, list):
        return [nan_for_null(value) for value in values]
    return np.nan if values is None else values
