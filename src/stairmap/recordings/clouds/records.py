"""Read the coordinates of fixed-size binary records, chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import RecordingError
from stairmap.input_files import shown
from stairmap.recordings.clouds.cloud import CHUNK_POINTS, NUM_PIECES, PIECE_POINTS

AXES = ("x", "y", "z")


def check_has_room(path: Path, *, offset: int, record_size: int, num_points: int) -> None:
    """Refuse a file that is shorter than its header says.

    Raises
    ------
    RecordingError
        If it is.
    """
    held = max(path.stat().st_size - offset, 0) // record_size
    if held < num_points:
        raise RecordingError(
            f"{shown(path)} says it holds {num_points:,} points, but it has room for {held:,}: it was "
            "cut off, "
            "or its header is wrong; copy it again"
        )


def read_records(path: Path, dtype: np.dtype[Any], *, offset: int, num_points: int) -> Iterator[Points]:
    """Yield (N, 3) coordinates of records that follow one another in a file.

    Raises
    ------
    RecordingError
        If the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            file.seek(offset)
            left = num_points
            while left > 0:
                records = np.fromfile(file, dtype=dtype, count=min(left, CHUNK_POINTS))
                if not len(records):
                    raise RecordingError(f"{shown(path)} ends {left:,} points before its header says")
                left -= len(records)
                yield coordinates(records)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error


def sample_records(path: Path, dtype: np.dtype[Any], *, offset: int, num_points: int) -> Iterator[Points]:
    """Yield pieces of (N, 3) coordinates from all over the records of a file."""
    try:
        with path.open("rb") as file:
            for start in piece_starts(num_points):
                file.seek(offset + start * dtype.itemsize)
                count = min(PIECE_POINTS, num_points - start)
                yield coordinates(np.fromfile(file, dtype=dtype, count=count))
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error


def piece_starts(num_points: int) -> list[int]:
    """Return where evenly spread pieces of a file begin."""
    num = min(max(-(-num_points // PIECE_POINTS), 1), NUM_PIECES)
    return [int(start) for start in np.linspace(0, max(num_points - PIECE_POINTS, 0), num)]


def coordinates(records: np.ndarray[Any, np.dtype[np.void]]) -> Points:
    """Return the (N, 3) coordinates of records with fields x, y and z."""
    points = np.empty((len(records), 3))
    for column, axis in enumerate(AXES):
        points[:, column] = records[axis]
    return points
