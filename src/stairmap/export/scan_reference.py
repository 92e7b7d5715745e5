"""``scan.json``: which files of points a scan looked at, so that they can be read again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from stairmap.arrays import Transform, readonly
from stairmap.clouds.thinning import ThinnedCloud
from stairmap.errors import RecordingError, ResultsError
from stairmap.input_files import CheckedModel, parse_json, read_text, shown, validated
from stairmap.recordings.clouds.cloud import Cloud, is_measured
from stairmap.recordings.clouds.open import open_cloud
from stairmap.transforms import transform_points

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


def read_scanned_map(
    reference: ScanReference, *, on_points: Callable[[int], None] = lambda _: None
) -> ThinnedCloud:
    """Read the files of a scan once more, thinned, in the map.

    Parameters
    ----------
    reference
        The scan.
    on_points
        Told how many more points were read.

    Raises
    ------
    RecordingError
        If a file is not there any more or cannot be read.
    """
    cloud: ThinnedCloud | None = None
    for file in reference.open():
        for chunk in file.chunks():
            on_points(len(chunk))
            points = transform_points(reference.map_from_file, chunk[is_measured(chunk)])
            if len(points):
                cloud = ThinnedCloud(np.round(points.mean(axis=0))) if cloud is None else cloud
                cloud.add(points)
    if cloud is None:
        raise RecordingError(f"{shown(reference.paths[0])} holds no point with coordinates")
    return cloud


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
