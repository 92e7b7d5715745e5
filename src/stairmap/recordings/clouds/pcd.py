"""Read PCD files of the Point Cloud Library: ascii, binary and binary_compressed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from stairmap.arrays import Points, Vector
from stairmap.errors import RecordingError
from stairmap.input_files import quoted, shown
from stairmap.recordings.clouds.cloud import CHUNK_POINTS, MAX_POINTS, Cloud
from stairmap.recordings.clouds.lzf import decompress_lzf
from stairmap.recordings.clouds.records import AXES, check_has_room, read_records, sample_records
from stairmap.recordings.clouds.text import MAX_LINE, read_text_points

MAX_HEADER_LINES = 64
"""Most lines of a header, comments included."""

MAX_RECORD_SIZE = 1 << 16
"""Largest record of a point, bytes."""

MAX_COMPRESSED_SIZE = 4 * 2**30
"""Largest compressed file that is read, bytes unpacked: the format keeps all of it in one piece."""

_TYPES = {
    ("F", 4): "<f4", ("F", 8): "<f8",
    ("I", 1): "i1", ("I", 2): "<i2", ("I", 4): "<i4", ("I", 8): "<i8",
    ("U", 1): "u1", ("U", 2): "<u2", ("U", 4): "<u4", ("U", 8): "<u8",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Header:
    """What a header says, and where the points begin (bytes)."""

    fields: tuple[str, ...]
    types: tuple[str, ...]
    counts: tuple[int, ...]
    num_points: int
    shape: tuple[int, int] | None
    viewpoint: Vector | None
    data: str
    offset: int

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of a binary record; fields that have no name of their own are skipped."""
        names, formats, offsets, size = [], [], [], 0
        for name, kind, count in zip(self.fields, self.types, self.counts, strict=True):
            if name in AXES and name not in names:
                names.append(name)
                formats.append(kind)
                offsets.append(size)
            size += np.dtype(kind).itemsize * count
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})


def open_pcd(path: Path) -> Cloud:
    """Open a PCD file.

    Raises
    ------
    RecordingError
        If its header cannot be read, has no x, y and z, or tells of more than the file holds.
    """
    header = _read_header(path)
    pieces: Callable[[], Iterator[Points]] | None = None
    if header.data == "ascii":
        columns = _columns(header)

        def read() -> Iterator[Points]:
            return read_text_points(
                path,
                offset=header.offset,
                columns=columns,
                num_columns=sum(header.counts),
                num_points=header.num_points,
            )
    elif header.data == "binary":
        dtype = header.dtype
        check_has_room(path, offset=header.offset, record_size=dtype.itemsize, num_points=header.num_points)

        def read() -> Iterator[Points]:
            return read_records(path, dtype, offset=header.offset, num_points=header.num_points)

        def pieces() -> Iterator[Points]:
            return sample_records(path, dtype, offset=header.offset, num_points=header.num_points)
    else:

        def read() -> Iterator[Points]:
            return _read_compressed(path, header)

    return Cloud(
        path=path,
        kind=f"PCD, {header.data}",
        num_points=header.num_points,
        read=read,
        pieces=pieces,
        viewpoint=header.viewpoint,
        shape=header.shape,
    )


def _read_header(path: Path) -> _Header:
    values: dict[str, list[str]] = {}
    try:
        with path.open("rb") as file:
            for _ in range(MAX_HEADER_LINES):
                line = file.readline(MAX_LINE)
                words = line.decode("ascii", "replace").split()
                if not line:
                    break
                if not words or words[0].startswith("#"):
                    continue
                values[words[0].upper()] = words[1:]
                if words[0].upper() == "DATA":
                    return _make_header(path, values, file)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    raise RecordingError(f"expected the header of a PCD file in {shown(path)}, but it has no line DATA")


