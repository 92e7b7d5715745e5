"""``alignment.yaml``: where the map of each run lies in the site, given by a user or found and written down.

runs:
  hall_1: {x: 0.0, y: 0.0, z: 0.0, yaw_deg: 0.0}
  hall_2: {x: 12.5, y: -3.1, z: 3.4, yaw_deg: 90.0}
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import Field

from stairmap.arrays import Transform
from stairmap.errors import MergeError
from stairmap.input_files import CheckedModel, Coordinate, parse_yaml, read_text, shown, validated
from stairmap.merging.alignment import SiteAlignment
from stairmap.transforms import transform_from_parts

ALIGNMENT_FILE = "alignment.yaml"


class _Place(CheckedModel):
    """Position, m, and turn to the left, deg, of a run's map in the site."""

    x: Coordinate
    y: Coordinate
    z: Coordinate = 0.0
    yaw_deg: Annotated[float, Field(ge=-360, le=360)]


class _AlignmentFile(CheckedModel):
    """``alignment.yaml``."""

    runs: dict[str, _Place]


def load_alignment(path: Path, names: Sequence[str]) -> SiteAlignment:
    """Read where the map of each run lies in the site.

    Parameters
    ----------
    path
        The file.
    names
        Names of the runs; the file may hold more.

    Raises
    ------
    MergeError
        If it cannot be read, or lacks a run.
    """
    text = read_text(path, error_type=MergeError, what="the alignment")
    try:
        saved = validated(_AlignmentFile, parse_yaml(text))
    except ValueError as error:
        raise MergeError(
            f"{shown(path)} is no alignment: {error}; expected runs: {{NAME: {{x, y, z, yaw_deg}}}}"
        ) from error
    missing = [name for name in names if name not in saved.runs]
    if missing:
        raise MergeError(f"{shown(path)} lacks the run {missing[0]}; it has: {', '.join(sorted(saved.runs))}")
    return SiteAlignment(site_from_run=tuple(_transform(saved.runs[name]) for name in names))


def alignment_text(alignment: SiteAlignment, names: Sequence[str]) -> str:
    """Return the text of ``alignment.yaml``."""
    runs = {}
    for name, transform in zip(names, alignment.site_from_run, strict=True):
        x, y, z = (round(float(value), 4) for value in transform[:3, 3])
        yaw = math.degrees(math.atan2(transform[1, 0], transform[0, 0]))
        runs[name] = {"x": x, "y": y, "z": z, "yaw_deg": round(yaw, 4)}
    return yaml.safe_dump({"runs": runs}, sort_keys=False)


def _transform(place: _Place) -> Transform:
    yaw = math.radians(place.yaw_deg)
    rotation = np.array(
        [[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    )
    return transform_from_parts(rotation, np.array([place.x, place.y, place.z]))
