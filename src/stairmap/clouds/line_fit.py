"""Fit regular steps to the places of single surfaces, some of which may be those of other things."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray

SAME_LINE = 0.02
"""Places that are off the median's line by less than this are of one line, m: slabs are thicker."""

MIN_OUTER, OUTER_SHARE = 2, 0.4
"""Of parallel lines the outermost counts that has so many places, and this share of the fullest's."""

OUTLYING = 2.0
"""Steps farther off the line than so many standard deviations count less."""

IRREGULARITY = 0.004
"""Standard deviation of the places of real steps off the regular ones, m."""

MAX_CHANGE = 1.5
"""Measuring changes rise and run of a candidate by less than this factor, or it was none."""

NUM_ROUNDS = 6
"""Rounds of weighting: the weights change by less than a hundredth after them."""


def fit_line(
    index: IntArray,
    place: Float64Array,
    std: Float64Array,
    known: tuple[float, float],
    *,
    is_last_outer: bool,
) -> tuple[float, float]:
    """Robust line place = start + index * step; what the places do not tell stays as it is known."""
    if not len(index):
        return known
    step = known[1]
    if np.ptp(index) == 0:
        return float(np.mean(place - index * step)), step
    step = _median_step(index, place, step)
    if not is_last_outer:
        # Of heights, tops and undersides of slabs would be joined by a wrong step.
        step = _better_step(index, place, step)
    total = np.hypot(std, IRREGULARITY)
    start = place - index * step
    near = np.abs(start[:, None] - start[None, :]) < SAME_LINE
    number = near.sum(axis=1)
    # Thin steps have a back and an underside, parallel to what counts.
    enough = number >= max(MIN_OUTER, OUTER_SHARE * number.max())
    outermost = np.where(enough, start if is_last_outer else -start, -np.inf)
    near_outermost = enough & (outermost > outermost.max() - SAME_LINE)
    best = int(np.argmax(np.where(near_outermost, number, -1)))
    start_of_all, used = float(start[best]), near[best]
    if np.ptp(index[used]) == 0:
        return start_of_all, step
    index, place, total = index[used], place[used], total[used]
    weight = 1.0 / total**2
    for _ in range(NUM_ROUNDS):
        mean_index, mean_place = np.average(index, weights=weight), np.average(place, weights=weight)
        spread = np.average((index - mean_index) ** 2, weights=weight)
        step = float(np.average((index - mean_index) * (place - mean_place), weights=weight) / spread)
        start_of_all = float(mean_place - mean_index * step)
        offset = np.abs(place - start_of_all - index * step) / total
        weight = np.minimum(1.0, OUTLYING / np.maximum(offset, 1e-9)) / total**2
    return start_of_all, step


def _better_step(index: IntArray, place: Float64Array, step: float) -> float:
    """The step between two places, near or far apart, whose line has more of the places on it, if one has.

    In a grid of heights risers lie where cells end: nine cells, nine and ten, and the median says nine.
    """
    first, second = np.triu_indices(len(index), 1)
    apart = index[second] - index[first]
    first, second, apart = first[apart != 0], second[apart != 0], apart[apart != 0]
    steps = np.append(step, (place[second] - place[first]) / apart)
    steps = steps[(steps > step / MAX_CHANGE) & (steps < step * MAX_CHANGE)]
    starts = place - index * steps[:, None]
    number = (np.abs(starts[:, :, None] - starts[:, None, :]) < SAME_LINE).sum(axis=2).max(axis=1)
    return float(steps[int(np.argmax(number))]) if number.max() > number[0] else step


def _median_step(index: IntArray, place: Float64Array, known: float) -> float:
    """Median of the steps between all pairs of neighbours."""
    apart = np.diff(index)
    steps = np.diff(place)[apart > 0] / apart[apart > 0]
    steps = steps[(steps > known / MAX_CHANGE) & (steps < known * MAX_CHANGE)]
    return float(np.median(steps)) if len(steps) else known