def _make_header(path: Path, values: dict[str, list[str]], file: BinaryIO) -> _Header:
    def numbers(name: str) -> list[int]:
        try:
            return [int(word) for word in values[name]]
        except KeyError:
            raise RecordingError(f"the header of {shown(path)} has no line {name}") from None
        except ValueError:
            raise RecordingError(
                f"expected whole numbers after {name} in {shown(path)}, got {quoted(' '.join(values[name]))}"
            ) from None

    fields = tuple(values.get("FIELDS", values.get("COLUMNS", [])))
    sizes, kinds = numbers("SIZE"), values.get("TYPE", [])
    counts = numbers("COUNT") if "COUNT" in values else [1] * len(fields)
    if not len(fields) == len(sizes) == len(kinds) == len(counts):
        raise RecordingError(
            f"the header of {shown(path)} names {len(fields)} fields, but {len(sizes)} sizes, "
            f"{len(kinds)} types "
            f"and {len(counts)} counts"
        )
    missing = [axis for axis in AXES if axis not in fields]
    if missing:
        raise RecordingError(
            f"expected fields x, y and z in {shown(path)}, but it has {quoted(' '.join(fields) or 'none')}"
        )
    types = []
    for name, kind, size, count in zip(fields, kinds, sizes, counts, strict=True):
        known = _TYPES.get((kind.upper(), size))
        if known is None or not 0 < count <= MAX_RECORD_SIZE or (name in AXES and count != 1):
            raise RecordingError(
                f"field {quoted(name)} of {shown(path)} has the unknown type "
                f"{quoted(f'{kind} {size} x {count}')}"
            )
        types.append(known)
    width, height = numbers("WIDTH")[:1], (numbers("HEIGHT")[:1] if "HEIGHT" in values else [1])
    if not width or not height:
        raise RecordingError(f"the header of {shown(path)} does not say how many points there are")
    num_points = numbers("POINTS")[0] if values.get("POINTS") else width[0] * height[0]
    if not 0 <= num_points <= MAX_POINTS or width[0] * height[0] != num_points:
        raise RecordingError(
            f"the header of {shown(path)} says {num_points:,} points, but {width[0]} x {height[0]} in "
            "width and height"
        )
    data = values["DATA"][0].lower() if values["DATA"] else ""
    if data not in ("ascii", "binary", "binary_compressed"):
        raise RecordingError(
            f"expected DATA ascii, binary or binary_compressed in {shown(path)}, got {quoted(data)}"
        )
    return _Header(
        fields=fields,
        types=tuple(types),
        counts=tuple(counts),
        num_points=num_points,
        shape=(height[0], width[0]) if height[0] > 1 else None,
        viewpoint=_viewpoint(values.get("VIEWPOINT", [])),
        data=data,
        offset=file.tell(),
    )


def _viewpoint(words: list[str]) -> Vector | None:
    """Where the sensor stood; the default of all files without one, the origin, tells nothing."""
    try:
        place = np.array([float(word) for word in words[:3]])
    except ValueError:
        return None
    return place if len(place) == 3 and np.isfinite(place).all() and place.any() else None


def _columns(header: _Header) -> tuple[int, int, int]:
    starts = np.cumsum([0, *header.counts[:-1]])
    x, y, z = (int(starts[header.fields.index(axis)]) for axis in AXES)
    return x, y, z


def _read_compressed(path: Path, header: _Header) -> Iterator[Points]:
    """Points of one compressed block, in which each field stands by itself."""
    sizes = [np.dtype(kind).itemsize * count for kind, count in zip(header.types, header.counts, strict=True)]
    expected = sum(sizes) * header.num_points
    try:
        with path.open("rb") as file:
            file.seek(header.offset)
            lengths = np.frombuffer(file.read(8), dtype="<u4")
            if len(lengths) < 2:
                raise RecordingError(f"{shown(path)} ends where its compressed points should begin")
            packed_size, size = (int(value) for value in lengths)
            if size != expected or size > MAX_COMPRESSED_SIZE:
                raise RecordingError(
                    f"the compressed points of {shown(path)} have {size:,} bytes, but its header asks "
                    f"for {expected:,}"
                )
            packed = file.read(packed_size)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    if len(packed) < packed_size:
        raise RecordingError(
            f"{shown(path)} has {len(packed):,} of {packed_size:,} compressed bytes: it was cut off; "
            "copy it again"
        )
    try:
        data = decompress_lzf(packed, size)
    except ValueError as error:
        raise RecordingError(f"cannot unpack the points of {shown(path)}: {error}") from error
    del packed
    starts = np.cumsum([0, *sizes[:-1]]) * header.num_points
    columns = []
    for axis in AXES:
        index = header.fields.index(axis)
        columns.append(
            np.frombuffer(data, dtype=header.types[index], count=header.num_points, offset=int(starts[index]))
        )
    for chunk in range(math.ceil(header.num_points / CHUNK_POINTS)):
        part = slice(chunk * CHUNK_POINTS, (chunk + 1) * CHUNK_POINTS)
        yield np.stack([column[part].astype(np.float64) for column in columns], axis=1)
