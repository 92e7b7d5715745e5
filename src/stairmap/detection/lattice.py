"""Find lattices of nosings: nosing k lies at (s0 + k·run, z0 + k·rise) with integer k.

Stairs that ascend from the camera have a positive run, those that descend a negative one; both are searched
at once. A step that was not seen leaves a gap in k and changes nothing else, which is where the report's
average over adjacent clusters fails (docs/method.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.config import EnvelopeConfig
from stairmap.detection.nosing_search import Corners
from stairmap.kernels import label_close, score_lattices
from stairmap.kernels.lattices import LatticeLimits, find_members

MAX_MISSED = 2
"""How many steps in a row may be missed between two that found a lattice."""

CORNER_STD = 0.017
"""Half of how far corners of one nosing lie apart in neighbouring scans, m, beyond the noise."""

MAX_GROUP_DISTANCE, MAX_GROUP_HEIGHT = 0.09, 0.05
"""Farther apart than this, m, corners are of different nosings whatever the noise."""

MAX_STRIP_GAP = 2
"""Scans of one nosing are at most so many strips apart."""

MIN_STRIPS = 2
"""Fewest strips of a nosing."""

ENVELOPE_SLACK, PITCH_SLACK_DEG = 0.1, 3.0
"""The envelope is widened by this share, and by these degrees: a pair of nosings measures less well than the
lattice that follows."""

INLIER_DISTANCE, INLIER_HEIGHT, MAX_SPREAD = 0.035, 0.025, 0.05
"""How far a nosing of a lattice lies off its place at most, m, and the most that noise adds to it, m."""

GROWTH = 0.15
"""How much the error of a pair's run and rise adds for each step away from it, as a share of the same."""

MAX_GAP = 5
"""Steps on end that a lattice may pass over: a person before the stairs hides no more. What lies beyond is
something else that happens to fit."""

MAX_INDEX = 32
"""Steps a lattice may reach from the pair that found it."""

GAP_COST = 0.5
"""A missed step takes this share of a typical nosing's score."""

