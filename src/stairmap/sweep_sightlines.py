"""Measure the heights of nosings by the beams that just pass over them.

A LiDAR near the floor sees no tread, only risers, and where points on a riser end is known no better than
they lie apart. But each beam passes the plane of a riser at some height, and either it ends there or it goes
on: the nosing is where one kind ends and the other begins. Noise of the range does not move that height, for
it moves points along their beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points, Vector
from stairmap.detection.observation import StairEdge, StairObservation
from stairmap.geometry import cross

MIN_CLEARANCE = 0.05
"""The viewpoint is at most this much above a nosing, m: from higher up its tread is seen, which tells
better."""

MAX_FALL = 0.10
"""Beams that fall less steeply than this may come from higher up: they hit the tread far behind its
nosing."""

ON_RISER, ON_TREAD = 0.07, 0.035
"""A beam ends on a riser within this of its plane, m: three deviations of a LiDAR's range. Where beams fall,
those that end farther behind it than the second may lie on the tread; nearer ones pass 3 mm above at most."""

MIN_DISTANCE = 0.2
"""A LiDAR nearer to a riser, m, looks down on it."""

BEYOND = 0.5
"""A beam goes on where it ends this part of a run behind the nosing, or more."""

REACH = 0.45
"""Heights within this part of a rise of where the nosing was found are looked at."""

SIDE_MARGIN = 0.08
"""Beams that pass nearer to the ends of the nosing, m, are left out."""

SIDE_REACH = 1.0
"""Beams that end farther beside the nosing, m, are left out."""

MIN_BEAMS = 8
"""Fewest beams of each kind."""

BLUR = 0.006
"""Standard deviation of the height at which a beam passes, m: 0.1° at 3 m, and what viewpoints are off."""

MIN_STD = 0.002
"""Standard deviation that more beams do not make smaller, m."""

IRREGULARITY = 0.004
"""Standard deviation of the heights of real steps off regular ones, m."""

MAX_MISFIT = 0.2
"""Largest share of beams near the nosing on the wrong side of it."""

UP_STD = float(np.radians(0.25))
"""Standard deviation of up in a window, rad."""

MIN_STEPS = 3
"""Fewest nosings whose height must be known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Frame:
    """The axes of an observation: forward, left, up from its origin."""

    origin: Vector
    axes: Float64Array

    def of(self, points: Points) -> Points:
        return np.asarray((points - self.origin) @ self.axes.T)


def refined_by_sightlines(
    observation: StairObservation, points: Points, viewpoints: Points, view_index: IntArray
) -> StairObservation:
    """Return an observation whose nosings have the heights that beams tell.

    Parameters
    ----------
    observation
        What was found in the points.
    points
        (N, 3) all points, in the frame of the observation, m.
    viewpoints, view_index
        (V, 3) where they were measured from, m, and (N,) which of these each was.
    """
    frame = _Frame(
        origin=observation.origin,
        axes=np.array([observation.forward, cross(observation.up, observation.forward), observation.up]),
    )
    edges = [(edge, frame.of(edge.nosing)) for edge in observation.edges]
    low_t = float(np.median([nosing[1, 1] for _, nosing in edges])) + SIDE_MARGIN
    high_t = float(np.median([nosing[0, 1] for _, nosing in edges])) - SIDE_MARGIN
    # First the one axis that leaves most points out.
    t = points @ frame.axes[1] - observation.origin @ frame.axes[1]
    near = np.flatnonzero((t > low_t - SIDE_REACH) & (t < high_t + SIDE_REACH))
    local, eyes = frame.of(points[near]), frame.of(viewpoints)[view_index[near]]
    heights = np.array([nosing[:, 2].mean() for _, nosing in edges])
    stds = np.array([_stated(edge) for edge, _ in edges])
    for row, (_, nosing) in enumerate(edges):
        found = _height_of(
            float(nosing[:, 0].mean()), float(heights[row]), (low_t, high_t), observation, local, eyes
        )
        if found is not None:
            height, std = found
            share = stds[row] ** 2 / (stds[row] ** 2 + std**2)
            heights[row] += share * (height - heights[row])
            stds[row] = stds[row] * std / np.hypot(stds[row], std)
    return _with_heights(observation, frame, heights, stds)


def _stated(edge: StairEdge) -> float:
    std = edge.std[1]
    return max(std, MIN_STD) if np.isfinite(std) else 0.05


