"""Which steps a flight has, and whether its ends were seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import IntArray, Mask

MIN_STEP_SHARE, MIN_NEXT_SHARE = 0.08, 0.15
"""A step counts when it was seen in this share of the observations of the best-seen step, at least twice;
above that, where fewer and fewer frames reach from below, in the second share of those of the step under it.
"""

MIN_END_VIEWS = 2
"""Fewest observations that saw a floor or landing at the same step, for the flight to end there: one may err.
"""


class StepRange(NamedTuple):
    """First and last step of a flight on its lattice, and whether what lies beyond them was seen."""

    first: int
    last: int
    bottom_seen: bool
    top_seen: bool


class SeenSteps(NamedTuple):
    """What a flight's observations say of its steps.

    Attributes
    ----------
    edge_step
        (E,) step on the flight's lattice of each edge.
    from_below
        (E,) whether it was seen from below.
    lowest, highest
        (N,) lowest and highest step of each observation.
    floor_seen, top_seen
        (N,) whether it saw the floor before its lowest step, the level behind its highest.
    """

    edge_step: IntArray
    from_below: Mask
    lowest: IntArray
    highest: IntArray
    floor_seen: Mask
    top_seen: Mask


def find_step_range(seen: SeenSteps) -> StepRange:
    """Return the steps seen often enough, ended by floor and landing where these were seen.

    An end is *seen* when at least ``MIN_END_VIEWS`` observations saw the floor or landing there and more than
    saw a step beyond. Otherwise it is open: the flight may go on.
    """
    lowest = int(seen.edge_step.min())
    counts = np.bincount(seen.edge_step - lowest)
    below = np.append(0, np.bincount(seen.edge_step[seen.from_below] - lowest, minlength=len(counts))[:-1])
    is_above = np.arange(len(counts)) > np.argmax(counts)
    needed = np.where(is_above, MIN_NEXT_SHARE * below, MIN_STEP_SHARE * counts.max())
    often = np.flatnonzero(counts >= np.maximum(needed, 2 if len(seen.lowest) > 1 else 1))
    if len(often) == 0:
        often = np.flatnonzero(counts)
    first, last = int(often[0]) + lowest, int(often[-1]) + lowest
    ends = []
    for was_seen, at, direction in (
        (seen.floor_seen, seen.lowest, 1),
        (seen.top_seen, seen.highest, -1),
    ):
        place = _find_end(at[was_seen], counts, lowest, direction)
        if place is not None and first <= place <= last:
            first, last = (place, last) if direction > 0 else (first, place)
        ends.append(place)
    return StepRange(first, last, ends[0] == first, ends[1] == last)


def _find_end(votes_at: IntArray, counts: IntArray, lowest: int, direction: int) -> int | None:
    """The step that most observations saw the flight begin or end with, if not more saw one beyond it."""
    if len(votes_at) < MIN_END_VIEWS:
        return None
    votes = np.bincount(votes_at - votes_at.min())
    if votes.max() < MIN_END_VIEWS:
        return None
    place = int(np.argmax(votes)) + int(votes_at.min())
    beyond = place - direction - lowest
    num_beyond = int(counts[beyond]) if 0 <= beyond < len(counts) else 0
    return place if votes.max() > num_beyond else None
