"""Nosings seen as ledges: something thin with nothing, or something farther, above and below it.

This is all that open treads above the camera show: the front of a slab.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.detection.elevation import Elevation
from stairmap.detection.jump_edges import MIN_JUMP

MAX_THICKNESS = 0.12
"""Thickest slab, m; what is thicker is a riser."""


def find_ledges(elevation: Elevation, *, noise: float) -> Float64Array:
    """Find thin near surfaces in the scans of an elevation.

    Parameters
    ----------
    elevation
        Scans.
    noise
        Standard deviation of inverse distance of one cell, 1/m.

    Returns
    -------
    (N, 3) distance s, height z of the upper edge (m) and strip of each.
    """
    q = elevation.inverse_distance
    num_rows, num_strips = q.shape
    # One list, strip after strip, each from its lowest ray up, with an empty row between.
    flat = np.zeros((num_strips, num_rows + 1))
    flat[:, 1:] = q[::-1].T
    values = flat.ravel()
    jump = np.maximum(0.05, 4.0 * noise / np.maximum(values, 1e-3)) * values
    new = np.ones(len(values), dtype=bool)
    new[1:] = (np.abs(np.diff(values)) > jump[1:]) | (values[1:] == 0) | (values[:-1] == 0)
    starts = np.flatnonzero(new)
    ends = np.append(starts[1:], len(values)) - 1
    distance = 1.0 / np.maximum(values[ends], 1e-3)
    thickness = (ends - starts + 1) * distance / elevation.row_density
    limit = 1.0 / (distance + MIN_JUMP)
    below = values[np.maximum(starts - 1, 0)]
    above = values[np.minimum(ends + 1, len(values) - 1)]
    is_ledge = (
        (values[ends] > 0)
        & (thickness < MAX_THICKNESS)
        & (below < limit)
        & (above < limit)
        & (starts % (num_rows + 1) > 2)
        & (ends % (num_rows + 1) < num_rows - 1)
    )
    chosen = ends[is_ledge]
    strip, place = np.divmod(chosen, num_rows + 1)
    row = num_rows - place
    height = (elevation.slope[row] + 0.5 / elevation.row_density) * distance[is_ledge]
    return np.stack([distance[is_ledge], height, strip], axis=1)
