"""Hold the header of a LAS or LAZ file against the file's size, before anything believes what it says.

A damaged header may tell of a billion records; what reads them would work for minutes, or end the whole
process for want of memory. Numbers stand where the specifications of LAS 1.4 (ASPRS, R15) and LAZ put them.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, BinaryIO

from stairmap.errors import RecordingError
from stairmap.input_files import shown

_SMALLEST_HEADER = 227
_HEADER_OF_1_4 = 375
_RECORD_HEADER = 54
_LONG_RECORD_HEADER = 60
_COMPRESSED = 0x80
_TABLE_HEADER = 8
_NOT_KNOWN = -1

MAX_CHUNK_BYTES = 2**30
"""Largest piece of a LAZ file that is decompressed at once, bytes; writers take some 50,000 points."""


def check_las_header(path: Path) -> None:
    """Refuse a header that promises more than the file has room for.

    Raises
    ------
    RecordingError
        If it does, or the file cannot be read.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            header = file.read(_HEADER_OF_1_4)
            wrong = _find_wrong(file, header, size)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    if wrong is not None:
        raise RecordingError(
            f"cannot read {shown(path)} as LAS: its header says {wrong}; it is damaged or cut off"
        )


def _find_wrong(file: BinaryIO, header: bytes, size: int) -> str | None:
    if len(header) < _SMALLEST_HEADER or not header.startswith(b"LASF"):
        return f"less than the {_SMALLEST_HEADER} bytes that it must have"
    header_size, points_at, num_records = struct.unpack_from("<HII", header, 94)
    kind, point_size = struct.unpack_from("<BH", header, 104)
    if not _SMALLEST_HEADER <= header_size <= points_at <= size:
        return f"that points begin at byte {points_at:,} of {size:,}"
    if num_records * _RECORD_HEADER > points_at - header_size:
        return f"that {num_records:,} records stand before them"
    if header[25] >= 4 and header_size >= _HEADER_OF_1_4 <= len(header):
        records_at, num_records = struct.unpack_from("<QI", header, 235)
        if num_records and records_at + num_records * _LONG_RECORD_HEADER > size:
            return f"that {num_records:,} records follow at byte {records_at:,} of {size:,}"
    return _find_wrong_table(file, points_at, point_size, size) if kind & _COMPRESSED else None


def _find_wrong_table(file: BinaryIO, points_at: int, point_size: int, size: int) -> str | None:
    """The table of a LAZ file's chunks, of which each begins with a point as it is."""
    file.seek(points_at)
    start = file.read(8)
    if len(start) < 8:
        return None  # no points at all
    (table_at,) = struct.unpack("<q", start)
    if table_at == _NOT_KNOWN:
        file.seek(size - 8)
        (table_at,) = struct.unpack("<q", file.read(8))
    if not points_at <= table_at <= size - _TABLE_HEADER:
        return f"that the table of its chunks is at byte {table_at:,} of {size:,}"
    file.seek(table_at)
    _, num_chunks = struct.unpack("<II", file.read(_TABLE_HEADER))
    if num_chunks * max(point_size, 1) > size:
        return f"{num_chunks:,} chunks of points"
    return None


def check_laz_chunks(path: Path, record: bytes) -> None:
    """Refuse a LAZ file whose chunks, by their table, are larger than the file or than the memory.

    Parameters
    ----------
    path
        A file whose header was checked.
    record
        Its record about the compression.

    Raises
    ------
    RecordingError
        If they are, or the table cannot be read.
    """
    import lazrs  # noqa: PLC0415

    size = path.stat().st_size
    with path.open("rb") as file:
        (points_at,) = struct.unpack_from("<I", file.read(_SMALLEST_HEADER), 96)
        file.seek(points_at)
        about = lazrs.LazVlr(record)
        chunks: list[Any] = lazrs.read_chunk_table(file, about) or []
    points = (
        max((int(count) for count, _ in chunks), default=0)
        if about.uses_variable_size_chunks()
        else about.chunk_size()
    )
    if sum(int(length) for _, length in chunks) > size or points * about.item_size() > MAX_CHUNK_BYTES:
        raise RecordingError(
            f"cannot read {shown(path)} as LAZ: by the table of its chunks they are larger than the file; "
            "it is damaged or cut off"
        )
