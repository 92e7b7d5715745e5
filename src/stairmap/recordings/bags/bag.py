"""Bags of ROS 1 and ROS 2: what a path holds, and the messages in it, whole or cut off."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from stairmap.errors import RecordingError
from stairmap.recordings.bags.decompression import ZSTD_MAGIC, decompress_zstd
from stairmap.recordings.bags.indexed import IndexedBag
from stairmap.recordings.bags.mcap_scan import MCAP_MAGIC, scan_mcap
from stairmap.recordings.bags.message_decoding import MessageDecoder
from stairmap.recordings.bags.ros1_scan import ROS1_MAGIC, scan_ros1_bag
from stairmap.recordings.bags.sequential import ScanBag, SequentialBag
from stairmap.recordings.bags.sqlite_scan import SQLITE_MAGIC, scan_sqlite
from stairmap.recordings.bags.stream import CDR, BagMessage, BagStream, BagTopic, DamagedBagError

METADATA = "metadata.yaml"
"""The file that makes a folder a rosbag2."""

_SCANS: dict[bytes, ScanBag] = {
    ROS1_MAGIC: scan_ros1_bag,
    MCAP_MAGIC: scan_mcap,
    SQLITE_MAGIC: scan_sqlite,
}
_ROS2_SUFFIXES = (".mcap", ".db3")


class Bag:
    """A bag, read through its index, or from front to back where that is broken.

    Parameters
    ----------
    path
        A ROS 1 bag, a rosbag2 folder with or without ``metadata.yaml``, or one of its files.

    Raises
    ------
    RecordingError
        If the path holds no bag, or nothing in it can be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._files = _find_files(path)
        self._decoder = MessageDecoder()
        self._notes: list[str] = []
        self._stream = self._open()
        if not any(topic.num_messages for topic in self._stream.topics):
            raise RecordingError(f"expected messages in {path}, but it has none{self._reason()}")

    @property
    def name(self) -> str:
        """Name of the folder, or of the file without its ending."""
        path = self.path.resolve()
        return path.name if path.is_dir() else path.name.split(".")[0]

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All topics, by name."""
        return self._stream.topics

    @property
    def notes(self) -> tuple[str, ...]:
        """What is lost of the bag, or does not fit, one sentence each."""
        damage = self._stream.damage
        notes = [*self._notes, *([f"{damage}; all that can be read is used"] if damage else [])]
        return tuple(notes)

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Read the messages of some topics from the beginning, in the order in which they were recorded.

        Raises
        ------
        DamagedBagError
            If the bag cannot be read on; after ``read_in_order`` it can.
        """
        for message in self._stream.messages(names):
            # A file of a bag whose messages are compressed one by one does not say so, only its folder does.
            if message.topic.encoding == CDR and message.data.startswith(ZSTD_MAGIC):
                yield replace(message, data=_decompressed(message))
            else:
                yield message

    def decode(self, message: BagMessage) -> Any:
        """Return an object with the fields of a message; see ``MessageDecoder.decode``."""
        return self._decoder.decode(message)

    def read_in_order(self) -> None:
        """From now on read from front to back, without the index, and past what is damaged."""
        self._stream = self._open_in_order()

    def _open(self) -> BagStream:
        folder = self.path if self.path.is_dir() and (self.path / METADATA).exists() else None
        is_ros1 = _magic(self._files[0]) == ROS1_MAGIC
        if any(file.with_name(file.name + "-wal").exists() for file in self._files):
            return self._open_in_order()
        try:
            return IndexedBag([folder] if folder is not None else self._files, is_ros1=is_ros1)
        except DamagedBagError as error:
            stream = self._open_in_order()
            if folder is not None and stream.damage is None:
                self._notes.append(f"{METADATA} does not fit the files, which are read without it: {error}")
            return stream

    def _open_in_order(self) -> BagStream:
        scan = _SCANS.get(_magic(self._files[0]))
        if scan is None:
            raise RecordingError(f"{self._files[0]} is compressed as a whole and cut off; unpack it first")
        try:
            return SequentialBag(self._files, scan)
        except OSError as error:
            raise RecordingError(f"cannot read {self.path}: {error.strerror}") from error

    def _reason(self) -> str:
        return f": {self._stream.damage}" if self._stream.damage else ""


def _decompressed(message: BagMessage) -> bytes:
    try:
        return decompress_zstd(message.data)
    except ValueError:
        return b""


def is_bag(path: Path) -> bool:
    """Tell whether a path looks like a bag: a file by its name or beginning, or a folder of such files.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    if path.is_dir():
        return (path / METADATA).exists() or bool(_bag_files(path))
    return path.suffix in {".bag", *_ROS2_SUFFIXES} or path.name == METADATA or _magic(path) in _SCANS


def _bag_files(folder: Path) -> list[Path]:
    files = sorted(file for file in folder.iterdir() if file.suffix in {".bag", *_ROS2_SUFFIXES})
    return [file for file in files if file.is_file()]


def _find_files(path: Path) -> list[Path]:
    """Return the files of one bag."""
    if not path.is_dir():
        if _magic(path) not in _SCANS:
            raise RecordingError(_describe_stranger(path))
        return [path]
    files = [
        file
        for file in sorted(path.iterdir(), key=_counting_order)
        if _magic(file) in _SCANS or file.suffix == ".zstd"
    ]
    if not files:
        raise RecordingError(f"expected the files of a bag in {path}, but it has none (.bag, .db3, .mcap)")
    if len(files) > 1 and _magic(files[0]) == ROS1_MAGIC:
        names = ", ".join(file.name for file in files[:5])
        raise RecordingError(f"expected one bag, but {path} has {len(files)}: {names}; pass one of them")
    return files


def _counting_order(file: Path) -> list[tuple[int, str]]:
    """Key by which walk_2.mcap comes before walk_10.mcap, as it was recorded."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"([0-9]+)", file.name)]


def _describe_stranger(path: Path) -> str:
    if path.stat().st_size == 0:
        return f"{path} is empty; expected a bag of ROS 1 (.bag) or ROS 2 (.mcap, .db3)"
    with path.open("rb") as file:
        beginning = file.read(16)
    kind = "only zeros" if not beginning.strip(b"\0") else f"{beginning!r}"
    return f"{path} is no bag: it begins with {kind}; expected one of ROS 1 (.bag) or ROS 2 (.mcap, .db3)"


def _magic(path: Path) -> bytes:
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        beginning = file.read(max(map(len, _SCANS)))
    return next((magic for magic in _SCANS if beginning.startswith(magic)), b"")
