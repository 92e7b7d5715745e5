"""Read LAS and LAZ files, the formats of surveys, with laspy."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import MissingPackageError, RecordingError
from stairmap.input_files import shown
from stairmap.recordings.clouds.cloud import CHUNK_POINTS, MAX_POINTS, PIECE_POINTS, Cloud
from stairmap.recordings.clouds.foreign_errors import refused_as
from stairmap.recordings.clouds.las_header import check_las_header, check_laz_chunks
from stairmap.recordings.clouds.records import piece_starts


def open_las(path: Path) -> Cloud:
    """Open a LAS or LAZ file; its offsets and scale factors are applied in float64.

    Raises
    ------
    RecordingError
        If it cannot be read.
    MissingPackageError
        If laspy is not installed.
    """
    check_las_header(path)
    with _open(path) as reader:
        num_points = int(reader.header.point_count)
        scales = np.asarray(reader.header.scales)
        kind = "LAZ" if reader.header.are_points_compressed else "LAS"
    if num_points > MAX_POINTS or not np.isfinite(scales).all() or not (scales != 0).all():
        raise RecordingError(
            f"the header of {shown(path)} says {num_points:,} points at scales {scales.tolist()}"
        )
    return Cloud(
        path=path,
        kind=kind,
        num_points=num_points,
        read=lambda: _read(path, num_points),
        pieces=lambda: _sample(path, num_points),
    )


def _open(path: Path) -> Any:
    try:
        import laspy  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("laspy", "clouds", "reading LAS and LAZ files") from error
    with refused_as(f"cannot read {shown(path)} as LAS"):
        reader = laspy.open(path)
        for record in reader.header.vlrs.get("LasZipVlr"):
            check_laz_chunks(path, record.record_data)
    return reader


def _read(path: Path, num_points: int) -> Iterator[Points]:
    count = 0
    with _open(path) as reader:
        chunks = reader.chunk_iterator(CHUNK_POINTS)
        while True:
            with refused_as(f"{shown(path)} could be read up to point {count:,} of {num_points:,}"):
                chunk = next(chunks, None)
                if chunk is None:
                    break
                points = np.stack([np.asarray(chunk.x), np.asarray(chunk.y), np.asarray(chunk.z)], axis=1)
            count += len(points)
            yield points
    if count < num_points:
        raise RecordingError(
            f"{shown(path)} says it holds {num_points:,} points, but it ends after {count:,}: it was "
            "cut off; "
            "copy it again"
        )


def _sample(path: Path, num_points: int) -> Iterator[Points]:
    """Pieces of points from all over the file."""
    with _open(path) as reader:
        for start in piece_starts(num_points):
            yield _read_piece(reader, path, start, min(PIECE_POINTS, num_points - start))


def _read_piece(reader: Any, path: Path, start: int, count: int) -> Points:
    with refused_as(f"{shown(path)} could not be read at point {start:,}"):
        reader.seek(start)
        piece = reader.read_points(count)
        return np.stack([np.asarray(piece.x), np.asarray(piece.y), np.asarray(piece.z)], axis=1)
