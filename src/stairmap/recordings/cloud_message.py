"""Points of a LiDAR as ROS sends them: ``sensor_msgs/PointCloud2`` with any fields.

Any object with the message's fields will do. Drivers agree on x, y and z but not on when a point was
measured: Velodyne's writes seconds (``time``), Ouster's nanoseconds (``t``), both after the stamp; Hesai's,
RoboSense's and Livox's write the time itself (``timestamp``), in seconds or in nanoseconds. A sweep takes
between 5 ms and 2 s, so how much the values differ tells the unit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask
from stairmap.errors import RecordingError
from stairmap.recordings.bags.pose_message import stamp_ns_of
from stairmap.sweep import Sweep

TIME_FIELDS = ("t", "time", "timestamp", "offset_time", "time_offset", "timeoffset", "time_stamp", "ts",
               "point_time_offset", "timestampsec", "point_time")  # fmt: skip
"""Names of a point's time, in small letters, in the order of preference."""

UNITS_NS = (1.0, 1e3, 1e6, 1e9)
"""Units of time, in nanoseconds."""

MIN_SPAN_NS, MAX_SPAN_NS = 3_000_000, 2_500_000_000
"""How long a sweep takes at least and at most, nanoseconds: less than a factor of 1000 apart, so that one
unit fits."""

MAX_OFFSET_NS = 10_000_000_000
"""A point's time farther than this from its message's stamp, nanoseconds, is by another clock."""

MAX_RANGE = 300.0
"""Farther points, m, are no returns of a LiDAR on a robot."""

MAX_POINTS = 20_000_000
"""More points in a message are none that any LiDAR sends."""

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""``sensor_msgs/PointField``: number of a datatype, and NumPy's name for it."""


def sweep_from_cloud(message: Any) -> Sweep:
    """Return the sweep of a ``PointCloud2``.

    Points without a return (not finite, all zero, or farther than 300 m) are left out.

    Raises
    ------
    RecordingError
        If it has no x, y and z, or its points are not where its fields say.
    """
    records = records_from_cloud(message)
    missing = [name for name in "xyz" if name not in (records.dtype.names or ())]
    if missing:
        there_are = ", ".join(records.dtype.names or ()) or "none"
        raise RecordingError(
            f"expected points with the fields x, y and z, but {' and '.join(missing)} is not there; the "
            f"fields are: {there_are}"
        )
    points = np.stack([records[name].astype(np.float32) for name in "xyz"], axis=1)
    stamp_ns = stamp_ns_of(message.header)
    name = _time_field(records.dtype.names or ())
    offsets = None if name is None else _offsets_from_times(records[name], stamp_ns)
    return sweep_from_points(stamp_ns, points, offsets)


def records_from_cloud(message: Any) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Return the (N,) points of a ``PointCloud2`` as records with its fields of one element.

    Raises
    ------
    RecordingError
        If the fields do not lie within a point, or the data is shorter than its height and width say.
    """
    order = ">" if message.is_bigendian else "<"
    step, height, width = int(message.point_step), int(message.height), int(message.width)
    names, formats, offsets = [], [], []
    for field in message.fields:
        if field.datatype not in _TYPES or field.name in names or field.count > 1:
            continue
        kind = np.dtype(order + _TYPES[field.datatype])
        if field.offset + kind.itemsize > step:
            raise RecordingError(
                f"the field {field.name} ends at byte {field.offset + kind.itemsize} of a point, but a point "
                f"has {step} bytes (point_step)"
            )
        names.append(field.name)
        formats.append(kind)
        offsets.append(int(field.offset))
    if not names or step == 0:
        raise RecordingError("the cloud names no field that can be read; expected x, y and z")
    if height * width > MAX_POINTS:
        raise RecordingError(f"the cloud says that it has {height * width} points; that is no sweep")
    # The kinds are of a dict that NumPy takes and its stubs do not spell out.
    layout: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    dtype = np.dtype(layout)
    data = np.frombuffer(bytes(message.data), dtype=np.uint8)
    row_step = int(message.row_step) if height > 1 else width * step
    needed = (height - 1) * row_step + width * step if height * width else 0
    if row_step < width * step or len(data) < needed:
        raise RecordingError(
            f"the cloud says that it has {height} x {width} points of {step} bytes, but it has {len(data)} "
            "bytes; it was cut off"
        )
    if row_step == width * step:
        return np.frombuffer(data, dtype, count=height * width)
    rows = [data[row * row_step : row * row_step + width * step] for row in range(height)]
    return np.frombuffer(np.concatenate(rows), dtype)


def sweep_from_points(stamp_ns: int, points: Float32Array, offsets: IntArray | None) -> Sweep:
    """Return a sweep of (N, 3) points, m, those without a return left out; see ``Sweep``."""
    with np.errstate(invalid="ignore", over="ignore"):
        square = np.einsum("ij,ij->i", points, points)
        kept: Mask = np.asarray((square > 0) & (square < MAX_RANGE**2))
    return Sweep(
        stamp_ns=stamp_ns, points=points[kept], offsets_ns=None if offsets is None else offsets[kept]
    )


def _time_field(names: tuple[str, ...]) -> str | None:
    by_small = {name.lower(): name for name in names}
    return next((by_small[name] for name in TIME_FIELDS if name in by_small), None)


def _offsets_from_times(times: Float64Array, stamp_ns: int) -> IntArray | None:
    """Return (N,) nanoseconds after the stamp; ``None`` where the values do not tell points apart."""
    finite = np.isfinite(times) if times.dtype.kind == "f" else np.ones(len(times), dtype=bool)
    if not finite.any():
        return None
    first = times[finite].min()
    # The differences first: today's nanoseconds fill a float64 to its last digit.
    relative = np.where(finite, times, first).astype(times.dtype)
    relative = (relative - first).astype(np.float64)
    span = float(relative.max())
    unit = next((unit for unit in UNITS_NS if MIN_SPAN_NS <= span * unit <= MAX_SPAN_NS), None)
    if unit is None:
        return None
    start_ns = round(float(first) * unit)
    if times.dtype.kind in "iu" and unit == 1.0:
        start_ns = int(first)
    if abs(start_ns) > MAX_OFFSET_NS:
        start_ns -= stamp_ns
        # By another clock: the driver stamps a sweep with when it began.
        start_ns = start_ns if abs(start_ns) <= MAX_OFFSET_NS else 0
    return np.asarray(np.rint(relative * unit).astype(np.int64) + start_ns)
