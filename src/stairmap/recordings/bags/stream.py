"""What all readers of bags give: topics, and messages as bytes in the order in which they were recorded."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Protocol

from stairmap.errors import RecordingError

ROS1 = "ros1"
"""Encoding of the messages of ROS 1."""

CDR = "cdr"
"""Encoding of the messages of ROS 2."""


class DamagedBagError(RecordingError):
    """A bag is cut off or corrupt, as a full disk or a crash leaves it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BagTopic:
    """A topic of a bag.

    Attributes
    ----------
    name
        Name, such as ``/camera/depth/image_rect_raw``.
    type
        Type of its messages in ROS 2's spelling, such as ``sensor_msgs/msg/Image``.
    encoding
        ``ros1``, ``cdr``, or another one that cannot be decoded.
    definition
        Definition of the type as ``.msg`` text; empty where the bag does not hold it.
    num_messages
        How many messages there are.
    """

    name: str
    type: str
    encoding: str
    definition: str = ""
    num_messages: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BagMessage:
    """A message as it lies in a bag.

    Attributes
    ----------
    topic
        Its topic.
    recorded_ns
        When it was recorded, by the recorder's clock, in nanoseconds.
    data
        The message, encoded.
    """

    topic: BagTopic
    recorded_ns: int
    data: bytes


class BagStream(Protocol):
    """One way to read a bag."""

    @property
    def topics(self) -> tuple[BagTopic, ...]:
        """All topics, by name."""
        ...

    @property
    def damage(self) -> str | None:
        """A sentence on what of the bag is lost; ``None`` if nothing is."""
        ...

    def messages(self, names: Collection[str]) -> Iterator[BagMessage]:
        """Read the messages of some topics from the beginning.

        Raises
        ------
        DamagedBagError
            If the bag cannot be read on.
        """
        ...


def plain_type(name: str) -> str:
    """Return a type's name in ROS 2's spelling: ``sensor_msgs/Image`` is ``sensor_msgs/msg/Image``."""
    package, _, rest = name.partition("/")
    return name if not rest or "/" in rest else f"{package}/msg/{rest}"


def one_line(error: BaseException) -> str:
    """Return what an error of another package says, on one line and not too long."""
    text = " ".join(str(error).split())
    return f"{text[:200]} …" if len(text) > 200 else text
