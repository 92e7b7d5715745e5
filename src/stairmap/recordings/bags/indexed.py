"""Bags that are whole, of ROS 1 and rosbag2 in SQLite or MCAP: read through their index by rosbags."""

from __future__ import annotations

import weakref
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from stairmap.recordings.bags.stream import CDR, ROS1, BagMessage, BagTopic, DamagedBagError, one_line


class IndexedBag:
    """One bag, of one file or several that follow each other.

    Parameters
    ----------
    paths
        ROS 1 bags, or rosbag2 folders or files, in the order of time.
    is_ros1
        Whether they are of ROS 1.

    Raises
    ------
    DamagedBagError
        If the index cannot be read.
    """

    def __init__(self, paths: Sequence[Path], *, is_ros1: bool) -> None:
        self._paths = tuple(paths)
        self._is_ros1 = is_ros1
        # The index of an hour's bag takes seconds to read, so readers stay open.
        self._idle: dict[Path, Any] = {}
        weakref.finalize(self, _close_all, self._idle)
        topics: dict[str, BagTopic] = {}
        # The readers fail on a broken file in many ways, of which their own error is only one.
        try:
            for path in self._paths:
                with self._reader(path) as reader:
                    for connection in reader.connections:
                        known = topics.get(connection.topic)
                        num_before = known.num_messages if known is not None else 0
                        topics[connection.topic] = self._topic(connection, num_before)
        except Exception as error:
            raise DamagedBagError(f"{path}: {one_line(error)}") from error
        self._topics = {name: topics[name] for name in sorted(topics)}

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All topics, by name."""
        return tuple(self._topics.values())

    @property
    def damage(self) -> None:
        """Nothing is lost of a bag that has its index."""
        return

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Read the messages of some topics from the beginning.

        Raises
        ------
        DamagedBagError
            If the bag cannot be read on.
        """
        try:
            for path in self._paths:
                with self._reader(path) as reader:
                    wanted = [connection for connection in reader.connections if connection.topic in names]
                    if not wanted:
                        continue
                    for connection, recorded_ns, data in reader.messages(connections=wanted):
                        yield BagMessage(
                            topic=self._topics[connection.topic], recorded_ns=recorded_ns, data=data
                        )
        except Exception as error:
            raise DamagedBagError(f"{path}: {one_line(error)}") from error

    @contextmanager
    def _reader(self, path: Path) -> Iterator[Any]:
        """A reader that nobody else uses meanwhile."""
        reader = self._idle.pop(path, None)
        if reader is None:
            reader = Ros1Reader(path) if self._is_ros1 else Ros2Reader(path)
            reader.open()
        try:
            yield reader
        finally:
            if path in self._idle:
                reader.close()
            else:
                self._idle[path] = reader

    def _topic(self, connection: Any, num_before: int) -> BagTopic:
        has_text = connection.msgdef.format == MessageDefinitionFormat.MSG
        return BagTopic(
            name=connection.topic,
            type=connection.msgtype,
            encoding=ROS1 if self._is_ros1 else CDR,
            definition=connection.msgdef.data if has_text else "",
            num_messages=num_before + connection.msgcount,
        )


def _close_all(readers: dict[Path, Any]) -> None:
    for reader in readers.values():
        with suppress(Exception):
            reader.close()
    readers.clear()
