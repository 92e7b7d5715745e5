"""ROS 1 bags from front to back, for those that were not closed or are cut off (rosbag format 2.0)."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable, Iterator
from io import SEEK_CUR, BytesIO
from pathlib import Path
from typing import BinaryIO

from stairmap.recordings.bags.decompression import decompress_lz4
from stairmap.recordings.bags.stream import ROS1, BagMessage, BagTopic, plain_type

ROS1_MAGIC = b"#ROSBAG V2.0\n"
"""First line of a bag."""

_MESSAGE, _BAG_HEADER, _CHUNK, _CONNECTION = 2, 3, 5, 7
_DECOMPRESS: dict[bytes, Callable[[bytes], bytes]] = {
    b"none": bytes,
    b"bz2": bz2.decompress,
    b"lz4": decompress_lz4,
}
_MAX_HEADER_SIZE = 1 << 24


def scan_ros1_bag(path: Path, losses: list[str]) -> Iterator[BagMessage]:
    """Read all messages that are there; a chunk that is cut off or corrupt is left out.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """
    topics: dict[bytes, BagTopic] = {}
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(len(ROS1_MAGIC))
        while file.tell() < size:
            header = _read_header(file)
            data_size = _read_size(file)
            if header is None or data_size is None:
                losses.append("is cut off at its end")
                return
            is_whole = file.tell() + data_size <= size
            kind = (header.get(b"op") or b"\0")[0]
            if kind == _BAG_HEADER and header.get(b"index_pos") == bytes(8):
                losses.append("was not closed by its recorder")
            if kind != _CHUNK:
                file.seek(data_size, SEEK_CUR)
            elif is_whole or header.get(b"compression") == b"none":
                try:
                    chunk = _DECOMPRESS[header[b"compression"]](file.read(data_size))
                    yield from _read_chunk(chunk, topics)
                except (KeyError, IndexError, ValueError, RuntimeError, OSError, EOFError, struct.error):
                    losses.append("has a chunk that is corrupt")
            if not is_whole:
                losses.append("is cut off at its end")
                return


def _read_chunk(chunk: bytes, topics: dict[bytes, BagTopic]) -> Iterator[BagMessage]:
    stream = BytesIO(chunk)
    while (header := _read_header(stream)) is not None:
        data_size = _read_size(stream)
        data = stream.read(data_size or 0)
        if data_size is None or len(data) < data_size:
            return
        kind = header[b"op"][0]
        if kind == _CONNECTION:
            topics[header[b"conn"]] = _topic(header, _fields(data))
        elif kind == _MESSAGE:
            seconds, nanoseconds = struct.unpack("<II", header[b"time"])
            yield BagMessage(
                topic=topics[header[b"conn"]],
                recorded_ns=seconds * 1_000_000_000 + nanoseconds,
                data=data,
            )


def _topic(header: dict[bytes, bytes], fields: dict[bytes, bytes]) -> BagTopic:
    name = header[b"topic"].decode()
    return BagTopic(
        name="/" * name.startswith("/") + "/".join(part for part in name.split("/") if part),
        type=plain_type(fields[b"type"].decode()),
        encoding=ROS1,
        definition=fields[b"message_definition"].decode(errors="replace"),
    )


def _read_size(stream: BinaryIO) -> int | None:
    data = stream.read(4)
    return int.from_bytes(data, "little") if len(data) == 4 else None


def _read_header(stream: BinaryIO) -> dict[bytes, bytes] | None:
    """Fields of the next record's header; ``None`` at the end of what is there."""
    size = _read_size(stream)
    if size is None or size > _MAX_HEADER_SIZE:
        return None
    data = stream.read(size)
    return _fields(data) if len(data) == size else None


def _fields(data: bytes) -> dict[bytes, bytes]:
    fields = {}
    start = 0
    while start + 4 <= len(data):
        end = start + 4 + int.from_bytes(data[start : start + 4], "little")
        name, _, value = data[start + 4 : end].partition(b"=")
        fields[name] = value
        start = end
    return fields
