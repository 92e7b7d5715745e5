"""A file of points, read in chunks so that memory does not grow with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from stairmap.arrays import Mask, Points, Vector

CHUNK_POINTS = 1_000_000
"""Points of a chunk: 24 MB of coordinates, and some copies of them."""

NUM_PIECES, PIECE_POINTS = 32, 16_384
"""A file is sampled in so many pieces of so many points."""

MAX_POINTS = 20_000_000_000
"""A header that tells of more points than this lies."""

MAX_PLACE = 1e10
"""Farthest coordinate, in the file's unit: the other side of the earth in millimetres."""


def is_measured(points: Points) -> Mask:
    """Tell which of (N, 3) points have coordinates; NaN and what lies off the earth are none."""
    return np.asarray((np.abs(points) <= MAX_PLACE).all(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Cloud:
    """A file of points.

    Attributes
    ----------
    path
        The file.
    kind
        What it is, such as ``PCD, binary``.
    num_points
        How many points it says it holds; ``None`` where only reading tells.
    read
        Gives the points in chunks of (N, 3) float64 in the file's own unit and axes; where a point was not
        measured, NaN.
    pieces
        Gives a few pieces from all over the file; ``None`` where only reading it from its beginning does.
    viewpoint
        (3,) where the sensor stood, if the file tells.
    is_metric
        Whether its format asks for metres.
    shape
        (height, width) of an organised cloud, whose points are the pixels of one image, row by row.
    """

    path: Path
    kind: str
    num_points: int | None
    read: Callable[[], Iterator[Points]] = field(repr=False)
    pieces: Callable[[], Iterator[Points]] | None = field(default=None, repr=False)
    viewpoint: Vector | None = None
    is_metric: bool = False
    shape: tuple[int, int] | None = None

    def chunks(self) -> Iterator[Points]:
        """Yield the points in chunks; see ``read``.

        Raises
        ------
        RecordingError
            If the file cannot be read to its end.
        """
        return self.read()
