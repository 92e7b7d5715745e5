"""MCAP files from front to back, for those without a summary or cut off (mcap.dev/spec, version 0)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from stairmap.recordings.bags.decompression import decompress_lz4, decompress_zstd
from stairmap.recordings.bags.stream import BagMessage, BagTopic, plain_type

MCAP_MAGIC = b"\x89MCAP0\r\n"
"""First bytes of a file."""

_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F
_DECOMPRESS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes,
    "lz4": decompress_lz4,
    "zstd": decompress_zstd,
}

_MAX_TEXT = 1 << 24
_CUT_OFF = "is cut off at its end"
_CORRUPT = "has a chunk that is corrupt"


class _Contents:
    """Schemas and channels, as far as they were named by now."""

    def __init__(self) -> None:
        self.schemas: dict[int, tuple[str, str, str]] = {}
        self.topics: dict[int, BagTopic] = {}

    def add_schema(self, record: bytes) -> None:
        stream = BytesIO(record)
        (schema_id,) = struct.unpack("<H", stream.read(2))
        self.schemas[schema_id] = (
            _text(stream),
            _text(stream),
            stream.read(_number(stream, 4)).decode(errors="replace"),
        )

    def add_channel(self, record: bytes) -> None:
        stream = BytesIO(record)
        channel_id, schema_id = struct.unpack("<HH", stream.read(4))
        name, encoding, definition = self.schemas.get(schema_id, ("", "", ""))
        self.topics[channel_id] = BagTopic(
            name=_text(stream),
            type=plain_type(name),
            encoding=_text(stream),
            definition=definition if encoding in {"ros2msg", "ros1msg"} else "",
        )


def scan_mcap(path: Path, losses: list[str]) -> Iterator[BagMessage]:
    """Read all messages that are there; a chunk that is cut off or corrupt is left out.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """
    contents = _Contents()
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(len(MCAP_MAGIC))
        while file.tell() < size:
            start = file.read(9)
            kind, length = start[0], int.from_bytes(start[1:], "little")
            if kind in {_DATA_END, _FOOTER}:
                return
            if len(start) < 9 or file.tell() + length > size:
                losses.append(_CUT_OFF)
                if kind == _CHUNK:
                    yield from _read_chunk(file.read(), contents, losses)
                return
            record = file.read(length)
            if kind == _CHUNK:
                yield from _read_chunk(record, contents, losses)
            else:
                yield from _read_record(kind, record, contents, losses)
    losses.append(_CUT_OFF)


def _read_chunk(record: bytes, contents: _Contents, losses: list[str]) -> Iterator[BagMessage]:
    stream = BytesIO(record)
    try:
        stream.seek(28)
        compression = _text(stream)
        size = _number(stream, 8)
        chunk = BytesIO(_DECOMPRESS[compression](stream.read(min(size, len(record)))))
    except (KeyError, ValueError, RuntimeError):
        if _CUT_OFF not in losses:
            losses.append(_CORRUPT)
        return
    while len(start := chunk.read(9)) == 9:
        length = int.from_bytes(start[1:], "little")
        if chunk.tell() + length > len(chunk.getbuffer()):
            losses += [] if _CUT_OFF in losses else [_CORRUPT]
            return
        yield from _read_record(start[0], chunk.read(length), contents, losses)


def _read_record(kind: int, record: bytes, contents: _Contents, losses: list[str]) -> Iterator[BagMessage]:
    try:
        if kind == _SCHEMA:
            contents.add_schema(record)
        elif kind == _CHANNEL:
            contents.add_channel(record)
        elif kind == _MESSAGE:
            channel_id, _, recorded_ns = struct.unpack_from("<HIQ", record)
            if channel_id in contents.topics:
                yield BagMessage(topic=contents.topics[channel_id], recorded_ns=recorded_ns, data=record[22:])
    except (struct.error, ValueError, OverflowError):
        losses.append(_CORRUPT)


def _number(stream: BinaryIO, num_bytes: int) -> int:
    return int.from_bytes(stream.read(num_bytes), "little")


def _text(stream: BinaryIO) -> str:
    return stream.read(min(_number(stream, 4), _MAX_TEXT)).decode()
