"""Bags that are whole, of ROS 1 and rosbag2 in SQLite or MCAP: read through their index by rosbags."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from stairmap.recordings.bag_stream import CDR, ROS1, BagMessage, BagTopic, DamagedBagError


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
        topics: dict[str, BagTopic] = {}
        # The readers fail on a broken file in many ways, of which their own error is only one.
        try:
            for path in self._paths:
                with self._open(path) as reader:
                    for connection in reader.connections:
                        known = topics.get(connection.topic)
                        num_before = known.num_messages if known is not None else 0
                        topics[connection.topic] = self._topic(connection, num_before)
        except Exception as error:
            raise DamagedBagError(f"{path}: {error}") from error
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
                with self._open(path) as reader:
                    wanted = [connection for connection in reader.connections if connection.topic in names]
                    if not wanted:
                        continue
                    for connection, recorded_ns, data in reader.messages(connections=wanted):
                        yield BagMessage(
                            topic=self._topics[connection.topic], recorded_ns=recorded_ns, data=data
                        )
        except Exception as error:
            raise DamagedBagError(f"{path}: {error}") from error

    def _open(self, path: Path) -> Any:
        return Ros1Reader(path) if self._is_ros1 else Ros2Reader(path)

    def _topic(self, connection: Any, num_before: int) -> BagTopic:
        has_text = connection.msgdef.format == MessageDefinitionFormat.MSG
        return BagTopic(
            name=connection.topic,
            type=connection.msgtype,
            encoding=ROS1 if self._is_ros1 else CDR,
            definition=connection.msgdef.data if has_text else "",
            num_messages=num_before + connection.msgcount,
        )
