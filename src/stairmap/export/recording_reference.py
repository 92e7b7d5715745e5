"""``recording.json``: which recording a run looked at, so that viewers find its frames again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from stairmap.errors import RecordingError
from stairmap.export.loading import ResultsError
from stairmap.recordings.bag_options import BagOptions
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
        Keyword arguments of ``open_recording`` that were given, those of ``BagOptions`` among them, as
        text; paths are absolute.
    """

    path: Path
    options: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def from_arguments(
        cls,
        path: Path,
        *,
        trajectory: Path | None = None,
        up: str | None = None,
        bag: BagOptions | None = None,
    ) -> RecordingReference:
        """Note what ``open_recording`` is called with; what is not given is left out."""
        bag_options = {} if bag is None else {f.name: getattr(bag, f.name) for f in fields(bag)}
        given = {"trajectory": trajectory, "up": up, **bag_options}
        texts = {
            name: str(value.resolve() if isinstance(value, Path) else value)
            for name, value in given.items()
            if value is not None
        }
        return cls(path=path.resolve(), options=texts)

    def to_json(self) -> str:
        """Return the text of ``recording.json``."""
        return json.dumps({"path": str(self.path), "options": dict(self.options)}, indent=1) + "\n"

    def open(self) -> Recording:
        """Open the recording as the run did; a trajectory file that is not there any more is left out.

        Raises
        ------
        RecordingError
            If it is not there any more, or cannot be opened.
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
        return open_recording(
            self.path,
            trajectory=trajectory if trajectory is not None and trajectory.is_file() else None,
            up=self.options.get("up"),
            bag=BagOptions(**bag_options),
        )


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
