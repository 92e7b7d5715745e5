"""Grids of heights that NumPy saved, as files of points.

    numpy.savez("heights.npz", heights=heights, resolution=0.03, origin=[x, y])

``heights`` are metres, (num_x, num_y), NaN where nothing is known; cell (i, j) is the square from
``origin + (i, j) * resolution`` on.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stairmap.array_files import load_arrays
from stairmap.arrays import Points
from stairmap.errors import RecordingError
from stairmap.height_grid import HeightGrid
from stairmap.input_files import shown
from stairmap.recordings.clouds.cloud import Cloud

MAX_CELLS = 100_000_000
"""Most cells: 200 m by 200 m at 20 mm, a gigabyte of points."""


def open_height_grid(path: Path) -> Cloud:
    """Open a grid of heights.

    Raises
    ------
    RecordingError
        If it is no such file.
    """
    grid = _load(path)
    points = grid.points()

    def read() -> Iterator[Points]:
        yield points

    return Cloud(
        path=path, kind="grid of heights", num_points=len(points), read=read, pieces=read, is_metric=True
    )


def _load(path: Path) -> HeightGrid:
    expected = "expected heights (num_x, num_y; m) and resolution (m)"
    try:
        saved = load_arrays(path, error_type=RecordingError)
        if not {"heights", "resolution"} <= set(saved):
            raise RecordingError(f"{expected} in {shown(path)}, but it has {', '.join(saved) or 'nothing'}")
        heights = np.asarray(saved["heights"], dtype=np.float32)
        resolution = float(saved["resolution"])
        origin = np.asarray(saved.get("origin", [0.0, 0.0]), dtype=np.float64)
    except (ValueError, TypeError, OverflowError) as error:
        raise RecordingError(f"{expected} in {shown(path)}: {' '.join(str(error).split())[:200]}") from error
    if heights.size > MAX_CELLS or origin.shape not in {(2,), (3,)} or not np.isfinite(origin).all():
        raise RecordingError(
            f"{expected} in {shown(path)}, and origin as two numbers, got {heights.shape} cells and an "
            f"origin of shape {origin.shape}"
        )
    map_from_grid = np.eye(4)
    map_from_grid[: len(origin), 3] = origin
    try:
        return HeightGrid(stamp_ns=0, heights=heights, resolution=resolution, map_from_grid=map_from_grid)
    except ValueError as error:
        raise RecordingError(f"{shown(path)}: {error}") from error
