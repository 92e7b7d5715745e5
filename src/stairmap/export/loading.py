"""Read a run folder back: ``stairways.json`` and ``detections.jsonl``."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points, readonly
from stairmap.detection.observation import Rejection, View
from stairmap.errors import StairmapError
from stairmap.export.results import DETECTIONS_FILE, READABLE_SCHEMAS, STAIRWAYS_FILE
from stairmap.stairway import Stairway


class ResultsError(StairmapError):
    """A run folder, or a file in it, cannot be read."""


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
    """

    software: str
    frame_id: str
    num_frames: int
    stairways: tuple[Stairway, ...]


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
    """One line of ``detections.jsonl``; true when it holds an observation."""

    stamp_ns: int
    observations: tuple[SavedObservation, ...]
    rejections: tuple[Rejection, ...]

    def __bool__(self) -> bool:
        return bool(self.observations)


def load_stairways(path: Path) -> RunResults:
    """Read ``stairways.json``.

    Parameters
    ----------
    path
        The file, or the run folder that holds it.

    Raises
    ------
    ResultsError
        If there is no such file, it is not JSON, has another schema, or lacks a key.
    """
    path = path / STAIRWAYS_FILE if path.is_dir() else path
    try:
        values = json.loads(_read_text(path))
    except json.JSONDecodeError as error:
        raise ResultsError(f"{path} is not a JSON file: line {error.lineno}: {error.msg}") from error
    if not isinstance(values, dict):
        raise ResultsError(f"{path} must hold one JSON object, got {type(values).__name__}")
    if values.get("schema") not in READABLE_SCHEMAS:
        known = " and ".join(str(schema) for schema in READABLE_SCHEMAS)
        found = f"schema {values['schema']!r}" if "schema" in values else "no schema"
        raise ResultsError(f"{path} has {found}, this version of stairmap reads schemas {known}")
    try:
        return RunResults(
            software=str(values["software"]),
            frame_id=str(values["frame_id"]),
            num_frames=int(values["num_frames"]),
            stairways=tuple(Stairway.from_dict(nan_for_null(data)) for data in values["stairways"]),
        )
    except KeyError as error:
        raise ResultsError(f"{path} lacks the key {error}") from error
    except (TypeError, ValueError) as error:
        raise ResultsError(f"{path}: {error}") from error


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
    *lines, unfinished = _read_text(path).split("\n")
    for number, line in enumerate(lines, start=1):
        yield _saved_detection(line, f"{path}, line {number}")
    if unfinished:
        with contextlib.suppress(ResultsError):
            yield _saved_detection(unfinished, "the last line")


def _saved_detection(line: str, place: str) -> SavedDetection:
    try:
        return _detection_from_dict(json.loads(line))
    except KeyError as error:
        raise ResultsError(f"{place} lacks the key {error}") from error
    except (TypeError, ValueError) as error:
        raise ResultsError(f"{place} cannot be read: {error}") from error


def _detection_from_dict(data: dict[str, Any]) -> SavedDetection:
    rejections = [
        Rejection(
            rule=rejection["rule"],
            measured=_number(rejection["measured"]),
            limit=_number(rejection["limit"]),
            unit=rejection["unit"],
        )
        for rejection in data["rejections"]
    ]
    return SavedDetection(
        stamp_ns=int(data["stamp_ns"]),
        observations=tuple(SavedObservation(**observation) for observation in data["observations"]),
        rejections=tuple(rejections),
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def nan_for_null(values: Any) -> Any:
    """Return nested JSON types with NaN for every ``null``: a number that is not known."""
    if isinstance(values, dict):
        return {key: nan_for_null(value) for key, value in values.items()}
    if isinstance(values, list):
        return [nan_for_null(value) for value in values]
    return np.nan if values is None else values


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"cannot read {path}: {error.strerror}; name a run folder") from error
    except UnicodeDecodeError as error:
        raise ResultsError(f"{path} is not a text file in UTF-8") from error
