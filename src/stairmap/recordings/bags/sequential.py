"""Bags without an index, or with a broken one: read from front to back, as far as they go."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from stairmap.recordings.bags.stream import BagMessage, BagTopic

ScanBag = Callable[[Path, list[str]], Iterator[BagMessage]]
"""Reads a file from front to back, and appends a sentence to the list for each thing that is lost."""


class SequentialBag:
    """One bag, of one file or several that follow each other.

    Parameters
    ----------
    paths
        The files, in the order of time.
    scan
        Reads one of them.

    Raises
    ------
    OSError
        If a file cannot be opened.
    """

    def __init__(self, paths: Sequence[Path], scan: ScanBag) -> None:
        self._paths = tuple(paths)
        self._scan = scan
        counts: dict[str, int] = {}
        topics: dict[str, BagTopic] = {}
        losses: list[str] = []
        for path in self._paths:
            lost: list[str] = []
            for message in scan(path, lost):
                topics.setdefault(message.topic.name, message.topic)
                counts[message.topic.name] = counts.get(message.topic.name, 0) + 1
            losses += [f"{path.name} {sentence}" for sentence in dict.fromkeys(lost)]
        self._topics = {name: replace(topics[name], num_messages=counts[name]) for name in sorted(topics)}
        self._damage = "; ".join(losses) or None

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All topics that have a message, by name."""
        return tuple(self._topics.values())

    @property
    def damage(self) -> str | None:
        """A sentence on what of the bag is lost; ``None`` if nothing is."""
        return self._damage

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Read the messages of some topics from the beginning, as far as they go."""
        for path in self._paths:
            for message in self._scan(path, []):
                if message.topic.name in names:
                    yield replace(message, topic=self._topics[message.topic.name])
