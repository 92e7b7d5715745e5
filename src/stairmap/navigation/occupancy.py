"""Occupancy grids of floors, and the map files of Nav2: a YAML file and its PGM image.

Cells hold 0 (free), 100 (occupied) or -1 (unknown), as in ``nav_msgs/OccupancyGrid``; row 0 has the lowest y.
The image is the other way up, and read by the rules of nav2_map_server's mode ``trinary``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
import yaml
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from stairmap.arrays import IntArray, Mask, Points, readonly
from stairmap.errors import StairmapError
from stairmap.input_files import (
    MAX_IMAGE_SIZE,
    CheckedModel,
    Place,
    parse_yaml,
    read_limited,
    read_text,
    shown,
    validated,
)
from stairmap.output_files import check_new_file, output_error, write_whole, write_whole_text

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

_FREE_PIXEL, _OCCUPIED_PIXEL, _UNKNOWN_PIXEL = 254, 0, 205
_OCCUPIED_THRESHOLD, _FREE_THRESHOLD = 0.65, 0.196
"""The unknown pixel 205 lies between them; Nav2's own default of 0.25 would read it as free."""


MAX_RESOLUTION = 10.0
"""Largest cell of a map, m."""


class MapError(StairmapError):
    """A map file cannot be read or does not fit its image."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupancyGrid:
    """What is free on a floor.

    Attributes
    ----------
    cells
        (rows, columns) int8: 0 free, 100 occupied, -1 unknown; row 0 has the lowest y.
    resolution
        Size of a cell, m.
    origin
        x and y of the lower left corner of cell (0, 0), m, map.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]

    def __post_init__(self) -> None:
        cells = readonly(self.cells, np.int8)
        if cells.ndim != 2 or not cells.size:
            raise MapError(f"an occupancy grid needs rows and columns, got the shape {cells.shape}")
        if not (math.isfinite(self.resolution) and self.resolution > 0):
            raise MapError(f"a grid's resolution must be above zero, got {self.resolution}")
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "origin", (float(self.origin[0]), float(self.origin[1])))

    def cells_at(self, points: ArrayLike) -> tuple[IntArray, Mask]:
        """Return the (N, 2) row and column of (N, 2 or 3) points, and which of them are on the grid."""
        position = np.atleast_2d(np.asarray(points, dtype=np.float64))[:, :2]
        index = np.floor((position - self.origin) / self.resolution)[:, ::-1].astype(np.int64)
        inside = np.all((index >= 0) & (index < self.cells.shape), axis=1)
        return index, np.asarray(inside)

    def value_at(self, point: ArrayLike) -> int | None:
        """Return the value of the cell at a (2 or 3,) point; ``None`` outside of the grid."""
        index, inside = self.cells_at(point)
        return int(self.cells[tuple(index[0])]) if inside[0] else None

    def centers(self, rows: IntArray, columns: IntArray) -> Points:
        """Return the (N, 2) centres of cells, m, map."""
        corners = np.stack([columns, rows], axis=-1) * self.resolution
        return np.asarray(corners + np.array(self.origin) + self.resolution / 2, dtype=np.float64)


class _MapFile(CheckedModel):
    """The YAML file of a Nav2 map."""

    image: Annotated[str, Field(min_length=1, max_length=4096)]
    resolution: Annotated[float, Field(gt=0, le=MAX_RESOLUTION)]
    origin: Place
    negate: Annotated[int, Field(ge=0, le=1)] | bool
    occupied_thresh: Annotated[float, Field(ge=0, le=1)]
    free_thresh: Annotated[float, Field(ge=0, le=1)]
    mode: Literal["trinary"] = "trinary"


