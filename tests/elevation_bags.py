"""Elevation maps as ROS 1 and ROS 2 send them, for tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_msg

from bag_files import Ros
from stairmap.transforms import transform_from_parts

GRID_TOPIC = "/elevation_mapping/elevation_map"

_INFO = "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
_REST = (
    "string[] layers\nstring[] basic_layers\nstd_msgs/Float32MultiArray[] data\nuint16 outer_start_index\n"
    "uint16 inner_start_index\n"
)


def stair_heights(
    resolution: float, *, rise: float = 0.17, run: float = 0.28, num: int = 6, seed: int = 0
) -> np.ndarray:
    """(num_x, num_y) heights of steps 1.2 m wide up along x, from x = 1.5 m on, in a square of 4.5 m."""
    size = round(4.5 / resolution)
    x, y = ((np.arange(size) + 0.5) * resolution for _ in range(2))
    step = np.clip(np.floor((x - 1.49) / run) + 1, 0, num)
    heights = np.where(np.abs(y - 2.25)[None, :] < 0.6, rise * step[:, None], 0.0)
    heights[x > 1.5 + num * run + 0.6] = 0.0
    return heights + np.random.default_rng(seed).normal(0, 0.005, heights.shape)


def grid_message(
    ros: Ros,
    heights: np.ndarray,
    resolution: float,
    stamp_ns: int,
    *,
    middle: tuple[float, float] = (0.0, 0.0),
    layers: tuple[str, ...] = ("elevation",),
    start: tuple[int, int] = (0, 0),
    is_row_major: bool = False,
) -> Any:
    """A ``GridMap``: rows against x, columns against y, stored from ``start`` on around."""
    if "grid_map_msgs/msg/GridMap" not in ros.store.types:
        first = "std_msgs/Header header\n"
        info, rest = (first + _INFO, _REST) if ros.is_ros1 else (_INFO, first + "{}" + _REST)
        grid = "grid_map_msgs/GridMapInfo info\n"
        ros.store.register(get_types_from_msg(info, "grid_map_msgs/msg/GridMapInfo"))
        text = grid + rest if ros.is_ros1 else rest.format(grid)
        ros.store.register(get_types_from_msg(text, "grid_map_msgs/msg/GridMap"))
    stored = np.roll(heights[::-1, ::-1], start, axis=(0, 1)).astype(np.float32)
    sizes = (stored.shape[0], stored.shape[1]) if is_row_major else (stored.shape[1], stored.shape[0])
    names = ("row_index", "column_index") if is_row_major else ("column_index", "row_index")
    layout = ros.make(
        "std_msgs/msg/MultiArrayLayout",
        dim=[
            ros.make("std_msgs/msg/MultiArrayDimension", label=name, size=size, stride=size)
            for name, size in zip(names, sizes, strict=True)
        ],
        data_offset=0,
    )
    flat = stored.ravel() if is_row_major else stored.T.ravel()
    array = ros.make("std_msgs/msg/Float32MultiArray", layout=layout, data=np.ascontiguousarray(flat))
    other = ros.make("std_msgs/msg/Float32MultiArray", layout=layout, data=np.zeros_like(flat))
    header = {"header": ros.header(stamp_ns, "odom")}
    pose = transform_from_parts(np.eye(3), [*middle, 0.4])
    info_values = {
        "resolution": resolution,
        "length_x": heights.shape[0] * resolution,
        "length_y": heights.shape[1] * resolution,
        "pose": ros.pose(pose),
    }
    own, inner = ({}, header) if ros.is_ros1 else (header, {})
    return ros.make(
        "grid_map_msgs/msg/GridMap",
        info=ros.make("grid_map_msgs/msg/GridMapInfo", **inner, **info_values),
        layers=list(layers),
        basic_layers=[],
        data=[array if name == layers[-1] else other for name in layers],
        outer_start_index=start[0],
        inner_start_index=start[1],
        **own,
    )
