"""Nosings seen as ledges: something thin with nothing, or something farther, above and below it.

This is all that open treads above the camera show: the front of a slab.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, Points
from stairmap.detection.elevation import Elevation
from stairmap.detection.jump_edges import MIN_JUMP
from stairmap.detection.lattice import Lattice, nearest_indices

MAX_THICKNESS = 0.12
"""Thickest slab, m; what is thicker is a riser."""

MAX_FRONT_DEPTH = 0.04
"""How much nearer or farther than its upper edge a slab's front is, m; farther it is its underside."""

MIN_LEDGE_SHARE = 0.4
"""Ledges are a larger share than this of the nosings of a lattice of slabs; most also look like risers."""


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
    # From below one also sees the underside, which recedes downward to the slab beneath.
    length = ends - starts + 1
    is_front = values * np.repeat(distance + MAX_FRONT_DEPTH, length) > 1.0
    thickness = np.add.reduceat(is_front.astype(np.int64), starts) * distance / elevation.row_density
    nearest = np.maximum.reduceat(values, starts)
    limit = 1.0 / (distance + MIN_JUMP)
    below = values[np.maximum(starts - 1, 0)]
    above = values[np.minimum(ends + 1, len(values) - 1)]
    is_ledge = (
        (values[ends] > 0)
        & (thickness < MAX_THICKNESS)
        & (nearest * (distance - MAX_FRONT_DEPTH) < 1.0)
        & ((below < limit) | (values[starts] < limit))
        & (above < limit)
        & (starts % (num_rows + 1) > 2)
        & (ends % (num_rows + 1) < num_rows - 1)
    )
    chosen = ends[is_ledge]
    strip, place = np.divmod(chosen, num_rows + 1)
    row = num_rows - place
    height = (elevation.slope[row] + 0.5 / elevation.row_density) * distance[is_ledge]
    return np.stack([distance[is_ledge], height, strip], axis=1)


def is_made_of_ledges(lattice: Lattice, ledges: Points, others: Points) -> bool:
    """Whether a lattice was found by ledges, so that its risers are open and its nosings the fronts of slabs.

    Parameters
    ----------
    lattice
        The lattice.
    ledges, others
        (N, 3) ledges and nosings of other kinds: s, z, strip.
    """

    def count(nosings: Points) -> int:
        index = nearest_indices(
            nosings, lattice.distance, lattice.height, lattice.run, lattice.rise, max_along=0.3
        )
        near = (index >= 0) & (index <= lattice.indices[-1]) & lattice.strips[nosings[:, 2].astype(np.int64)]
        return int(np.count_nonzero(near))

    return count(ledges) > MIN_LEDGE_SHARE * (count(ledges) + count(others))
