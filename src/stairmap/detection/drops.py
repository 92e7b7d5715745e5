"""Find where the ground ends in one frame and goes on lower.

Along each bearing, a ray that ends well below the ground's plane proves that no ground is where it crosses
that plane. The drop lies between that place and the last ground before it. Ground that falls slowly, as on a
ramp, is seen all the way down: only where height changes from one ray to the next is there an edge.

Where ground that was measured without a gap ends and nothing at all is measured behind it, one frame cannot
tell a deep well from a floor that gives no returns. Such an end is told apart, as a void.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, readonly
from stairmap.detection.ground import MAX_RANGE, NOISE, NOISE_PER_METRE, GroundSamples
from stairmap.kernels import find_ledges
from stairmap.kernels.grounds import LedgeLimits

MIN_DEPTH = 0.10
"""Least depth of a drop, m: wheels of ordinary robots roll down what is lower, as a kerb's flush end."""

FAR_DEPTH, DEPTH_PER_METRE = 0.04, 0.04
"""What counts as lower lies this deep below the ground, m, and deeper with each metre of distance if that is
more than the least depth: far ground of stereo cameras waves by a decimetre at 3 m."""

MAX_DISTANCE = 3.5
"""Farthest edge that is looked for, m."""

PERSISTENCE, MIN_BELOW = 8, 5
"""Of this many measured rays behind an edge, at least the second number end below the ground: a few stray
ones do not."""

MAX_MIXED = 3
"""Most rays between the last ground and the first lower one that lie between both: pixels at an edge mix
what they see. A ramp shows many."""

STEPS_BEHIND, MIN_STEP_SHARE = 3, 0.7
"""From the last ground to this many rays behind the first lower one, the two largest steps down make at least
this share of the fall: an edge is one step, with a mixed pixel two, and so are the first treads of stairs."""

MIN_FALL = 0.40
"""Slope above which what falls is no ramp, 22 degrees: stairs that are seen down their treads."""

MAX_SHIFT = 0.05
"""An edge is put halfway between the last ground and the first lower ray, but at most so far beyond the
ground, m: where it lies in a gap is not known, and nearer is safer."""

MAX_GAP = 0.30
"""Longest stretch of ground, m, without a measurement between the last ground and the first lower ray: of a
longer one nobody knows where in it the edge lies."""

LAST_GROUND, MIN_LAST_GROUND = 6, 3
"""Of this many measured rays before an edge, at least the second number end on the ground."""

MAX_STEP, STEP_SHARE = 0.12, 0.12
"""Places of an edge along neighbouring bearings lie so near, m, or within this share of their distance: an
edge may run along the view."""

MAX_SKIPPED = 2
"""Bearings without an edge that an edge goes on over."""

LINE_TOLERANCE, LINE_TOLERANCE_SHARE = 0.03, 0.015
"""An edge is straight within this, m, and this share of its distance."""

MIN_LENGTH, MIN_PLACES = 0.20, 5
"""Shortest edge, m, and fewest bearings that show it: no robot falls through what is narrower."""

MIN_VOID, MIN_VOID_ROWS = 0.5, 4
"""Shortest stretch of ground, m, and fewest rays, from the last measurement on the ground to the next one
that make a void: dark patches, and shadows of a projector behind low things, are mostly shorter."""

MAX_VOID_DISTANCE = 2.5
"""Farthest void, m: farther ground is often not measured."""

