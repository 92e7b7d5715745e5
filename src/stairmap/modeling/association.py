"""Which flight each observation belongs to.

Two observations are of one flight when they head the same way, have the same step, overlap
laterally and lie on one nosing line: at a whole number of steps from each other, since
an observation's lowest step need not be the flight's first.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import IntArray, Mask
from stairmap.modeling.observation_table import PlacedObservations

MAX_HEADING_DIFFERENCE = np.radians(20.0)
"""Quarter-turn flights differ by 90 degrees; a single frame's heading errs by a few."""

MAX_STEP_DIFFERENCE = 0.035
"""Largest difference of rise or run, m, beyond twice their joint standard deviation."""

MAX_LINE_OFFSET = 0.30
"""Largest distance between two nosing lines, m: drift makes one stairway two, a landing of 0.8 m
puts the next flight 0.4 m off."""

MAX_GAP_STEPS = 3.0
"""Largest number of unseen steps between the ranges of two observations."""


def find_flights(placed: PlacedObservations, known: IntArray) -> list[IntArray]:
    """Group observations by flight.

    The observation with the most steps among those left starts a flight; all that fit it
    join; the flight's most typical member then gathers once more.

    Parameters
    ----------
    placed
        Observations in the map.
    known
        Indices of those that have a pose; the others belong nowhere.

    Returns
    -------
    Indices of the observations of each flight, ascending, largest flight first.
    """
    free = np.zeros(len(placed), dtype=bool)
    free[known] = True
    quality = placed.records["num_steps"] - 20.0 * np.sqrt(placed.records["rise_variance"])
    flights = []
    while free.any():
        candidates = np.flatnonzero(free)
        seed = int(candidates[np.argmax(quality[candidates])])
        members = np.flatnonzero(free & _fits(placed, seed))
        if len(members) > 2:
            # A member nearest to the median sees the whole group best.
            center = np.median(placed.origin[members], axis=0)
            typical = members[np.argmin(np.linalg.norm(placed.origin[members] - center, axis=1))]
            members = np.union1d(members, np.flatnonzero(free & _fits(placed, int(typical))))
        free[members] = False
        flights.append(members)
    flights.sort(key=len, reverse=True)
    return flights


def _fits(placed: PlacedObservations, seed: int) -> Mask:
    """Which observations may be of the same flight as one of them."""
    records, one = placed.records, placed.records[seed]
    turn = (placed.heading - placed.heading[seed] + np.pi) % (2 * np.pi) - np.pi
    fits = np.abs(turn) < MAX_HEADING_DIFFERENCE
    for name in ("rise", "run"):
        std = np.sqrt(records[f"{name}_variance"] + one[f"{name}_variance"])
        fits &= np.abs(records[name] - one[name]) < MAX_STEP_DIFFERENCE + 2.0 * std
    axes = placed.in_axes(float(placed.heading[seed]))
    along, left, up = (axes - axes[seed]).T
    rise, run = one["rise"], one["run"]
    pitch = np.arctan2(rise, run)
    offset = up * np.cos(pitch) - along * np.sin(pitch)
    fits &= np.abs(offset) < MAX_LINE_OFFSET
    first = (along * run + up * rise) / (run**2 + rise**2)
    last = first + records["num_steps"] - 1
    fits &= (first < one["num_steps"] - 1 + MAX_GAP_STEPS) & (last > -MAX_GAP_STEPS)
    overlap = np.minimum(left + records["left"], one["left"]) - np.maximum(
        left + records["right"], one["right"]
    )
    narrower = np.minimum(records["left"] - records["right"], one["left"] - one["right"])
    fits &= overlap > 0.3 * narrower
    return np.asarray(fits)