MAX_STRIPS_COUNTED = 12
"""More strips than this do not raise a nosing's score: a wall's edge is no better nosing for being wide."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NosingGroups:
    """Corners of neighbouring scans that are one edge.

    Attributes
    ----------
    distance, height
        (N,) mean s and z, m.
    strips
        (N, num_strips) in which strips each was seen.
    """

    distance: Float64Array
    height: Float64Array
    strips: Mask

    def __len__(self) -> int:
        return len(self.distance)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """A lattice of nosings in one frame, in the vertical plane along its heading, m.

    Attributes
    ----------
    distance, height
        s and z of nosing 0, the lowest one seen.
    run
        Positive where the stairs ascend away from the camera, negative where they descend.
    rise
        Always positive.
    indices
        (M,) indices of the nosings found, ascending, the first 0.
    strips
        (num_strips,) where nosings were found.
    score
        Strips of its nosings, gaps deducted.
    """

    distance: float
    height: float
    run: float
    rise: float
    indices: IntArray
    strips: Mask
    score: float


def group_corners(corners: Corners, *, num_strips: int, noise: float) -> NosingGroups:
    """Join corners of neighbouring strips that lie close together.

    Parameters
    ----------
    corners
        Corners of single scans.
    num_strips
        Number of strips of the elevation.
    noise
        Standard deviation of inverse distance in a strip, 1/m.
    """
    if len(corners) == 0:
        return NosingGroups(distance=np.zeros(0), height=np.zeros(0), strips=np.zeros((0, num_strips), bool))
    distance, height = np.ascontiguousarray(corners.distance), np.ascontiguousarray(corners.height)
    strip = np.ascontiguousarray(corners.strip)
    tolerance = 2.0 * CORNER_STD + 2.0 * noise * distance**2
    reach = np.minimum(tolerance, MAX_GROUP_DISTANCE), np.minimum(tolerance, MAX_GROUP_HEIGHT)
    label = label_close((distance, height, strip), reach, MAX_STRIP_GAP)
    size = np.bincount(label)
    count = len(size)
    strips = np.zeros((count, num_strips), dtype=bool)
    strips[label, strip] = True
    keep = strips.sum(axis=1) >= MIN_STRIPS
    return NosingGroups(
        distance=(np.bincount(label, distance, count) / size)[keep],
        height=(np.bincount(label, height, count) / size)[keep],
        strips=strips[keep],
    )


def find_lattices(
    groups: NosingGroups, envelope: EnvelopeConfig, *, noise: float, max_lattices: int = 3
) -> list[Lattice]:
    """Search the lattices that explain most nosings, best first.

    Every pair of groups that overlap laterally is tried as neighbours, and as having one or
    two missed steps between them. A hypothesis scores the strips of the nosings on it, one
    nosing per index, less half a nosing for each gap. A group serves one lattice only.

    Parameters
    ----------
    groups
        Nosings.
    envelope
        Dimensions a stairway may have.
    noise
        Standard deviation of inverse distance in a strip, 1/m.
    max_lattices
        How many are returned at most.
    """
    found: list[Lattice] = []
    free = np.ones(len(groups), dtype=bool)
    while len(found) < max_lattices:
        lattice, used = _find_best(groups, free, envelope, noise)
        if lattice is None:
            break
        found.append(lattice)
        free &= ~used
    return found


def _find_best(
    groups: NosingGroups, free: Mask, envelope: EnvelopeConfig, noise: float
) -> tuple[Lattice | None, Mask]:
    none = (None, np.zeros(len(groups), dtype=bool))
    if np.count_nonzero(free) < 2:
        return none
    distance, height = groups.distance, groups.height
    smaller, larger = 1.0 - ENVELOPE_SLACK, 1.0 + ENVELOPE_SLACK
    limits = LatticeLimits(
        min_rise=smaller * envelope.min_rise,
        max_rise=larger * envelope.max_rise,
        min_run=smaller * envelope.min_run,
        max_run=larger * envelope.max_run,
        min_pitch=math.radians(envelope.min_pitch_deg - PITCH_SLACK_DEG),
        max_pitch=math.radians(envelope.max_pitch_deg + PITCH_SLACK_DEG),
        max_steps=MAX_MISSED + 1,
        min_shared=MIN_STRIPS,
        max_distance=INLIER_DISTANCE,
        max_height=INLIER_HEIGHT,
        noise=noise,
        max_spread=MAX_SPREAD,
        growth=GROWTH,
        max_index=MAX_INDEX,
        gap_cost=GAP_COST,
    )
    size = np.minimum(groups.strips.sum(axis=1), MAX_STRIPS_COUNTED).astype(np.float64)
    run, rise, anchor, score, num_present = score_lattices(
        (distance, height, size), groups.strips, free, limits
    )
    if num_present < 2:
        return none
    fits, index = find_members((distance, height), (run, rise, anchor), limits)
    inliers = fits & free & (groups.strips & groups.strips[anchor]).any(axis=1)
    part = _largest_part(index, inliers, size)
    if part is not None:
        inliers, score = part
    k = index[inliers]
    lowest = int(k.min())
    weight = groups.strips[inliers].sum(axis=1).astype(np.float64)
    best_run, start_s = _fit_line(k - lowest, distance[inliers], weight, run)
    best_rise, start_z = _fit_line(k - lowest, height[inliers], weight, rise)
    lattice = Lattice(
        distance=start_s,
        height=start_z,
        run=best_run,
        rise=best_rise,
        indices=np.unique(k - lowest).astype(np.int64),
        strips=groups.strips[inliers].any(axis=0),
        score=score,
    )
    return lattice, inliers


def _largest_part(index: Float64Array, inliers: Mask, size: Float64Array) -> tuple[Mask, float] | None:
    """Which nosings are of the largest part of a lattice without gaps of more than ``MAX_GAP`` steps, and its
    score; ``None`` where nothing is left out."""
    places = np.unique(index[inliers])
    best = np.array([size[inliers & (index == place)].max() for place in places])
    part = np.cumsum(np.diff(places, prepend=places[0]) > MAX_GAP + 1)
    total = np.bincount(part, best) * (np.bincount(part) > 1)
    if len(total) == 1 or not total.any():
        return None
    chosen = part == int(np.argmax(total))
    num_gaps = places[chosen][-1] - places[chosen][0] + 1 - np.count_nonzero(chosen)
    score = float(best[chosen].sum() - GAP_COST * num_gaps * best[chosen].mean())
    return inliers & np.isin(index, places[chosen]), score


def _fit_line(
    index: Float64Array, value: Float64Array, weight: Float64Array, fallback: float
) -> tuple[float, float]:
    """Weighted line value = start + index * step; the step falls back where only one index is there."""
    mean_index = float(np.average(index, weights=weight))
    mean_value = float(np.average(value, weights=weight))
    spread = float(np.average((index - mean_index) ** 2, weights=weight))
    if spread < 1e-9:
        return fallback, mean_value - mean_index * fallback
    step = float(np.average((index - mean_index) * (value - mean_value), weights=weight)) / spread
    return step, mean_value - mean_index * step
