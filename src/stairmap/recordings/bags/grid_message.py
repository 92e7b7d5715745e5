"""Elevation maps as ROS sends them: ``grid_map_msgs/GridMap`` of ROS 1 and ROS 2.

Any object with the message's fields will do. A layer is a matrix whose rows run against x and whose columns
run against y of the map, as a circular buffer that begins somewhere in the middle (grid_map_core).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.errors import RecordingError
from stairmap.height_grid import HeightGrid
from stairmap.recordings.bags.pose_message import stamp_ns_of, transform_from_ros

GRID_MAP = "grid_map_msgs/msg/GridMap"

LAYERS = ("elevation", "elevation_inpainted", "elevation_filtered", "min_filter", "smooth")
"""Layers that are taken for heights, the one first that says most plainly what was measured."""

MAX_CELLS = 25_000_000
"""A message of more cells is none that a robot sends: 100 m by 100 m at 20 mm."""


def grid_from_message(message: Any, layer: str | None = None) -> HeightGrid:
    """Return the heights of an elevation map in the coordinate frame that its header names.

    Parameters
    ----------
    message
        ``GridMap``.
    layer
        Layer to take; if not given, the first of ``LAYERS``, or the only one.

    Raises
    ------
    RecordingError
        If there is no such layer, or its size is not that of the map.
    """
    header = message.header if hasattr(message, "header") else message.info.header
    values = message.data[list(message.layers).index(_find_layer(list(message.layers), layer))]
    matrix = _matrix(values)
    resolution = float(message.info.resolution)
    expected = tuple(
        round(float(length) / resolution) if resolution > 0 else 0
        for length in (message.info.length_x, message.info.length_y)
    )
    if matrix.shape != expected:
        raise RecordingError(
            f"the map is {expected[0]} x {expected[1]} cells of {resolution} m by its info, but its layer "
            f"has {matrix.shape[0]} x {matrix.shape[1]}"
        )
    matrix = np.roll(matrix, (-int(message.outer_start_index), -int(message.inner_start_index)), axis=(0, 1))
    map_from_middle = transform_from_ros(message.info.pose.position, message.info.pose.orientation)
    if map_from_middle is None:
        raise RecordingError(
            "the pose of the map is not valid: not finite, or its quaternion is not of unit length"
        )
    middle_from_corner = np.eye(4)
    middle_from_corner[:2, 3] = -0.5 * np.array(matrix.shape) * resolution
    # Heights are those of the coordinate frame, whatever height the pose has.
    map_from_grid = map_from_middle @ middle_from_corner
    map_from_grid[2, 3] = 0.0
    return HeightGrid(
        stamp_ns=stamp_ns_of(header),
        heights=matrix[::-1, ::-1],
        resolution=resolution,
        map_from_grid=map_from_grid,
    )


def _find_layer(layers: list[str], wanted: str | None) -> str:
    if wanted is not None and wanted not in layers:
        raise RecordingError(f"the elevation map has no layer {wanted}; there are: {', '.join(layers)}")
    found = wanted or next((name for name in LAYERS if name in layers), None)
    if found is None and len(layers) == 1:
        return layers[0]
    if found is None:
        raise RecordingError(
            "none of the elevation map's layers is known for heights; name one, as in --cloud-topic "
            f"TOPIC:LAYER; there are: {', '.join(layers) or 'none'}"
        )
    return found


def _matrix(values: Any) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """The matrix of a ``Float32MultiArray``: rows along x, columns along y, as stored."""
    dimensions = list(values.layout.dim)
    data = np.asarray(values.data, dtype=np.float32)
    if len(dimensions) != 2:
        raise RecordingError(f"expected a layer of two dimensions, got {len(dimensions)}")
    outer, inner = int(dimensions[0].size), int(dimensions[1].size)
    if outer * inner != len(data) or outer * inner > MAX_CELLS or not len(data):
        raise RecordingError(f"the layer says that it has {outer} x {inner} cells, but it has {len(data)}")
    matrix = data.reshape(outer, inner)
    # Eigen stores columns first, and says so by its labels.
    return np.asarray(matrix if dimensions[0].label == "row_index" else matrix.T)
