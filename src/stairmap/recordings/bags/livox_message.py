"""Livox's own message, ``CustomMsg`` of ``livox_ros_driver`` and ``livox_ros_driver2``, from its bytes.

A sweep has 20,000 points, and as objects of Python they would take longer than a tenth of a second. Both
packages have the same fields, and they have not changed since 2019: header, ``uint64 timebase``,
``uint32 point_num``, ``uint8 lidar_id``, ``uint8[3] rsvd``, and points of ``uint32 offset_time``,
``float32 x y z``, ``uint8 reflectivity tag line``.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from stairmap.errors import RecordingError
from stairmap.recordings.bags.message_decoding import header_of
from stairmap.recordings.bags.stream import CDR, BagMessage
from stairmap.recordings.cloud_message import MAX_OFFSET_NS, sweep_from_points
from stairmap.sweep import Sweep

_ROS1_POINT_SIZE, _CDR_POINT_SIZE = 19, 20
"""Bytes from a point to the next; CDR aligns each to four bytes, and the last one has no padding."""


def sweep_from_livox(message: BagMessage) -> Sweep:
    """Return the sweep of a message.

    Raises
    ------
    RecordingError
        If it is cut off.
    """
    stamp_ns, _ = header_of(message)
    data, is_cdr = message.data, message.topic.encoding == CDR
    order = ">" if is_cdr and data[1:2] == b"\0" else "<"
    try:
        (name_size,) = struct.unpack_from(f"{order}I", data, 12)
        place = 16 + name_size
        if is_cdr:
            # Aligned from where the four bytes that name the encoding end.
            place = 4 + _aligned(place - 4, 8)
        timebase, num = struct.unpack_from(f"{order}QI", data, place)
        (num_listed,) = struct.unpack_from(f"{order}I", data, place + 16)
    except struct.error as error:
        raise RecordingError(f"the message is no CustomMsg of a Livox: {error}") from error
    place += 20
    size = _CDR_POINT_SIZE if is_cdr else _ROS1_POINT_SIZE
    needed = place + num_listed * size - (1 if is_cdr and num_listed else 0)
    if len(data) < needed:
        raise RecordingError(
            f"the message says that it has {num_listed} points ({num} by point_num), but it has "
            f"{len(data)} bytes of {needed}; it was cut off"
        )
    layout: Any = {
        "names": ("offset_time", "x", "y", "z"),
        "formats": (f"{order}u4", f"{order}f4", f"{order}f4", f"{order}f4"),
        "offsets": (0, 4, 8, 12),
        "itemsize": size,
    }
    body = bytes(data[place : place + num_listed * size]).ljust(num_listed * size, b"\0")
    records = np.frombuffer(body, np.dtype(layout))
    points = np.stack([records[axis].astype(np.float32) for axis in "xyz"], axis=1)
    late_ns = int(timebase) - stamp_ns
    # Without synchronisation the time base counts from when the LiDAR was switched on.
    late_ns = late_ns if abs(late_ns) <= MAX_OFFSET_NS else 0
    return sweep_from_points(stamp_ns, points, records["offset_time"].astype(np.int64) + late_ns)


def _aligned(place: int, size: int) -> int:
    return -(-place // size) * size
