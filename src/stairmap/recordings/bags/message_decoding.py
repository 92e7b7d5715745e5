"""Bytes of a bag's message to an object with its fields, by the definition in the bag or the usual one."""

from __future__ import annotations

import struct
from functools import cache, lru_cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from stairmap.errors import RecordingError
from stairmap.recordings.bags.stream import CDR, ROS1, BagMessage, BagTopic, one_line

_TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"
_BROKEN = (SerdeError, struct.error, ValueError, IndexError, KeyError, AssertionError, MemoryError)


_MAX_KEPT_TYPES = 64
"""Definitions whose types are kept; a robot records some twenty of them."""


class MessageDecoder:
    """Decodes messages of the encodings ``ros1`` and ``cdr``."""

    def __init__(self) -> None:
        self._stores: dict[BagTopic, Typestore] = {}

    def decode(self, message: BagMessage) -> Any:
        """Return an object with the fields of the message.

        Raises
        ------
        RecordingError
            If the bytes are not what the message's type says, or the encoding is unknown.
        """
        topic = message.topic
        store = self._stores.get(topic)
        if store is None:
            store = self._stores[topic] = _store_of(topic)
        try:
            if topic.encoding == ROS1:
                return store.deserialize_ros1(message.data, topic.type)
            return store.deserialize_cdr(message.data, topic.type)
        except _BROKEN as error:
            raise RecordingError(f"the message is no {topic.type}: {one_line(error)}") from error


def header_of(message: BagMessage) -> tuple[int, str]:
    """Return stamp, in nanoseconds, and coordinate frame of a message that begins with a header.

    The rest of it, which may be a large image, is not touched.

    Raises
    ------
    RecordingError
        If the message is too short.
    """
    data, start = message.data, 4
    order = ">" if message.topic.encoding == CDR and data[1:2] == b"\0" else "<"
    try:
        seconds, nanoseconds, length = struct.unpack_from(f"{order}III", data, start)
        name = bytes(data[start + 12 : start + 12 + length])
        if len(name) < length:
            raise ValueError("cut off")
        # In CDR the length counts the zero at the end.
        return seconds * 1_000_000_000 + nanoseconds, name.rstrip(b"\0").decode()
    except (struct.error, ValueError) as error:
        raise RecordingError(f"the message's header is no header: {error}") from error


def _store_of(topic: BagTopic) -> Typestore:
    if topic.encoding not in {ROS1, CDR}:
        raise RecordingError(
            f"topic {topic.name} is encoded as '{topic.encoding}'; expected messages of ROS 1 or ROS 2"
        )
    if not topic.definition:
        store = _usual_types(topic.encoding)
        if topic.type not in store.fielddefs:
            raise RecordingError(f"the bag does not define {topic.type}, and it is no usual type")
        return store
    try:
        return _defined_types(topic.encoding, topic.type, topic.definition)
    except Exception as error:  # the parser of definitions has errors of many kinds
        raise RecordingError(f"the bag's definition of {topic.type} is broken: {one_line(error)}") from error


@lru_cache(maxsize=_MAX_KEPT_TYPES)
def _defined_types(encoding: str, name: str, definition: str) -> Typestore:
    """Types of a definition; compiling them takes milliseconds, and all bags of a robot have the same."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    usual = _usual_types(encoding).fielddefs
    for known in sorted(usual.keys() & store.fielddefs.keys()):
        _check_fields(known, _kinds_of_fields(store, known), _kinds_of_fields(_usual_types(encoding), known))
    return store


def _kinds_of_fields(store: Typestore, name: str) -> dict[str, Any]:
    """Whether each field is a plain value, a message, an array or a sequence."""
    return {field: kind for field, (kind, _) in store.fielddefs[name][1]}


def _check_fields(name: str, found: dict[str, Any], usual: dict[str, Any]) -> None:
    """Refuse a definition, as a damaged bag has it, without the fields that the usual type has."""
    for field, kind in usual.items():
        if found.get(field) != kind:
            raise ValueError(f"{name} has no such field '{field}' as it usually has")


@cache
def _usual_types(encoding: str) -> Typestore:
    if encoding == CDR:
        return get_typestore(Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
        store.register(get_types_from_msg(_TF_MESSAGE, name))
    return store