def _height_of(
    distance: float,
    height: float,
    across: tuple[float, float],
    observation: StairObservation,
    local: Points,
    eyes: Points,
) -> tuple[float, float] | None:
    """Height of a nosing by the beams about it, and its standard deviation, m."""
    before = eyes[:, 0] < distance - MIN_DISTANCE
    behind = local[:, 0] > distance - ON_RISER
    above = eyes[:, 2] - height
    low = (above < MIN_CLEARANCE) | (above < MAX_FALL * (distance - eyes[:, 0]))
    chosen = before & behind & low
    points, start = local[chosen], eyes[chosen]
    share = (distance - start[:, 0]) / np.maximum(points[:, 0] - start[:, 0], 1e-9)
    passing = start + share[:, None] * (points - start)
    inside = (passing[:, 1] > across[0]) & (passing[:, 1] < across[1])
    inside &= np.abs(passing[:, 2] - height) < REACH * observation.rise
    passing, depth = passing[inside, 2], points[inside, 0] - distance
    falls = start[inside, 2] > height + MIN_CLEARANCE
    ends = passing[(np.abs(depth) < ON_RISER) & ~(falls & (depth > ON_TREAD))]
    goes_on = passing[depth > BEYOND * observation.run]
    if min(len(ends), len(goes_on)) < MIN_BEAMS:
        return None
    order = np.concatenate([ends, goes_on])
    is_end = np.concatenate([np.ones(len(ends)), np.zeros(len(goes_on))])
    by_height = np.argsort(order, kind="stable")
    order, is_end = order[by_height], is_end[by_height]
    # Beams that end above a height and that go on below it are on the wrong side of it.
    wrong = (is_end.sum() - np.concatenate([[0], np.cumsum(is_end)])) + np.concatenate(
        [[0], np.cumsum(1 - is_end)]
    )
    best = np.flatnonzero(wrong == wrong.min())
    borders = np.concatenate([[order[0]], 0.5 * (order[1:] + order[:-1]), [order[-1]]])
    place = float(borders[best].mean())
    close = np.abs(order - place) < 4 * BLUR
    if wrong.min() > MAX_MISFIT * len(order) or not close.any():
        return None
    density = max(float(np.count_nonzero(close)) / (8 * BLUR), 1.0)
    # The information of a threshold that is blurred, and half the gap of beams where they are few.
    std = float(np.hypot(np.sqrt(1.1 * BLUR / density), 0.5 / density))
    std = float(np.hypot(std, 0.5 * (borders[best[-1]] - borders[best[0]])))
    return place, float(np.hypot(std, MIN_STD))


def _with_heights(
    observation: StairObservation, frame: _Frame, heights: Float64Array, stds: Float64Array
) -> StairObservation:
    """Return the observation with nosings at these heights above its origin, and the rise that they make."""
    index = np.array([edge.step_index for edge in observation.edges])
    total = np.hypot(stds, IRREGULARITY)
    known = stds < 0.02
    if len(np.unique(index[known])) < MIN_STEPS:
        return observation
    weight = np.where(known, 1.0 / total**2, 0.0)
    slope = offset = 0.0
    for _ in range(5):
        mean_index, mean = np.average(index, weights=weight), np.average(heights, weights=weight)
        spread = float((weight * (index - mean_index) ** 2).sum())
        slope = float((weight * (index - mean_index) * (heights - mean)).sum() / spread)
        offset = float(mean - slope * mean_index)
        misfit = np.abs(heights - offset - slope * index) / total
        weight = np.where(known, np.minimum(1.0, 2.0 / np.maximum(misfit, 1e-9)) / total**2, 0.0)
    covariance = observation.covariance.copy()
    level = 1.0 / float(weight.sum())
    covariance[0, 0] = 1.0 / spread + (observation.run * UP_STD) ** 2
    covariance[3, 3] = level + mean_index**2 / spread
    heights = np.where(known, heights, offset + slope * index)
    edges = []
    for edge, height, std in zip(observation.edges, heights, stds, strict=True):
        nosing = frame.of(edge.nosing)
        nosing[:, 2] = height
        edges.append(
            replace(edge, nosing=nosing @ frame.axes + frame.origin, std=(edge.std[0], float(min(std, 0.05))))
        )
    return replace(
        observation,
        rise=slope,
        origin=observation.origin + offset * observation.up,
        edges=tuple(edges),
        covariance=covariance,
    )
