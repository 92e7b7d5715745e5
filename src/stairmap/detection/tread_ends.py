"""Where treads seen from above end, from all pixels on their level.

Few rows are left of far treads, too few for the labels that the search goes by.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Mask, Points
from stairmap.detection.elevation import STRIP_WIDTH
from stairmap.detection.stair_pixels import StairPixels

MAX_OFF_LEVEL = 0.15
"""How far off a tread's level its pixels lie at most, in rises."""

MAX_PAST_NOSING = 0.5
"""How far past its nosing a level is followed, in runs: a floor goes on."""

MIN_COLUMNS = 6
"""Fewest columns of a strip that must show the level."""


def find_tread_ends(
    pixels: StairPixels,
    *,
    distance: float,
    height: float,
    run: float,
    rise: float,
    num_nosings: int,
    row_step: int,
    pixel_size: float,
) -> Points:
    """Find where the treads of stairs that descend away from the camera end.

    Parameters
    ----------
    pixels
        Pixels in the stairway's axes.
    distance, height, run, rise
        The lattice, m; ``run`` is negative.
    num_nosings
        Treads 0 to ``num_nosings - 1`` are looked at.
    row_step
        Every so many rows were taken.
    pixel_size
        Size of a working pixel at 1 m, m.

    Returns
    -------
    (M, 3) s, z, t of the end of each tread in each strip of columns, m: the median of its columns' farthest
    pixels on the tread's level.
    """
    x = (pixels.forward - np.float32(distance)) / np.float32(run)
    y = (pixels.height - np.float32(height)) / np.float32(rise)
    level = np.rint(y)
    on_level: Mask = (np.abs(y - level) < MAX_OFF_LEVEL) & (level >= 0) & (level < num_nosings)
    on_level &= (x - level > -MAX_PAST_NOSING) & (x - level < 1.0)
    chosen = np.flatnonzero(on_level)
    if len(chosen) == 0:
        return np.zeros((0, 3))
    place = level[chosen].astype(np.int64) * (pixels.column.max() + 1) + pixels.column[chosen]
    order = np.lexsort((pixels.forward[chosen], place))
    is_farthest = np.append(np.diff(place[order]) != 0, True)
    ends = chosen[order[is_farthest]]
    # One end a strip: neighbouring columns err together.
    strip = level[ends].astype(np.int64) * (pixels.column.max() + 1) + pixels.column[ends] // STRIP_WIDTH
    order = np.lexsort((pixels.forward[ends], strip))
    ends, strip = ends[order], strip[order]
    starts = np.flatnonzero(np.append(True, np.diff(strip) != 0))
    counts = np.diff(np.append(starts, len(strip)))
    middle = ends[(starts + counts // 2)[counts >= MIN_COLUMNS]]
    s, z = pixels.forward[middle].astype(np.float64), height + level[middle] * rise
    # The edge lies between the last row on the tread and the next one that was taken.
    row_spacing = s**2 / np.maximum(np.abs(z), 0.1) * pixel_size
    return np.stack([s + 0.5 * row_step * row_spacing, z, pixels.left[middle]], axis=1)
