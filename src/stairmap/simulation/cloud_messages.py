"""``PointCloud2`` messages as the drivers of LiDARs lay them out, and the robot's transforms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from stairmap.arrays import IntArray, Transform
from stairmap.sweep import Sweep
from stairmap.transforms import quat_from_rotation

_VELODYNE = {"x": (0, "f4"), "y": (4, "f4"), "z": (8, "f4"), "intensity": (12, "f4"), "ring": (16, "u2"),
             "time": (18, "f4")}  # fmt: skip
_OUSTER = {"x": (0, "f4"), "y": (4, "f4"), "z": (8, "f4"), "intensity": (16, "f4"), "t": (20, "u4"),
           "reflectivity": (24, "u2"), "ring": (26, "u2"), "range": (28, "u4")}  # fmt: skip
_LIVOX = {"x": (0, "f4"), "y": (4, "f4"), "z": (8, "f4"), "intensity": (12, "f4"), "tag": (16, "u1"),
          "line": (17, "u1"), "timestamp": (18, "f8")}  # fmt: skip

LAYOUTS: Mapping[str, tuple[Mapping[str, tuple[int, str]], int]] = {
    "velodyne": (_VELODYNE, 22),
    "os_sensor": (_OUSTER, 32),
    "livox_frame": (_LIVOX, 26),
}
"""Fields with their place, and the size of a point, bytes, by the coordinate frame that the driver names:
velodyne_pointcloud, ouster-ros and livox_ros_driver2 as of 2024."""

_DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


class RobotMessages:
    """Makes the messages of a robot with a LiDAR, of ROS 2."""

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_HUMBLE)

    def cloud(self, sweep: Sweep, rings: IntArray, frame_id: str) -> Any:
        """Return a sweep as its LiDAR's driver sends it; see ``LAYOUTS``."""
        layout, size = LAYOUTS[frame_id]
        dtype: Any = {
            "names": tuple(layout),
            "formats": ["<" + kind for _, kind in layout.values()],
            "offsets": [place for place, _ in layout.values()],
            "itemsize": size,
        }
        records = np.zeros(len(sweep), np.dtype(dtype))
        for column, axis in enumerate("xyz"):
            records[axis] = sweep.points[:, column]
        offsets = np.zeros(len(sweep), np.int64) if sweep.offsets_ns is None else sweep.offsets_ns
        if "time" in layout:
            records["time"] = offsets * 1e-9
        elif "t" in layout:
            records["t"] = offsets
        else:
            records["timestamp"] = sweep.stamp_ns + offsets
        records["line" if "line" in layout else "ring"] = rings
        field = self.store.types["sensor_msgs/msg/PointField"]
        return self._make(
            "sensor_msgs/msg/PointCloud2",
            header=self._header(sweep.stamp_ns, frame_id),
            height=1,
            width=len(sweep),
            fields=[
                field(name=name, offset=place, datatype=_DATATYPES[kind], count=1)
                for name, (place, kind) in layout.items()
            ],
            is_bigendian=False,
            point_step=size,
            row_step=size * len(sweep),
            data=np.frombuffer(records.tobytes(), dtype=np.uint8),
            is_dense=True,
        )

    def transforms(self, stamp_ns: int, links: Sequence[tuple[str, str, Transform]]) -> Any:
        """Return a ``TFMessage`` of (parent, child, ``parent_from_child``)."""
        return self._make(
            "tf2_msgs/msg/TFMessage",
            transforms=[
                self._make(
                    "geometry_msgs/msg/TransformStamped",
                    header=self._header(stamp_ns, parent),
                    child_frame_id=child,
                    transform=self._transform(parent_from_child),
                )
                for parent, child, parent_from_child in links
            ],
        )

    def _make(self, name: str, **fields: Any) -> Any:
        return self.store.types[name](**fields)

    def _header(self, stamp_ns: int, frame_id: str) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
        stamp = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)

    def _transform(self, transform: Transform) -> Any:
        x, y, z = transform[:3, 3].tolist()
        qx, qy, qz, qw = quat_from_rotation(transform[:3, :3]).tolist()
        return self._make(
            "geometry_msgs/msg/Transform",
            translation=self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=self._make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw),
        )