MIN_VOID_LENGTH = 0.4
"""Shortest edge of a void, m: shadows of a projector beside things are narrower."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DropEdge:
    """An edge of the ground as one frame sees it, in the camera frame.

    Attributes
    ----------
    edge
        (2, 3) segment on the ground, m, left end first as seen from the ground before it.
    depth
        How far below the edge lies what was seen nearest behind it, m; the ground there may lie lower still.
        NaN at a void.
    num_rays
        Bearings that show it.
    """

    edge: Points
    depth: float
    num_rays: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "edge", readonly(self.edge))

    def to_dict(self) -> dict[str, Any]:
        """Return the edge as it stands in ``detections.jsonl``."""
        depth = None if math.isnan(self.depth) else round(self.depth, 4)
        return {"edge": np.round(self.edge, 4).tolist(), "depth": depth}

    @property
    def distance(self) -> float:
        """Distance from the camera to the nearest point of the edge, m."""
        first, last = self.edge
        along = last - first
        share = float(np.clip(-(first @ along) / max(along @ along, 1e-12), 0, 1))
        return float(np.linalg.norm(first + share * along))


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgePlaces:
    """Where the ground ends along single bearings.

    Attributes
    ----------
    column
        (N,) ascending columns of the samples.
    place
        (N, 2) forward and leftward distance along the ground, m.
    depth
        (N,) how far below the ground the first lower thing lies, m; NaN at a void.
    """

    column: IntArray
    place: Float64Array
    depth: Float64Array


def find_drops(samples: GroundSamples) -> tuple[DropEdge, ...]:
    """Return the edges of the ground in a frame, nearest first."""
    return _straight_edges(find_edge_places(samples), samples, MIN_LENGTH)


def find_voids(samples: GroundSamples) -> tuple[DropEdge, ...]:
    """Return where the ground of a frame ends and nothing is measured behind it, nearest first."""
    return _straight_edges(find_void_places(samples), samples, MIN_VOID_LENGTH)


def find_void_places(samples: GroundSamples) -> EdgePlaces:
    """Return along which bearings ground ends and nothing is measured where it would go on.

    What stands right behind the gap is no void: a thing whose foot is dark.
    """
    height, crossing = samples.height, samples.crossing
    is_measured = np.isfinite(height)
    # The last measured ray before as many without a measurement as make a void, in reach.
    near = int(np.count_nonzero((crossing < MAX_VOID_DISTANCE).any(axis=1)))
    last_start = min(near, len(height) - MIN_VOID_ROWS)
    begins = is_measured[LAST_GROUND - 1 : max(last_start, 0)].copy()
    for step in range(1, MIN_VOID_ROWS):
        begins &= ~is_measured[LAST_GROUND - 1 + step :][: len(begins)]
    start, column = np.nonzero(begins)
    # Most frames have no gap at all.
    if not len(start):
        return EdgePlaces(column=column, place=np.zeros((0, 2)), depth=np.zeros(0))
    start += LAST_GROUND - 1
    window = start - np.arange(LAST_GROUND)[:, None]
    low = crossing[start, column]
    tolerance = NOISE + NOISE_PER_METRE * crossing[window, column]
    is_ground = (np.abs(height[window, column]) < tolerance).all(axis=0) & (low < MAX_VOID_DISTANCE)
    start, column, low = start[is_ground], column[is_ground], low[is_ground]
    # A gap ends at a measured ray or at the border of the image.
    is_end = is_measured[:, column] & (np.arange(len(height))[:, None] > start)
    is_end[-1] = True
    end = is_end.argmax(axis=0)
    high = crossing[end, column]
    with np.errstate(invalid="ignore"):  # infinite where a ray never meets the ground
        is_void = high - low >= MIN_VOID
        is_void &= ~(high * (1.0 - height[end, column] / samples.view.height) < low + MIN_VOID)
    # In the order of rows, the first of each bearing is the nearest.
    column, nearest = np.unique(column[is_void], return_index=True)
    distance = low[is_void][nearest].astype(np.float64) + MAX_SHIFT
    place = np.stack([distance, distance * samples.view.bearing[column]], axis=1)
    return EdgePlaces(column=column, place=place, depth=np.full(len(column), np.nan))


def _straight_edges(places: EdgePlaces, samples: GroundSamples, min_length: float) -> tuple[DropEdge, ...]:
    """The straight edges through places along single bearings, nearest first."""
    edges = [
        _edge_from_places(places, piece, samples, min_length)
        for run in _runs(places)
        for piece in _straight_pieces(places.place, run)
    ]
    return tuple(sorted((edge for edge in edges if edge is not None), key=lambda edge: edge.distance))


def find_edge_places(samples: GroundSamples) -> EdgePlaces:
    """Return along which bearings the ground ends at a drop, and where."""
    column, distance, depth = find_ledges(samples.crossing, samples.height, samples.view.height, _LIMITS)
    place = np.stack([distance, distance * samples.view.bearing[column]], axis=1)
    return EdgePlaces(column=column, place=place, depth=depth)


_LIMITS = LedgeLimits(
    noise=NOISE,
    noise_per_metre=NOISE_PER_METRE,
    max_range=MAX_RANGE,
    min_depth=MIN_DEPTH,
    far_depth=FAR_DEPTH,
    depth_per_metre=DEPTH_PER_METRE,
    persistence=PERSISTENCE,
    min_below=MIN_BELOW,
    last_ground=LAST_GROUND,
    min_last_ground=MIN_LAST_GROUND,
    max_mixed=MAX_MIXED,
    max_gap=MAX_GAP,
    max_distance=MAX_DISTANCE,
    rows_behind=STEPS_BEHIND,
    min_step_share=MIN_STEP_SHARE,
    min_fall=MIN_FALL,
    max_shift=MAX_SHIFT,
)


def _runs(places: EdgePlaces) -> list[IntArray]:
    """Indices of places that follow each other along one edge."""
    if not len(places.column):
        return []
    step = np.linalg.norm(np.diff(places.place, axis=0), axis=1)
    reach = np.maximum(MAX_STEP, STEP_SHARE * places.place[1:, 0])
    apart = (np.diff(places.column) > MAX_SKIPPED + 1) | (step > reach)
    return list(np.split(np.arange(len(places.column)), np.flatnonzero(apart) + 1))


def _straight_pieces(place: Float64Array, run: IntArray) -> list[IntArray]:
    """Split a run where it bends: at the place farthest from the line between its ends, again and again."""
    pieces, rest = [], [run]
    while rest:
        part = rest.pop()
        if len(part) < MIN_PLACES:
            continue
        begin, along = place[part[0]], place[part[-1]] - place[part[0]]
        length = float(np.hypot(*along))
        offset = place[part] - begin
        off = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / max(length, 1e-9)
        off = np.minimum(off, np.hypot(*offset.T)) if length < 1e-9 else off
        worst = int(np.argmax(off))
        if off[worst] <= LINE_TOLERANCE + LINE_TOLERANCE_SHARE * float(place[part[worst], 0]):
            pieces.append(part)
        else:
            rest += [part[: worst + 1], part[worst:]] if 0 < worst < len(part) - 1 else []
    return pieces


def _edge_from_places(
    places: EdgePlaces, piece: IntArray, samples: GroundSamples, min_length: float
) -> DropEdge | None:
    """The segment through places of one straight piece; ``None`` where it is too short."""
    place = places.place[piece]
    middle = place.mean(axis=0)
    _, _, axes = np.linalg.svd(place - middle, full_matrices=False)
    along = (place - middle) @ axes[0]
    ends = middle + np.outer([along.min(), along.max()], axes[0])
    if np.hypot(*(ends[1] - ends[0])) < min_length:
        return None
    # Columns go from left to right, as the ends must.
    if (ends[1] - ends[0]) @ (place[-1] - place[0]) < 0:
        ends = ends[::-1]
    view = samples.view
    edge = np.outer(ends[:, 0], view.forward) + np.outer(ends[:, 1], view.left) - view.height * view.up
    return DropEdge(edge=edge, depth=float(np.median(places.depth[piece])), num_rays=len(piece))
