"""Find how far the steps of a flight reach to either side, and whether their ends were seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.clouds.section import Section
from stairmap.clouds.surfaces import CORE, MIN_CORE, TREAD_WINDOW

PIECE = 0.04
"""A step ends where pieces of this width across hold few points or none, m."""

MAX_HOLE = 3
"""Pieces in a row without points that are a hole, not an end."""

THIN_SHARE = 0.2
"""A piece is empty with less than this share of the usual number of points."""

SEARCH = 6.0
"""How far from the middle of the candidate's strips a step is followed, m."""

NEAR = 10
"""Pieces to either side of the middle that tell the usual number of points."""

MAX_SPREAD = 0.03
"""Ends of single steps that lie within this of their median are of one straight side, m."""

END_PIECES = 4
"""Pieces inward from an end that tell how many points one holds there."""

MIN_AGREEING = 0.4
"""Share of the steps whose ends must agree for the end to count as seen: occlusions are not parallel to
stairs."""

MIN_STEPS = 2
"""Fewest of them."""

END_STD, OPEN_STD = 0.003, 0.05
"""Standard deviation of an end that was seen, beyond its steps' own, and of one that was not, m."""

ROLL_HALF_WIDTH, MAX_ROLL = 0.25, 0.06
"""How much treads slope aside is told within this of their middle, m; more than the second is no tread's."""

MIN_POINTS = 6
"""Fewest points of a step that tell where it ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepSides:
    """Where the steps of a flight end.

    Attributes
    ----------
    steps
        (K, 2) right and left end of each step, t in m; NaN where it was not seen.
    right, left
        The flight's ends, m.
    right_bounded, left_bounded
        Whether each was seen.
    std
        Standard deviation of the width, m.
    """

    steps: Float64Array
    right: float
    left: float
    right_bounded: bool
    left_bounded: bool
    std: float

    @property
    def width(self) -> float:
        """Distance between the ends, m."""
        return self.left - self.right

    @property
    def middle(self) -> float:
        """Middle between the ends, m."""
        return 0.5 * (self.left + self.right)

    def of_step(self, step: int) -> tuple[float, float]:
        """Return right and left end of a step: the flight's, or its own where that was not seen, m."""
        right, left = self.steps[step].tolist()
        return (
            self.right if self.right_bounded or np.isnan(right) else right,
            self.left if self.left_bounded or np.isnan(left) else left,
        )


def find_sides(points: Float64Array, section: Section, noise: float) -> StepSides:
    """Follow each step to both sides until it ends.

    Parameters
    ----------
    points
        (N, 3) points about the flight, in the cloud, m.
    section
        The flight as measured in the strip where it was found.
    noise
        Standard deviation of a point, m.
    """
    local = section.axes.from_cloud(points)
    local = local[np.argsort(local[:, 0])]
    profile = section.profile
    band = max(CORE * noise, MIN_CORE)
    middle = 0.5 * sum(section.sides)
    ends = np.full((profile.num_steps, 2), np.nan)
    nosings, levels = profile.nosing_distances, profile.tread_heights
    roll = _find_roll(local, section, band)
    for step in range(profile.num_steps):
        low, high = nosings[step] + profile.run * np.array(TREAD_WINDOW)
        first, last = np.searchsorted(local[:, 0], (low, high))
        t, over = local[first:last, 1], local[first:last, 2] - levels[step + 1]
        over = over - roll * (t - middle)
        # The upper floor is wider than the flight.
        if not (step == profile.num_steps - 1 and section.top_seen):
            # A wall beside the tread, or the face under its end, is counted beside it and taken off.
            off = np.abs(over)
            ends[step] = _find_ends(t[off < band], t[(off > band) & (off < 3 * band)], middle)
        if np.isnan(ends[step]).any():
            place = nosings[step] + profile.overhang
            first, last = np.searchsorted(local[:, 0], (place - 3 * band, place + band))
            part = local[first:last]
            up = (part[:, 2] > levels[step] + 0.2 * profile.rise) & (
                part[:, 2] < levels[step + 1] - 0.1 * profile.rise
            )
            is_on = part[:, 0] > place - band
            ends[step] = _find_ends(part[up & is_on, 1], part[up & ~is_on, 1], middle)
    right, right_bounded, right_std = _find_side(ends[:, 0], -1.0)
    left, left_bounded, left_std = _find_side(ends[:, 1], 1.0)
    return StepSides(
        steps=ends,
        right=right,
        left=left,
        right_bounded=right_bounded,
        left_bounded=left_bounded,
        std=float(np.hypot(right_std, left_std)),
    )


