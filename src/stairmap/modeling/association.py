"""Which flight each observation belongs to.

Two observations are of one flight when they head the same way, have the same step, overlap
laterally and lie on one nosing line: at a whole number of steps from each other, since
an observation's lowest step need not be the flight's first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
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

MIN_OVERLAP_SHARE = 0.3
"""Two observations overlap laterally in this share of the narrower one: a flight beside it does not, and one
that a frame cut does."""

RISE_STD_COST = 20.0
"""Steps that an observation must have more to be as good as one whose rise is surer by 1 m: one for 50 mm."""

REACH_MARGIN = 1.3
"""Two observations are of one flight only where their reaches meet; a reach is this much longer than the
observation's own step makes it, because the other's step may be longer within the limits above."""

ROUNDING = 1e-6
"""By how much boxes are larger than the reach that they hold, m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObservationGroup:
    """Observations of one flight.

    Attributes
    ----------
    members
        (M,) their indices, ascending.
    seed, seed_quality
        The observation that the group began with, and how good it is: groups begin with the best one left.
    low, high
        (3,) corners of the box of all that its members can be of one flight with, m, map.
    """

    members: IntArray
    seed: int
    seed_quality: float
    low: Float64Array
    high: Float64Array


def find_groups(placed: PlacedObservations, chosen: IntArray) -> list[ObservationGroup]:
    """Group observations by flight.

    The observation with the most steps among those left starts a flight; all that fit it
    join; the flight's most typical member then gathers once more.

    Observations whose reaches do not meet never fit. So a set of observations that no other can fit gives the
    same groups by itself as among all (``close_groups``).

    Parameters
    ----------
    placed
        Observations in the map.
    chosen
        (M,) indices of those to group, ascending: all that have a pose, or a set as above.

    Returns
    -------
    The groups in the order of their seeds, the best first.
    """
    reach = Reach(placed, chosen)
    near = _Cells(reach)
    records = placed.records
    quality = records["num_steps"][chosen] - RISE_STD_COST * np.sqrt(records["rise_variance"][chosen])
    is_free = np.ones(len(chosen), dtype=np.bool_)
    groups = []
    for seed in np.argsort(-quality, kind="stable").tolist():
        if not is_free[seed]:
            continue
        members = _members(placed, reach, seed, near.of(seed, is_free))
        if len(members) > 2:
            # A member nearest to the median sees the whole group best.
            origin = placed.origin[chosen[members]]
            center = np.median(origin, axis=0)
            typical = int(members[np.argmin(np.linalg.norm(origin - center, axis=1))])
            members = np.union1d(members, _members(placed, reach, typical, near.of(typical, is_free)))
        is_free[members] = False
        groups.append(
            ObservationGroup(
                members=chosen[members],
                seed=int(chosen[seed]),
                seed_quality=float(quality[seed]),
                low=reach.low[members].min(axis=0),
                high=reach.high[members].max(axis=0),
            )
        )
    return groups


class Reach:
    """How far observations can find others of their flight: balls about the middle of what they saw.

    Attributes
    ----------
    chosen
        (M,) indices of the observations.
    center, radius
        (M, 3) and (M,), m, map.
    low, high
        (M, 3) corners of boxes that hold them.
    """

    def __init__(self, placed: PlacedObservations, chosen: IntArray) -> None:
        self.chosen = chosen
        records, heading = placed.records, placed.heading[chosen]
        left, right = records["left"][chosen], records["right"][chosen]
        rise, run = records["rise"][chosen], records["run"][chosen]
        half, side = 0.5 * (records["num_steps"][chosen] - 1), 0.5 * (left + right)
        cosine, sine = np.cos(heading), np.sin(heading)
        self.center = placed.origin[chosen] + np.stack(
            [half * run * cosine - side * sine, half * run * sine + side * cosine, half * rise], axis=1
        )
        self.radius = np.asarray(
            (half + MAX_GAP_STEPS) * REACH_MARGIN * np.hypot(run, rise)
            + 0.5 * np.abs(left - right)
            + MAX_LINE_OFFSET
        )
        half_size = self.radius[:, None] + ROUNDING
        self.low, self.high = self.center - half_size, self.center + half_size


