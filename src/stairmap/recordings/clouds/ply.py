"""Read the vertices of PLY files: ascii and binary of both byte orders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.arrays import Points
from stairmap.errors import RecordingError
from stairmap.input_files import quoted, shown
from stairmap.recordings.clouds.cloud import MAX_POINTS, Cloud
from stairmap.recordings.clouds.records import AXES, check_has_room, read_records, sample_records
from stairmap.recordings.clouds.text import MAX_LINE, read_text_points

MAX_HEADER_LINES = 1000
"""Most lines of a header."""

_FORMATS = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip


@dataclass(slots=True, kw_only=True)
class _Element:
    """An element of the header as it is read: its name, count and fields; a list has no fixed size."""

    name: str
    count: int
    fields: list[tuple[str, str]] = field(default_factory=list)
    has_list: bool = False


def open_ply(path: Path) -> Cloud:
    """Open a PLY file; of a mesh only the vertices count.

    Raises
    ------
    RecordingError
        If its header cannot be read, has no vertices with x, y and z, or tells of more than the file holds.
    """
    order, elements, offset = _read_header(path)
    place = next((index for index, element in enumerate(elements) if element.name == "vertex"), None)
    if place is None:
        raise RecordingError(f"expected an element vertex in {shown(path)}, but it has none")
    vertex = elements[place]
    names = [name for name, _ in vertex.fields]
    if vertex.has_list or any(names.count(axis) != 1 for axis in AXES):
        raise RecordingError(
            f"expected vertices with x, y and z in {shown(path)}, but they have "
            f"{quoted(' '.join(names) or 'none')}"
        )
    before = elements[:place]
    if any(element.has_list for element in before):
        raise RecordingError(f"the vertices of {shown(path)} come after lists; write them first")
    pieces: Callable[[], Iterator[Points]] | None = None
    if order == "ascii":
        if before:
            raise RecordingError(f"the vertices of {shown(path)} come after other elements; write them first")
        columns = tuple(names.index(axis) for axis in AXES)

        def read() -> Iterator[Points]:
            return read_text_points(
                path,
                offset=offset,
                columns=(columns[0], columns[1], columns[2]),
                num_columns=len(names),
                num_points=vertex.count,
            )
    else:
        start = offset + sum(element.count * _dtype(element, order).itemsize for element in before)
        dtype = _dtype(vertex, order)
        check_has_room(path, offset=start, record_size=dtype.itemsize, num_points=vertex.count)

        def read() -> Iterator[Points]:
            return read_records(path, dtype, offset=start, num_points=vertex.count)

        def pieces() -> Iterator[Points]:
            return sample_records(path, dtype, offset=start, num_points=vertex.count)

    kind = {"ascii": "ascii", "<": "binary", ">": "binary, big-endian"}[order]
    return Cloud(path=path, kind=f"PLY, {kind}", num_points=vertex.count, read=read, pieces=pieces)


def _dtype(element: _Element, order: str) -> np.dtype[Any]:
    # Names may be there twice; numpy wants each once.
    return np.dtype(
        {
            "names": [name if name in AXES else f"{index}" for index, (name, _) in enumerate(element.fields)],
            "formats": [order + kind for _, kind in element.fields],
        }
    )


def _read_header(path: Path) -> tuple[str, list[_Element], int]:
    order: str | None = None
    elements: list[_Element] = []
    try:
        with path.open("rb") as file:
            for _ in range(MAX_HEADER_LINES):
                words = file.readline(MAX_LINE).decode("ascii", "replace").split()
                if words[:1] == ["end_header"]:
                    if order is None:
                        break
                    return order, elements, file.tell()
                if words[:1] == ["format"]:
                    order = _FORMATS.get(words[1] if len(words) > 1 else "")
                    if order is None:
                        raise RecordingError(
                            "expected format ascii, binary_little_endian or binary_big_endian in "
                            f"{shown(path)}, "
                            f"got {quoted(' '.join(words[1:]))}"
                        )
                elif words[:1] == ["element"]:
                    elements.append(_read_element(path, words))
                elif words[:1] == ["property"] and elements:
                    _add_property(path, elements[-1], words)
    except OSError as error:
        raise RecordingError(f"cannot read {shown(path)}: {error.strerror}") from error
    raise RecordingError(
        f"expected the header of a PLY file in {shown(path)}, but it has no end_header or format"
    )


def _read_element(path: Path, words: list[str]) -> _Element:
    try:
        name, count = words[1], int(words[2])
    except (IndexError, ValueError):
        raise RecordingError(
            f"expected 'element NAME NUMBER' in {shown(path)}, got {quoted(' '.join(words))}"
        ) from None
    if not 0 <= count <= MAX_POINTS:
        raise RecordingError(f"the header of {shown(path)} says {count:,} of {quoted(name)}, which cannot be")
    return _Element(name=name, count=count)


def _add_property(path: Path, element: _Element, words: list[str]) -> None:
    if words[1:2] == ["list"]:
        element.has_list = True
        return
    kind = _TYPES.get(words[1] if len(words) > 1 else "")
    if kind is None or len(words) < 3:
        raise RecordingError(f"unknown property in {shown(path)}: {quoted(' '.join(words))}")
    element.fields.append((words[2], kind))
