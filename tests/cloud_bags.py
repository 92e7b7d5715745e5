"""Point clouds as ROS 1 and ROS 2 send them, for tests: any layout of fields, and Livox's own message."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_msg

from bag_files import Ros

DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}

CLOUD_TOPIC = "/points"

CUSTOM_POINT = (
    "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"
)
CUSTOM = (
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "CustomPoint[] points\n"
)


def packed(
    columns: dict[str, np.ndarray], *, order: str = "<", padding: int = 0, kinds: dict[str, str] | None = None
) -> tuple[np.ndarray, list[SimpleNamespace]]:
    """Records of columns in that order, with bytes between the points, and the fields that describe them."""
    kinds = {name: (kinds or {}).get(name, "f4") for name in columns}
    offsets = np.cumsum([0, *(np.dtype(kind).itemsize for kind in kinds.values())]).tolist()
    layout = {
        "names": list(columns),
        "formats": [order + kind for kind in kinds.values()],
        "offsets": offsets[:-1],
        "itemsize": offsets[-1] + padding,
    }
    records = np.zeros(len(next(iter(columns.values()))), dtype=np.dtype(layout))
    for name, values in columns.items():
        records[name] = values
    fields = [
        SimpleNamespace(name=name, offset=offset, datatype=DATATYPES[kind], count=1)
        for (name, kind), offset in zip(kinds.items(), offsets[:-1], strict=True)
    ]
    return records, fields


def cloud_message(
    columns: dict[str, np.ndarray],
    *,
    stamp_ns: int = 0,
    order: str = "<",
    padding: int = 0,
    kinds: dict[str, str] | None = None,
    height: int = 1,
    row_padding: int = 0,
) -> SimpleNamespace:
    """Any object with the fields of a ``PointCloud2``."""
    records, fields = packed(columns, order=order, padding=padding, kinds=kinds)
    width = len(records) // height
    step = records.dtype.itemsize
    rows = np.frombuffer(records.tobytes(), dtype=np.uint8).reshape(height, -1)
    rows = np.hstack([rows, np.zeros((height, row_padding), dtype=np.uint8)])
    stamp = SimpleNamespace(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=stamp, frame_id="lidar"),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=order == ">",
        point_step=step,
        row_step=step * width + row_padding,
        data=rows.ravel(),
        is_dense=False,
    )


def ros_cloud(ros: Ros, message: SimpleNamespace, stamp_ns: int, frame_id: str) -> Any:
    """The same as a message of one ROS version."""
    field = ros.store.types["sensor_msgs/msg/PointField"]
    values = {**vars(message), "header": ros.header(stamp_ns, frame_id)}
    values["fields"] = [field(**vars(described)) for described in message.fields]
    return ros.make("sensor_msgs/msg/PointCloud2", **values)


def livox_message(
    ros: Ros, points: np.ndarray, offsets_ns: np.ndarray, stamp_ns: int, *, timebase: int | None = None
) -> Any:
    """Livox's ``CustomMsg`` of one ROS version, registered in its types."""
    package = "livox_ros_driver" if ros.is_ros1 else "livox_ros_driver2"
    name = f"{package}/msg/CustomMsg"
    if name not in ros.store.types:
        ros.store.register(get_types_from_msg(CUSTOM_POINT, f"{package}/msg/CustomPoint"))
        ros.store.register(get_types_from_msg(CUSTOM, name))
    point = ros.store.types[f"{package}/msg/CustomPoint"]
    return ros.make(
        name,
        header=ros.header(stamp_ns, "livox_frame"),
        timebase=stamp_ns if timebase is None else timebase,
        point_num=len(points),
        lidar_id=1,
        rsvd=np.zeros(3, dtype=np.uint8),
        points=[
            point(offset_time=int(t), x=float(x), y=float(y), z=float(z), reflectivity=9, tag=16, line=i % 4)
            for i, ((x, y, z), t) in enumerate(zip(points, offsets_ns, strict=True))
        ],
    )
