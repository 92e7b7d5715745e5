"""Read points from text: three numbers a line or more, between blanks, commas or semicolons."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import RecordingError
from stairmap.input_files import quoted, shown
from stairmap.recordings.clouds.cloud import NUM_PIECES, Cloud

BLOCK_SIZE = 16 * 2**20
"""Text is read in blocks of so many bytes."""

PIECE_SIZE = 2**19
"""Size of a piece of a file that is only sampled, bytes."""

MAX_LINE = 2**16
"""Longest line, bytes: more is no text of points."""

MAX_HEADER_LINES = 16
"""Most lines without coordinates at the beginning of a file."""

_SEPARATORS = bytes.maketrans(b",;\t\r", b"    ")


def open_text(path: Path) -> Cloud:
    """Open a text file of points.

    Comments (``#``, ``//``), a line of names and a line with the number of points at the beginning are passed
    over; x, y and z are the first three columns.

    Raises
    ------
    RecordingError
        If no line of its beginning holds three numbers.
    """
    try:
        with path.open("rb") as file:
            offset, num_columns, line = _find_first_point(file)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    if num_columns < 3:
        raise RecordingError(
            f"expected lines of x y z in {shown(path)}, got {quoted(line)}; is it another kind of file?"
        )
    return Cloud(
        path=path,
        kind="text",
        num_points=None,
        read=lambda: read_text_points(path, offset=offset, columns=(0, 1, 2), num_columns=num_columns),
        pieces=lambda: sample_text(path, offset=offset, columns=(0, 1, 2), num_columns=num_columns),
    )


def read_text_points(
    path: Path, *, offset: int, columns: tuple[int, int, int], num_columns: int, num_points: int | None = None
) -> Iterator[Points]:
    """Yield (N, 3) coordinates of lines of numbers from a place in a file on.

    Parameters
    ----------
    path
        The file.
    offset
        Where the first line begins, bytes.
    columns
        Which columns are x, y and z.
    num_columns
        Numbers in a line.
    num_points
        Lines to read; all if not given.

    Raises
    ------
    RecordingError
        If a line does not hold so many numbers, or there are fewer lines.
    """
    left = num_points
    number = 0
    try:
        with path.open("rb") as file:
            file.seek(offset)
            while left is None or left > 0:
                block = file.read(BLOCK_SIZE)
                if not block:
                    break
                block += file.readline(MAX_LINE)
                values = _parse(block, num_columns, path, number)
                if left is not None:
                    values = values[:left]
                    left -= len(values)
                number += len(values)
                if len(values):
                    yield np.ascontiguousarray(values[:, list(columns)])
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    if left:
        raise RecordingError(
            f"{shown(path)} says it holds {num_points:,} points, but it ends after {number:,}: it was "
            "cut off, "
            "or its header is wrong; copy it again"
        )


def sample_text(
    path: Path, *, offset: int, columns: tuple[int, int, int], num_columns: int
) -> Iterator[Points]:
    """Yield pieces of (N, 3) coordinates from all over the lines of a file; see ``read_text_points``."""
    size = path.stat().st_size
    starts = np.linspace(offset, max(size - PIECE_SIZE, offset), NUM_PIECES).astype(np.int64).tolist()
    try:
        with path.open("rb") as file:
            for start in sorted(set(starts)):
                file.seek(start)
                if start > offset:
                    file.readline(MAX_LINE)
                block = file.read(PIECE_SIZE)
                block = block[: block.rfind(b"\n") + 1] if start + PIECE_SIZE < size else block
                values = _parse(block, num_columns, path, 0)
                yield np.ascontiguousarray(values[:, list(columns)])
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error


def _parse(block: bytes, num_columns: int, path: Path, number: int) -> Points:
    """(N, num_columns) numbers of whole lines; the fast way first."""
    block = block.translate(_SEPARATORS)
    lines = block.count(b"\n") + (not block.endswith(b"\n") and bool(block.strip()))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            values = np.fromstring(block, dtype=np.float64, sep=" ")
        except ValueError:
            values = np.zeros(0)
    if len(values) == lines * num_columns:
        return np.asarray(values.reshape(-1, num_columns))
    # Blank lines and comments, or something that is no number: line by line.
    rows: list[list[float]] = []
    for line in block.split(b"\n"):
        text = line.strip()
        if not text or text.startswith((b"#", b"//")):
            continue
        row = _numbers(text)
        if row is None or len(row) < num_columns:
            raise RecordingError(
                f"expected {num_columns} numbers in each line of {shown(path)}, but line "
                f"{number + len(rows) + 1} "
                f"of the points is {quoted(text.decode('utf-8', 'replace'))}"
            )
        rows.append(row[:num_columns])
    return np.array(rows, dtype=np.float64).reshape(-1, num_columns)


def _find_first_point(file: BinaryIO) -> tuple[int, int, str]:
    """Where the first line with three numbers begins, how many numbers it has, and the last line read."""
    text = ""
    for _ in range(MAX_HEADER_LINES):
        offset = file.tell()
        line = file.readline(MAX_LINE)
        if not line:
            break
        text = line.strip().decode("utf-8", "replace")
        row = _numbers(line.translate(_SEPARATORS).strip())
        if row is not None and len(row) >= 3:
            return offset, len(row), text
    return 0, 0, text


def _numbers(text: bytes) -> list[float] | None:
    try:
        return [float(part) for part in text.split()]
    except ValueError:
        return None
