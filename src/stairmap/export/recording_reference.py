"""``recording.json``: which recording a run looked at, so that viewers find its frames again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from stairmap.errors import RecordingError, ResultsError
from stairmap.export.results import TRAJECTORY_FILE
from stairmap.input_files import CheckedModel, parse_json, read_text, shown, validated
from stairmap.recordings.bag_options import BagOptions
from stairmap.recordings.base import Recording
from stairmap.recordings.identity import RecordingIdentity, check_same_recording
from stairmap.recordings.open import open_recording

RECORDING_FILE = "recording.json"

MAX_PATH_LENGTH = 4096
"""Longest path, characters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingReference:
    """A recording and how it was opened.

    Attributes
    ----------
    path
        Absolute path of the recording.
    options
        Keyword arguments of ``open_recording`` that were given, those of ``BagOptions`` among them, as
        text. Paths are absolute, but for a trajectory that lies in the run folder.
    identity
        What identifies the recording; ``None`` where an older version wrote it down.
    """

    path: Path
    options: Mapping[str, str] = field(default_factory=dict)
    identity: RecordingIdentity | None = None

    @classmethod
    def from_arguments(
        cls,
        path: Path,
        *,
        trajectory: Path | None = None,
        up: str | None = None,
        pose_format: str | None = None,
        bag: BagOptions | None = None,
        identity: RecordingIdentity | None = None,
        with_odometry: bool = False,
    ) -> RecordingReference:
        """Note what ``open_recording`` is called with; what is not given is left out.

        Poses from depth are the run's own: its trajectory is named relative to the run folder, and up is z.
        """
        if with_odometry:
            trajectory, up, pose_format = None, None, None
        bag_options = {} if bag is None else {f.name: getattr(bag, f.name) for f in fields(bag)}
        given = {"trajectory": trajectory, "up": up, "pose_format": pose_format, **bag_options}
        texts = {
            name: str(value.resolve() if isinstance(value, Path) else value)
            for name, value in given.items()
            if value is not None
        }
        if with_odometry:
            texts["trajectory"] = TRAJECTORY_FILE
        return cls(path=path.resolve(), options=texts, identity=identity)

    def to_json(self) -> str:
        """Return the text of ``recording.json``."""
        values: dict[str, Any] = {"path": str(self.path), "options": dict(self.options)}
        if self.identity is not None:
            values["identity"] = self.identity.to_dict()
        return json.dumps(values, indent=1) + "\n"

    def open(self) -> Recording:
        """Open the recording as the run did; a trajectory file that is not there any more is left out.

        Raises
        ------
        RecordingError
            If it is not there any more, cannot be opened, or another one lies in its place.
        """
        if not self.path.exists():
            raise RecordingError(
                f"the recording of this run is not at {self.path} any more; pass --recording PATH"
            )
        trajectory = Path(self.options["trajectory"]) if "trajectory" in self.options else None
        bag_options: dict[str, Any] = {
            f.name: self.options[f.name] for f in fields(BagOptions) if f.name in self.options
        }
        if "camera_file" in bag_options:
            bag_options["camera_file"] = Path(bag_options["camera_file"])
        recording = open_recording(
            self.path,
            trajectory=trajectory if trajectory is not None and trajectory.is_file() else None,
            up=self.options.get("up"),
            pose_format=self.options.get("pose_format"),
            bag=BagOptions(**bag_options),
        )
        if self.identity is not None:
            check_same_recording(recording, self.identity)
        return recording


def _check_path_text(value: Any) -> str:
    if not isinstance(value, str) or not value or "\0" in value or len(value) > MAX_PATH_LENGTH:
        raise ValueError("should be a path")
    return value


# Not ``str``: pydantic takes no names that are not UTF-8.
_PathText = Annotated[Any, AfterValidator(_check_path_text)]


class _RecordingFile(CheckedModel):
    """``recording.json``."""

    path: _PathText
    options: dict[str, _PathText]
    identity: RecordingIdentity | None = None


def load_recording_reference(run: Path) -> RecordingReference | None:
    """Read ``recording.json`` of a run folder; ``None`` where there is none, as in one of an older version.

    Raises
    ------
    ResultsError
        If the file cannot be read.
    """
    path = run / RECORDING_FILE
    if not path.exists():
        return None
    text = read_text(path, error_type=ResultsError)
    try:
        saved = validated(_RecordingFile, parse_json(text))
    except ValueError as error:
        raise ResultsError(f"{shown(path)} is not what stairmap writes: {error}") from error
    options = dict(saved.options)
    if "trajectory" in options:
        options["trajectory"] = str(run / options["trajectory"])
    return RecordingReference(path=Path(saved.path), options=options, identity=saved.identity)
