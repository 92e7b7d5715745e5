"""``recording.json``: which recording a run looked at, so that viewers find its frames again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stairmap.errors import RecordingError
from stairmap.export.loading import ResultsError
from stairmap.recordings.base import Recording
from stairmap.recordings.open import open_recording

RECORDING_FILE = "recording.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingReference:
    """A recording and how it was opened.

    Attributes
    ----------
    path
        Absolute path of the recording.
    options
        Keyword arguments of ``open_recording`` that were given, as text; paths are absolute.
    """

    path: Path
    options: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def from_arguments(cls, path: Path, **options: Any) -> RecordingReference:
        """Note what ``open_recording`` was called with; ``None`` is the default and left out."""
        given = {name: value for name, value in options.items() if value is not None}
        texts = {name: str(v.resolve() if isinstance(v, Path) else v) for name, v in given.items()}
        return cls(path=path.resolve(), options=texts)

    def to_json(self) -> str:
        """Return the text of ``recording.json``."""
        return json.dumps({"path": str(self.path), "options": dict(self.options)}, indent=1) + "\n"

    def open(self) -> Recording:
        """Open the recording as the run did.

        Raises
        ------
        RecordingError
            If it is not there any more, or cannot be opened.
        """
        if not self.path.exists():
            raise RecordingError(
                f"the recording of this run is not at {self.path} any more; pass --recording PATH"
            )
        options: dict[str, Any] = dict(self.options)
        if "trajectory" in options:
            options["trajectory"] = Path(options["trajectory"])
        return open_recording(self.path, **options)


def load_recording_reference(run: Path) -> RecordingReference | None:
    """Read ``recording.json`` of a run folder; ``None`` where there is none, as in one of an older version.

    Raises
    ------
    ResultsError
        If the file cannot be read.
    """
    path = run / RECORDING_FILE
    if not path.is_file():
        return None
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        return RecordingReference(
            path=Path(values["path"]),
            options={str(name): str(value) for name, value in values["options"].items()},
        )
    except OSError as error:
        raise ResultsError(f"cannot read {path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultsError(f"{path} is not what stairmap writes: {error}") from error
