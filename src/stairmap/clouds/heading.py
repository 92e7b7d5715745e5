"""Turn the heading of a flight so that its nosings run straight across."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.clouds.surfaces import BIN, SEARCH_DISTANCE, StepLattice, Strip

MAX_TURN = np.radians(20.0)
"""Farther than this a candidate's heading is not corrected in one round, rad."""

LIMITS = (0.06, 0.04)
"""Points farther than this from the nosings' direction so far do not count, round by round, m."""

LAST_LIMIT = 0.02
"""The same in the last round, or what noise asks for if that is more, m."""

MIN_RISER_POINTS, MIN_RISER_LENGTH = 8, 0.3
"""Fewest points of a riser, and the length across, m, over which they tell its direction."""

MIN_FRONT_POINTS, MIN_FRONT_PIECES = 4, 4
"""Fewest points of a piece of a tread that tell its front end, and fewest pieces of a tread."""

FRONT_WINDOW = (0.12, 0.5)
"""Fronts are looked for from so many m before their place to this share of a run behind it."""


def find_turn(strip: Strip, lattice: StepLattice, num_steps: int) -> float:
    """How much the heading must turn so that risers, or else the front edges of treads, run across, rad."""
    rows = _riser_rows(strip, lattice, num_steps) or _front_rows(strip, lattice, num_steps)
    if not rows:
        return 0.0
    s, t = np.concatenate(rows).T
    slope = 0.0
    t = t - t.mean()
    for limit in (*LIMITS, max(strip.core, LAST_LIMIT)):
        is_on = np.abs(s - slope * t) < limit
        spread = float(((t[is_on] - t[is_on].mean()) ** 2).sum()) if is_on.any() else 0.0
        if spread < BIN**2:
            return 0.0
        slope = float(((t[is_on] - t[is_on].mean()) * s[is_on]).sum() / spread)
    # s grows with t where the nosings are turned clockwise against the axes.
    return -float(np.arctan(slope)) if abs(slope) < np.tan(MAX_TURN) else 0.0


def _riser_rows(strip: Strip, lattice: StepLattice, num_steps: int) -> list[Float64Array]:
    """(N, 2) points of each riser as s from its middle, and t."""
    rows = []
    reach = SEARCH_DISTANCE * lattice.run
    for k in range(num_steps):
        s, below = float(lattice.nosing(k)), float(lattice.level(k - 1))
        up = strip.riser_band(below, lattice.rise)
        inside = strip.box((s - reach, s + reach), up)
        if len(inside) >= MIN_RISER_POINTS and np.ptp(inside[:, 1]) > MIN_RISER_LENGTH:
            rows.append(np.column_stack([inside[:, 0] - np.median(inside[:, 0]), inside[:, 1]]))
    return rows


def _front_rows(strip: Strip, lattice: StepLattice, num_steps: int) -> list[Float64Array]:
    """Front ends of treads in pieces across, as s from their middle, and t."""
    rows = []
    for k in range(num_steps):
        s, z = float(lattice.nosing(k)), float(lattice.level(k))
        near = strip.box(
            (s - FRONT_WINDOW[0], s + FRONT_WINDOW[1] * lattice.run), (z - strip.core, z + strip.core)
        )
        piece = ((near[:, 1] - strip.sides[0]) / BIN).astype(np.int64)
        ends = [
            (float(np.sort(part[:, 0])[min(1, len(part) - 1)]), float(part[:, 1].mean()))
            for part in (near[piece == number] for number in np.unique(piece))
            if len(part) >= MIN_FRONT_POINTS
        ]
        if len(ends) >= MIN_FRONT_PIECES:
            values = np.array(ends)
            rows.append(np.column_stack([values[:, 0] - np.median(values[:, 0]), values[:, 1]]))
    return rows
