"""What a batch asks of each recording, and what comes of it: values that travel between machines."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field

import stairmap
from stairmap.input_files import CheckedModel, validated
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recordings.bag_options import BagOptions
from stairmap.saved_stairway import MAX_STAIRWAYS, SavedStairway

FINGERPRINT_LENGTH = 16
"""Hexadecimal digits of a fingerprint: two among a million settings are alike once in 10^7 batches."""

MAX_NAME_LENGTH = 4096
"""Longest path or address of a recording, characters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchSettings:
    """How all recordings of a batch are looked at; the arguments of ``stairmap run`` of the same names.

    Attributes
    ----------
    config_yaml
        The configuration as ``dump_config`` writes it; with odometry only what was given.
    method, up, pose_format, with_odometry
        See ``stairmap run --help``.
    bag
        What to take of bags.
    with_reports
        Whether each run folder gets a ``report.html``.
    version
        Version of stairmap that must do it.
    """

    config_yaml: str = ""
    method: str = DEFAULT_METHOD
    up: str | None = None
    pose_format: str | None = None
    with_odometry: bool = False
    bag: BagOptions = field(default_factory=BagOptions)
    with_reports: bool = False
    version: str = stairmap.__version__

    def fingerprint(self) -> str:
        """Return a text that is the same for settings that give the same stairways."""
        values = asdict(replace(self, with_reports=False))
        text = json.dumps(values, sort_keys=True, default=str)
        return hashlib.sha256(text.encode("utf-8", "backslashreplace")).hexdigest()[:FINGERPRINT_LENGTH]


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingJob:
    """One recording that is to become one run folder.

    Attributes
    ----------
    recording
        Absolute path, or an address such as ``s3://bucket/hall.mcap``.
    output
        Absolute path of the batch's folder, or its address.
    folder
        Name of the run folder in it.
    token
        Content of the file in ``output`` by which a worker knows that it sees the same disk.
    settings
        How to look at it.
    max_frames
        Recordings that are much longer are given back to be split; 0: none is.
    """

    recording: str
    output: str
    folder: str
    token: str
    settings: BatchSettings
    max_frames: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingResult:
    """What came of one recording.

    Attributes
    ----------
    recording, folder
        As in the job; ``folder`` is empty if there is none.
    fingerprint
        Of the settings.
    num_frames, num_detections
        Frames looked at, and those with stair edges.
    stairways
        As they stand in ``stairways.json``, without single steps.
    error
        Why it failed, in a line; empty if it did not. A recording that broke off has stairways and an error.
    cpu_s
        Processor time that it took, s.
    num_to_split
        Frames of a recording that is too long for one task; 0 for any other.
    packed
        The run folder as a ZIP archive, from a worker that does not see the batch's disk; else empty.
    """

    recording: str
    folder: str
    fingerprint: str
    num_frames: int = 0
    num_detections: int = 0
    stairways: tuple[Mapping[str, Any], ...] = ()
    error: str = ""
    cpu_s: float = 0.0
    num_to_split: int = 0
    packed: bytes = b""

    @property
    def is_done(self) -> bool:
        """Whether it has a run folder, and is not to be done again."""
        return bool(self.folder)

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types, without ``packed``."""
        return {
            "recording": self.recording,
            "folder": self.folder,
            "fingerprint": self.fingerprint,
            "num_frames": self.num_frames,
            "num_detections": self.num_detections,
            "stairways": [dict(stairway) for stairway in self.stairways],
            "error": self.error,
            "cpu_s": round(self.cpu_s, 3),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> RecordingResult:
        """Rebuild a result from ``to_dict``.

        Raises
        ------
        ValueError
            If a key is missing or a value impossible.
        """
        saved = validated(_SavedResult, values)
        return cls(
            **{name: getattr(saved, name) for name in _SavedResult.model_fields if name != "stairways"},
            stairways=tuple(values["stairways"]),
        )


def failed_result(job: RecordingJob, error: str) -> RecordingResult:
    """Return the result of a recording that gave none; ``error`` becomes one line."""
    return RecordingResult(
        recording=job.recording,
        folder="",
        fingerprint=job.settings.fingerprint(),
        error=" ".join(error.split()) or "it failed without a reason",
    )


def recording_name(recording: str) -> str:
    """Return the short name of a recording: the last part of its path, a file's without its ending."""
    last = recording.rstrip("/").rpartition("/")[2]
    path = Path(last)
    return path.stem if path.suffix else last


def _check_text(value: Any) -> str:
    # Not ``str``: pydantic takes no names that are not UTF-8.
    if not isinstance(value, str) or not value or "\0" in value or len(value) > MAX_NAME_LENGTH:
        raise ValueError("should be a path or an address")
    return value


class _SavedResult(CheckedModel):
    """A result in ``batch.jsonl`` and ``task.json``."""

    recording: Annotated[Any, AfterValidator(_check_text)]
    folder: str
    fingerprint: str
    num_frames: Annotated[int, Field(ge=0)]
    num_detections: Annotated[int, Field(ge=0)]
    stairways: Annotated[list[SavedStairway], Field(max_length=MAX_STAIRWAYS)]
    error: Any
    cpu_s: Annotated[float, Field(ge=0)]
