"""Which estimated flight stands for which true one.

A pair is possible when the estimate agrees with the truth, moved to where the odometry put it, in

* heading, within ``MAX_HEADING``;
* dimension: rise and run each within ``MAX_RATIO`` (a rise that is doubled, because every second
  step was missed, is no measure of this flight);
* place: the plans of the two overlap along and across by at least ``MIN_OVERLAP`` of the smaller
  one, and in the middle of the overlap the two lines of nosings are within ``MAX_HEIGHT``.

Among the possible pairs the assignment with the most pairs and then the least sum of deviations
is taken. A true flight has at most one estimate: a second one of the same flight is a duplicate,
and a duplicate is false. An estimate of an optional flight is neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight

MAX_HEADING = float(np.radians(25))
MAX_RATIO = 1.4
MIN_OVERLAP = 0.3
MAX_HEIGHT = 0.25
"""Largest vertical distance of the lines of nosings, m: more than a riser is another place."""

_IMPOSSIBLE = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class Matching:
    """Result of matching; indices into the sequences that were given.

    Attributes
    ----------
    pairs
        (estimate, truth) pairs, also of optional flights.
    duplicates
        Estimates of a flight that has a better one.
    strays
        Estimates of nothing that is there.
    """

    pairs: tuple[tuple[int, int], ...]
    duplicates: tuple[int, ...]
    strays: tuple[int, ...]


def match_flights(
    estimates: Sequence[Flight], truths: Sequence[Flight], *, optional: Sequence[bool]
) -> Matching:
    """Match estimated flights to true ones, as the module describes.

    Parameters
    ----------
    estimates
        Estimated flights.
    truths
        True flights in the same map.
    optional
        For each true flight, whether it need not be found; duplicates of those are forgiven.
    """
    costs = np.full((len(estimates), len(truths)), _IMPOSSIBLE)
    for row, estimate in enumerate(estimates):
        for column, truth in enumerate(truths):
            deviation = find_deviation(estimate, truth)
            if deviation is not None:
                costs[row, column] = deviation
    rows, columns = linear_sum_assignment(costs)
    pairs = tuple(
        (int(row), int(column))
        for row, column in zip(rows, columns, strict=True)
        if costs[row, column] < _IMPOSSIBLE
    )
    matched = {row for row, _ in pairs}
    duplicates, strays = [], []
    for row in range(len(estimates)):
        if row in matched:
            continue
        possible = np.flatnonzero(costs[row] < _IMPOSSIBLE)
        if len(possible) == 0:
            strays.append(row)
        elif not any(optional[int(column)] for column in possible):
            duplicates.append(row)
    return Matching(pairs=pairs, duplicates=tuple(duplicates), strays=tuple(strays))


def find_deviation(estimate: Flight, truth: Flight) -> float | None:
    """Return how far an estimate is from a true flight, in parts of the limits; ``None``: too far."""
    heading = abs(wrapped_angle(estimate.heading - truth.heading)) / MAX_HEADING
    ratios = [
        abs(np.log(getattr(estimate, name) / getattr(truth, name))) / np.log(MAX_RATIO)
        for name in ("rise", "run")
    ]
    # In the true flight's coordinate frame, where a line of nosings begins at its first nosing.
    first, last = (
        truth.map_from_flight[:3, :3].T @ (nosing.mean(axis=0) - truth.base)
        for nosing in estimate.edges()[[0, -1]]
    )
    true_end = (truth.num_risers - 1) * truth.run
    along = _overlap((min(first[0], last[0]), max(first[0], last[0])), (0.0, true_end), pad=truth.run / 2)
    middle = (first[1] + last[1]) / 2
    across = _overlap(
        (middle - estimate.width / 2, middle + estimate.width / 2), (-truth.width / 2, truth.width / 2)
    )
    if along is None or across is None:
        return None
    place = sum(along) / 2
    slope = (last[2] - first[2]) / max(last[0] - first[0], 1e-6)
    height = first[2] + slope * (place - first[0]) if last[0] - first[0] > 1e-6 else first[2]
    offset = abs(height - truth.rise * (1 + place / truth.run)) / MAX_HEIGHT
    parts = [heading, *ratios, offset]
    return float(sum(parts)) if max(parts) <= 1 else None


def _overlap(
    first: tuple[float, float], second: tuple[float, float], *, pad: float = 0.0
) -> tuple[float, float] | None:
    """Return the common part of two intervals, each longer by ``pad`` at both ends, if it is long enough."""
    low, high = max(first[0], second[0]) - pad, min(first[1], second[1]) + pad
    shorter = min(first[1] - first[0], second[1] - second[0]) + 2 * pad
    return (low, high) if high - low >= MIN_OVERLAP * shorter and high > low else None
