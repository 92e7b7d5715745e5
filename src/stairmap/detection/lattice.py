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
from stairmap.kernels import join_corners, search_lattices
from stairmap.kernels.lattices import JoinLimits, LatticeLimits

MAX_MISSED = 2
"""How many steps in a row may be missed between two that found a lattice."""

CORNER_STD = 0.017
"""Half of how far corners of one nosing lie apart in neighbouring scans, m, beyond the noise."""

MAX_GROUP_DISTANCE, MAX_GROUP_HEIGHT = 0.09, 0.05
"""Farther apart than this, m, corners are of different nosings whatever the noise."""

MAX_STRIP_GAP = 2
"""Scans of one nosing are at most this many strips apart."""

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
    limits = JoinLimits(
        reach=2.0 * CORNER_STD,
        noise=2.0 * noise,
        max_distance=MAX_GROUP_DISTANCE,
        max_height=MAX_GROUP_HEIGHT,
        max_gap=MAX_STRIP_GAP,
        min_strips=MIN_STRIPS,
    )
    distance, height, strips = join_corners(corners.places, num_strips, limits)
    return NosingGroups(distance=distance, height=height, strips=strips)


def find_lattices(
    groups: NosingGroups, envelope: EnvelopeConfig, *, noise: float, max_lattices: int
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
        max_size=MAX_STRIPS_COUNTED,
        gap_cost=GAP_COST,
        max_gap=MAX_GAP,
    )
    distances, heights = np.ascontiguousarray(groups.distance), np.ascontiguousarray(groups.height)
    nosings = distances, heights, np.ascontiguousarray(groups.strips)
    numbers, is_present, strips = search_lattices(nosings, limits, max_lattices)
    return [
        Lattice(
            distance=distance,
            height=height,
            run=run,
            rise=rise,
            indices=np.flatnonzero(is_present[place]),
            strips=strips[place],
            score=score,
        )
        for place, (distance, height, run, rise, score) in enumerate(numbers.tolist())
    ]