class _Cells:
    """The observations of a reach by cells as large as two of them: those of neighbouring cells may fit."""

    def __init__(self, reach: Reach) -> None:
        size = 2.0 * float(reach.radius.max(initial=0.0)) + ROUNDING
        self._cells = np.floor(reach.center / size).astype(np.int64)
        order = np.lexsort(self._cells.T)
        ordered = self._cells[order]
        starts = np.flatnonzero(np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1)))
        keys = map(tuple, ordered[starts].tolist()) if len(order) else ()
        self._of_cell = dict(zip(keys, np.split(order, starts[1:]), strict=True)) if len(order) else {}

    def of(self, one: int, is_free: Mask) -> IntArray:
        """Free observations, ascending, of the cell of one of them and those about it."""
        x, y, z = self._cells[one].tolist()
        found = [
            self._of_cell[key]
            for key in product((x - 1, x, x + 1), (y - 1, y, y + 1), (z - 1, z, z + 1))
            if key in self._of_cell
        ]
        near = np.concatenate(found)
        return np.sort(near[is_free[near]])


def _members(placed: PlacedObservations, reach: Reach, seed: int, others: IntArray) -> IntArray:
    return others[_fits(placed, reach, seed, others)]


def close_groups(
    groups: Sequence[ObservationGroup], touched: Mask, low: Float64Array, high: Float64Array
) -> Mask:
    """Tell which groups can change when some of them do and observations come in.

    Parameters
    ----------
    groups
        What there is.
    touched
        (G,) which of them change for certain.
    low, high
        (C, 3) corners of the reach of each observation that comes in.

    Returns
    -------
    (G,) those, and all groups that are in reach of them, one through the other.
    """
    lows = np.array([group.low for group in groups]).reshape(-1, 3)
    highs = np.array([group.high for group in groups]).reshape(-1, 3)
    result = touched | _do_meet(lows, highs, low, high)
    fresh = result
    while fresh.any():
        fresh = _do_meet(lows, highs, lows[fresh], highs[fresh]) & ~result
        result = result | fresh
    return np.asarray(result)


def _do_meet(lows: Float64Array, highs: Float64Array, low: Float64Array, high: Float64Array) -> Mask:
    """Which of (G,) boxes meet any of (C,) others."""
    meets = np.all((lows[:, None] <= high) & (low <= highs[:, None]), axis=2)
    return np.asarray(np.any(meets, axis=1))


def _fits(placed: PlacedObservations, reach: Reach, seed: int, others: IntArray) -> Mask:
    """Which of some observations may be of the same flight as one; all by their place in ``reach``."""
    seed_index, indices = int(reach.chosen[seed]), reach.chosen[others]
    records, one = placed.records, placed.records[seed_index]
    turn = (placed.heading[indices] - placed.heading[seed_index] + np.pi) % (2 * np.pi) - np.pi
    fits = np.abs(turn) < MAX_HEADING_DIFFERENCE
    for name in ("rise", "run"):
        std = np.sqrt(records[f"{name}_variance"][indices] + one[f"{name}_variance"])
        fits &= np.abs(records[name][indices] - one[name]) < MAX_STEP_DIFFERENCE + 2.0 * std
    axes = placed.in_axes(float(placed.heading[seed_index]), np.append(indices, seed_index))
    along, left, up = (axes[:-1] - axes[-1]).T
    rise, run = one["rise"], one["run"]
    pitch = np.arctan2(rise, run)
    offset = up * np.cos(pitch) - along * np.sin(pitch)
    fits &= np.abs(offset) < MAX_LINE_OFFSET
    first = (along * run + up * rise) / (run**2 + rise**2)
    last = first + records["num_steps"][indices] - 1
    fits &= (first < one["num_steps"] - 1 + MAX_GAP_STEPS) & (last > -MAX_GAP_STEPS)
    left_end, right_end = records["left"][indices], records["right"][indices]
    overlap = np.minimum(left + left_end, one["left"]) - np.maximum(left + right_end, one["right"])
    narrower = np.minimum(left_end - right_end, one["left"] - one["right"])
    fits &= overlap > MIN_OVERLAP_SHARE * narrower
    between = np.linalg.norm(reach.center[others] - reach.center[seed], axis=1)
    fits &= between <= reach.radius[others] + reach.radius[seed]
    return np.asarray(fits)