def _find_roll(local: Float64Array, section: Section, band: float) -> float:
    """How much treads climb to the left, m per m: a band about their height would lose those that do."""
    profile, middle = section.profile, 0.5 * sum(section.sides)
    half = min(0.5 * (section.sides[1] - section.sides[0]), ROLL_HALF_WIDTH)
    parts = []
    for step in range(profile.num_steps - 1):
        low, high = profile.nosing_distances[step] + profile.run * np.array(TREAD_WINDOW)
        first, last = np.searchsorted(local[:, 0], (low, high))
        t, over = local[first:last, 1] - middle, local[first:last, 2] - profile.tread_heights[step + 1]
        near = (np.abs(t) < half) & (np.abs(over) < band + MAX_ROLL * half)
        if np.count_nonzero(near) >= MIN_POINTS:
            parts.append(np.column_stack([t[near] - t[near].mean(), over[near] - np.median(over[near])]))
    if not parts:
        return 0.0
    t, over = np.concatenate(parts).T
    roll = float((t * over).sum() / max((t**2).sum(), 1e-9))
    return roll if abs(roll) < MAX_ROLL else 0.0


def _find_ends(on: Float64Array, beside: Float64Array, middle: float) -> tuple[float, float]:
    """Right and left end of the points of one step, NaN without enough of them.

    ``beside`` are points next to the surface, in twice the width of the band that it was taken from.
    """
    on = on[np.abs(on - middle) < SEARCH]
    beside = beside[np.abs(beside - middle) < SEARCH]
    if len(on) < MIN_POINTS:
        return np.nan, np.nan
    low, num = middle - SEARCH, int(2 * SEARCH / PIECE) + 1
    counts = np.bincount(((on - low) / PIECE).astype(np.int64), minlength=num).astype(np.float64)
    counts -= 0.5 * np.bincount(((beside - low) / PIECE).astype(np.int64), minlength=num)
    start = int(SEARCH / PIECE)
    near = counts[max(start - NEAR, 0) : start + NEAR + 1]
    if not (near > 0).any():
        return np.nan, np.nan
    usual = float(np.median(near[near > 0]))
    filled = np.flatnonzero(counts >= max(THIN_SHARE * usual, 1.0))
    if not len(filled):
        return np.nan, np.nan
    parts = np.split(filled, np.flatnonzero(np.diff(filled) > MAX_HOLE + 1) + 1)
    part = min(parts, key=lambda item: max(item[0] - start, start - item[-1], 0))
    # How many points the last pieces hold says where in them the step ends.
    first = counts[max(part[0] - 1, 0) : part[0] + 2].sum() / _density(counts[part[0] + 1 : part[-1]], usual)
    last = counts[max(part[-1] - 1, 0) : part[-1] + 2].sum() / _density(
        counts[part[0] + 1 : part[-1]][::-1], usual
    )
    return (
        float(low + PIECE * (part[0] + 2 - np.clip(first, 0.0, 3.0))),
        float(low + PIECE * (part[-1] - 1 + np.clip(last, 0.0, 3.0))),
    )


def _density(inward: Float64Array, usual: float) -> float:
    """Points of a piece near an end, given those from the end inward: posts beside it take some away."""
    near = inward[:END_PIECES]
    return float(np.median(near[near > 0])) if (near > 0).any() else usual


def _find_side(ends: Float64Array, outward: float) -> tuple[float, bool, float]:
    """The flight's end on one side, whether it was seen, and its standard deviation."""
    known = ends[np.isfinite(ends)]
    if not len(known):
        return 0.0, False, OPEN_STD
    # What stands on the steps hides their ends, and nothing makes them longer: the outermost counts.
    near = np.abs(known[:, None] - known[None, :]) < MAX_SPREAD
    enough = near.sum(axis=1) >= max(MIN_STEPS, MIN_AGREEING * len(known))
    if enough.any():
        agrees = near[int(np.argmax(np.where(enough, outward * known, -np.inf)))]
        num = np.count_nonzero(agrees)
        return float(known[agrees].mean()), True, float(np.hypot(known[agrees].std() / np.sqrt(num), END_STD))
    return float(outward * np.percentile(outward * known, 75)), False, OPEN_STD
