"""Read E57 files, the exchange format of terrestrial scanners, with the package e57."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import MissingPackageError, RecordingError
from stairmap.input_files import shown
from stairmap.recordings.clouds.cloud import CHUNK_POINTS, Cloud
from stairmap.recordings.clouds.foreign_errors import refused_as


def open_e57(path: Path) -> Cloud:
    """Open an E57 file; its scans are placed by their poses, in metres, as the format asks.

    Raises
    ------
    RecordingError
        If it cannot be read, or holds no scan.
    MissingPackageError
        If e57 is not installed.
    """
    try:
        import e57  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("e57", "e57", "reading E57 files") from error

    def read() -> Iterator[Points]:
        with refused_as(f"cannot read {shown(path)} as E57"):
            if "<points" not in str(e57.raw_xml(str(path))):
                raise RecordingError(f"expected scans in {shown(path)}, but it holds none; export them too")
            points = np.asarray(e57.read_points(str(path)).points, dtype=np.float64).reshape(-1, 3)
        for start in range(0, len(points), CHUNK_POINTS):
            yield points[start : start + CHUNK_POINTS]

    return Cloud(path=path, kind="E57", num_points=None, read=read, is_metric=True)