def load_map(path: Path) -> OccupancyGrid:
    """Read a map: the YAML file that names its image.

    Raises
    ------
    MapError
        If a file cannot be read, a key is missing or impossible, the origin is turned, or the
        image does not fit the YAML file.
    """
    try:
        text = read_text(path, error_type=MapError, what="the map")
    except MapError as error:
        raise MapError(f"{error}; name its YAML file, not its image") from error
    try:
        values = parse_yaml(text)
    except ValueError as error:
        raise MapError(f"{shown(path)} is not a YAML file: {error}") from error
    try:
        saved = validated(_MapFile, values)
    except ValueError as error:
        raise MapError(f"{shown(path)} lacks or misstates a key of a Nav2 map: {error}") from error
    origin, occupied, free = saved.origin, saved.occupied_thresh, saved.free_thresh
    image_path, is_negated, resolution = path.parent / saved.image, bool(saved.negate), saved.resolution
    if origin[2] != 0:
        raise MapError(f"{path}: expected origin [x, y, 0] of a map that is not turned, got {origin}")
    if not free < occupied:
        raise MapError(
            f"{path}: expected 0 <= free_thresh < occupied_thresh <= 1, got {free:g} and {occupied:g}"
        )
    image = _read_image(image_path, path)
    _check_size(values, image, path, image_path)
    shade = image / 255.0
    occupancy = shade if is_negated else 1.0 - shade
    cells = np.full(image.shape, UNKNOWN, dtype=np.int8)
    cells[occupancy > occupied] = OCCUPIED
    cells[occupancy < free] = FREE
    if not (cells == FREE).any():
        raise MapError(
            f"{path} and {image_path.name} disagree: with these thresholds and negate no cell is free"
        )
    return OccupancyGrid(cells=cells[::-1], resolution=resolution, origin=(origin[0], origin[1]))


def dump_map(grid: OccupancyGrid, folder: Path, name: str) -> Path:
    """Write ``name.pgm`` and ``name.yaml`` as nav2_map_server reads them; return the YAML file's path.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    image = np.full(grid.cells.shape, _UNKNOWN_PIXEL, dtype=np.uint8)
    image[grid.cells == FREE] = _FREE_PIXEL
    image[grid.cells == OCCUPIED] = _OCCUPIED_PIXEL
    rows, columns = grid.cells.shape[0], grid.cells.shape[1]
    header = f"P5\n# {grid.resolution:g} m a pixel\n{columns} {rows}\n255\n".encode("ascii")
    values = {
        "image": f"{name}.pgm",
        "mode": "trinary",
        "resolution": grid.resolution,
        "origin": [grid.origin[0], grid.origin[1], 0.0],
        "negate": 0,
        "occupied_thresh": _OCCUPIED_THRESHOLD,
        "free_thresh": _FREE_THRESHOLD,
    }
    path = folder / f"{name}.yaml"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(path, error) from error
    for new in (path, folder / f"{name}.pgm"):
        check_new_file(new, option="the map")
    # The image first: a map file never names one that is not there.
    write_whole(folder / f"{name}.pgm", header + image[::-1].tobytes())
    return write_whole_text(path, yaml.safe_dump(values, sort_keys=False))


def _read_image(image_path: Path, path: Path) -> NDArray[np.uint8]:
    try:
        content = read_limited(image_path, max_size=MAX_IMAGE_SIZE, error_type=MapError)
    except MapError as error:
        raise MapError(f"{shown(path)} names the image {shown(image_path)}: {error}") from error
    _check_is_whole(content, image_path, path)
    try:
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_GRAYSCALE) if content else None
    except cv2.error:
        image = None
    if image is None:
        raise MapError(f"the image {image_path} of {path} is damaged or no picture")
    return np.asarray(image, dtype=np.uint8)


def _check_is_whole(content: bytes, image_path: Path, path: Path) -> None:
    """Refuse a PGM file that ends before its last pixel: OpenCV says so on the terminal by itself."""
    header = re.match(rb"P5\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+\d+\s", content)
    if header is None:
        return
    columns, rows = int(header[1]), int(header[2])
    if len(content) - header.end() < columns * rows:
        raise MapError(
            f"the image {image_path} of {path} is cut short: {columns} x {rows} px are announced, "
            f"{len(content) - header.end()} are there"
        )


def _check_size(values: dict[str, Any], image: NDArray[np.uint8], path: Path, image_path: Path) -> None:
    """Compare with the size that some tools add to the YAML file."""
    for key, found in (("height", image.shape[0]), ("width", image.shape[1])):
        if key in values and values[key] != found:
            raise MapError(
                f"{path} and {image_path.name} disagree: {key} is {values[key]} in the one, "
                f"{found} px in the other"
            )
