"""How far a flight reaches to either side, from the ends of all its edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, Mask

MIN_ENDS_SHARE = 0.04
"""Share of the edges whose ends must have been seen for the width to count as bounded, and three at least:
with a rail on both sides only the first step may show them."""

MIN_FIRST_EDGES = 5
"""Fewest edges of the first step with both ends seen that tell whether it is wider than the others."""

MIN_WIDER, MAX_WIDER = 0.03, 0.16
"""How much wider the first step is where posts or stringers are the reason, both sides together, m."""

DRIFT_ACROSS = 0.6
"""How much of the spread of the middles of a flight's edges is the standard deviation of its middle: all
weigh alike, but not all of it is drift."""

SYSTEMATIC_STD = 0.005
"""What no number of edges averages out of the width and of the middle, m: how a sensor shows an edge, and how
poses are turned against the camera."""

MIN_OPEN_EDGES, MIN_OPEN_SHARE = 5, 0.2
"""Fewest edges without an end on a side, and their smallest share of all, that tell how far it reaches at
least."""

MAX_SHORT_SHARE = 0.67
"""Largest share of the ends on a side that may fall short."""

MAX_SHORTFALL, MAX_HIDDEN = 0.05, 0.5
"""How much less than that an end may lie outward, m; and what lies farther out than this is another thing, a
landing or the stairs beside."""

EDGES_PER_SAMPLE = 60.0
"""Edges of neighbouring frames and steps that count as one independent measurement of the width."""


class FlightExtent(NamedTuple):
    """Lateral ends of a flight along the left axis, whether each was seen, and standard deviations, m."""

    left: float
    right: float
    left_bounded: bool
    right_bounded: bool
    width_std: float
    middle_std: float


def find_extent(
    edges: np.ndarray[tuple[int], np.dtype[np.void]], left_of_axis: Float64Array, is_first: Mask
) -> FlightExtent:
    """Return where a flight ends on both sides.

    Edges whose ends were both seen tell the width, whatever drift does to their place. A first step that
    is a little wider leaves two answers open: posts that stand on the steps hide the ends of all others,
    or stringers begin beside it. What is left between them is the width, and the standard deviation says
    how much it may be more.

    Parameters
    ----------
    edges
        (E,) records of ``EDGE_FIELDS``.
    left_of_axis
        (E,) how far the origins of their observations lie to the left, m.
    is_first
        (E,) whether each is of the first step.
    """
    left, right = edges["left"] + left_of_axis, edges["right"] + left_of_axis
    left_bounded = edges["left_bounded"] & ~_falls_short(left, edges["left_bounded"])
    right_bounded = edges["right_bounded"] & ~_falls_short(-right, edges["right_bounded"])
    both = left_bounded & right_bounded
    if np.count_nonzero(both) >= max(3, MIN_ENDS_SHARE * len(edges)):
        widths, middles = (left - right)[both], 0.5 * (left + right)[both]
        width, middle = float(np.median(widths)), float(np.median(middles))
        spread = 1.48 * float(np.median(np.abs(widths - width)))
        # Drift shows in all frames that saw one end, not only where both were seen.
        sides = np.concatenate([left[left_bounded] - width / 2, right[right_bounded] + width / 2])
        low, high = np.percentile(sides, (16.0, 84.0)).tolist()
        middle_spread = 0.5 * (high - low)
        samples = max(len(widths) / EDGES_PER_SAMPLE, 1.0)
        width_std = float(np.hypot(SYSTEMATIC_STD, spread / np.sqrt(samples)))
        first = both & is_first
        if np.count_nonzero(first) >= MIN_FIRST_EDGES:
            wider = float(np.median((left - right)[first])) - width
            if MIN_WIDER < wider < MAX_WIDER:
                width_std = float(np.hypot(width_std, wider / 2.0))
        return FlightExtent(
            middle + width / 2,
            middle - width / 2,
            True,
            True,
            width_std,
            float(np.hypot(SYSTEMATIC_STD, DRIFT_ACROSS * middle_spread)),
        )
    ends = []
    for values, bounded, sign in (
        (left, left_bounded, 1.0),
        (right, right_bounded, -1.0),
    ):
        is_seen = np.count_nonzero(bounded) >= max(3, MIN_ENDS_SHARE * len(edges))
        end = np.median(values[bounded]) if is_seen else sign * np.percentile(sign * values, 90)
        ends.append((float(end), bool(is_seen)))
    (left_end, left_is_seen), (right_end, right_is_seen) = ends
    # Drift spreads the ends of many frames; what a single frame saw of a step it does not widen.
    excess = max(left_end - right_end - float(np.percentile(left - right, 90)), 0.0)
    if left_is_seen:
        right_end += excess
    elif right_is_seen:
        left_end -= excess
    else:
        left_end, right_end = left_end - excess / 2, right_end + excess / 2
    return FlightExtent(left_end, right_end, left_is_seen, right_is_seen, 0.03, 0.03)


def _falls_short(ends: Float64Array, bounded: Mask) -> Mask:
    """Tell which of (E,) ends lie well within what edges reach whose ends were not seen.

    A stairway reaches as far as many of its edges were seen: an end before that is an obstacle's, or that
    of the side face of solid steps.
    """
    if not bounded.any():
        return np.zeros(len(ends), dtype=bool)
    unbounded = ends[~bounded & (ends < np.median(ends[bounded]) + MAX_HIDDEN)]
    if len(unbounded) < max(MIN_OPEN_EDGES, MIN_OPEN_SHARE * len(ends)):
        return np.zeros(len(ends), dtype=bool)
    falls_short = np.asarray(ends < np.median(unbounded) - MAX_SHORTFALL)
    # Where most do, what was seen farther out is not of this flight.
    if np.count_nonzero(falls_short & bounded) > MAX_SHORT_SHARE * np.count_nonzero(bounded):
        return np.zeros(len(ends), dtype=bool)
    return falls_short
