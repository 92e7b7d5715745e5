"""Look at some points of a file without reading all of it."""

from __future__ import annotations

from itertools import islice

import numpy as np

from stairmap.arrays import Points
from stairmap.recordings.clouds.cloud import Cloud, is_measured

SAMPLE_CHUNKS = 2
"""Chunks from the beginning of a file that cannot be read from its middle."""


def sample_points(cloud: Cloud) -> Points:
    """Return (N, 3) measured points from all over a file, or where its format allows no other, its beginning.

    Raises
    ------
    RecordingError
        If the file cannot be read.
    """
    parts = list(cloud.pieces()) if cloud.pieces is not None else list(islice(cloud.chunks(), SAMPLE_CHUNKS))
    points = np.concatenate(parts) if parts else np.zeros((0, 3))
    return np.asarray(points[is_measured(points)])
