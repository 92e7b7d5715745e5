"""``scan.json``: which files of points a scan looked at, so that they can be read again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from stairmap.arrays import Transform, readonly
from stairmap.errors import RecordingError, ResultsError
from stairmap.input_files import CheckedModel, parse_json, read_text, shown, validated
from stairmap.recordings.clouds.cloud import Cloud
from stairmap.recordings.clouds.open import open_cloud

SCAN_FILE = "scan.json"

_Row = Annotated[list[float], Field(min_length=4, max_length=4)]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanReference:
    """The files of a scan and how their coordinates become the map's.

    Attributes
    ----------
    paths
        Absolute paths of the files.
    map_from_file
        (4, 4) as in ``ScanResult``.
    num_points
        Points that they held.
    """

    paths: tuple[Path, ...]
    map_from_file: Transform
    num_points: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "map_from_file", readonly(self.map_from_file))

    def to_json(self) -> str:
        """Return the text of ``scan.json``."""
        values = {
            "files": [str(path) for path in self.paths],
            "num_points": self.num_points,
            "map_from_file": self.map_from_file.tolist(),
        }
        return json.dumps(values, indent=1) + "\n"

    def open(self) -> tuple[Cloud, ...]:
        """Open the files again.

        Raises
        ------
        RecordingError
            If one is not there any more.
        """
        for path in self.paths:
            if not path.exists():
                raise RecordingError(
                    f"the map of this run is not at {shown(path)} any more; put it back, or scan it again"
                )
        return tuple(open_cloud(path) for path in self.paths)


class _ScanFile(CheckedModel):
    """``scan.json``."""

    files: Annotated[list[str], Field(min_length=1, max_length=100_000)]
    num_points: int
    map_from_file: Annotated[list[_Row], Field(min_length=4, max_length=4)]


def load_scan_reference(run: Path) -> ScanReference | None:
    """Read ``scan.json`` of a run folder; ``None`` where the run was no scan.

    Raises
    ------
    ResultsError
        If the file cannot be read.
    """
    path = run / SCAN_FILE
    if not path.exists():
        return None
    try:
        saved = validated(_ScanFile, parse_json(read_text(path, error_type=ResultsError)))
    except ValueError as error:
        raise ResultsError(f"{shown(path)} is not what stairmap writes: {error}") from error
    return ScanReference(
        paths=tuple(Path(name) for name in saved.files),
        map_from_file=np.array(saved.map_from_file),
        num_points=saved.num_points,
    )
