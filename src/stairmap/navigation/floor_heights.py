"""Heights of floors: from where a robot stood, and from the ends of stairs where nobody was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points
from stairmap.errors import StairmapError
from stairmap.modeling.landings import top_of
from stairmap.stairway import Stairway
from stairmap.transforms import invert_transform, transform_points

SAME_FLOOR = 0.6
"""Ends of stairways whose heights differ by less are on one floor, m: drift and sills, but no half storey."""

MIN_STOREY = 1.9
"""A floor that only the way tells of lies so far from all others, m: a landing lies nearer."""

MIN_FLOOR_DISTANCE = 0.3
"""Floors that are nearer than this overlap, m."""

MAX_UNSEEN_RISE = 1.0
"""By how much stairs may go on beyond an open end to a floor that is known otherwise, m: six risers of which
no frame showed anything. A floor farther off is another one."""

ON_FLOOR = 0.3
"""Feet are on a floor within this of its height, m."""

_ON_STAIRS = 1.5
"""Who stays within this of stairs, m, halfway up, may be on a landing that nobody modelled."""

_ON_STEPS = 0.1
"""Feet so far above the foot of a flight and below its top are on its steps, m."""

_STAY_BAND = 0.05
"""Feet that stay within this of a height are on a floor, m: who climbs is past in half a second."""

_MIN_CAMERA_HEIGHT = 0.15
MIN_POSES = 3
_MIN_STAY_POSES = 10


class FloorError(StairmapError):
    """Floors cannot be told apart or placed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StairEnds:
    """(N, 2) heights of the lower and upper ends of stairways, m, which of them nobody saw, and by how much
    the ends on one floor may differ, m."""

    heights: Float64Array
    are_open: Mask
    tolerance: float

    @classmethod
    def of(cls, stairways: Sequence[Stairway]) -> StairEnds:
        heights = np.array(
            [(stairway.flights[0].base[2], top_of(stairway.flights[-1])[2]) for stairway in stairways]
        ).reshape(-1, 2)
        are_open = np.array(
            [
                (stairway.flights[0].is_open_below, stairway.flights[-1].is_open_above)
                for stairway in stairways
            ],
            dtype=np.bool_,
        ).reshape(-1, 2)
        return cls(heights=heights, are_open=are_open, tolerance=_tolerance(heights))

    def seen_heights(self) -> list[float]:
        """Return the heights of floors that the ends that were seen tell, m."""
        return _cluster_heights(self.seen, self.tolerance)

    @property
    def seen(self) -> Float64Array:
        """(M,) heights of the ends that were seen, m."""
        return np.asarray(self.heights[~self.are_open])


def told_heights(ends: StairEnds) -> list[float]:
    """Heights of floors as the ends of stairs alone tell them: those that were seen, if there are any."""
    return ends.seen_heights() or _cluster_heights(ends.heights.reshape(-1), ends.tolerance)


def estimate_camera_height(poses: Float64Array, heights: Sequence[float]) -> float:
    """Median height of the camera above the next floor below it."""
    if not heights:
        raise FloorError(
            "the run has no stairway, so the height of its floor is not known; "
            "give the camera's height above it"
        )
    above = poses[:, None] - np.array(heights)
    nearest = np.where(above > _MIN_CAMERA_HEIGHT, above, np.inf).min(axis=1)
    nearest = nearest[nearest < 2.2]
    if not len(nearest):
        raise FloorError(
            "the camera was never above a floor that a stairway begins or ends on; "
            "give its height above the floor"
        )
    return float(np.median(nearest))


def find_stood_floors(places: Points, stairways: Sequence[Stairway], ends: StairEnds) -> list[float]:
    """Heights of the floors that the robot stood on, and of those at which stairs were seen to end.

    Parameters
    ----------
    places
        (N, 3) places of the robot's feet, m, map.
    stairways, ends
        What stairs there are.
    """
    feet = places[:, 2]
    off_steps = feet[~_are_on_steps(places, stairways)]
    heights: list[float] = []
    if len(off_steps) and abs(off_steps[0] - feet[0]) < ON_FLOOR:
        heights.append(float(np.median(off_steps[np.abs(off_steps - off_steps[0]) < ON_FLOOR / 2])))
    heights += _cluster_heights(
        np.array(
            [end for end in ends.seen if all(abs(end - height) >= ends.tolerance for height in heights)]
        ),
        ends.tolerance,
    )
    heights += _find_reached_floors(off_steps, heights, ends)
    heights += _find_other_floors(feet[~_are_on_stairs(places, stairways)], heights)
    nearest = np.abs(off_steps[:, None] - np.array(heights)) if heights else np.empty((len(off_steps), 0))
    told = []
    for index, height in enumerate(heights):
        is_own = (nearest.argmin(axis=1) == index) & (nearest[:, index] < ON_FLOOR)
        is_stood_on = np.count_nonzero(is_own) >= min(MIN_POSES, len(feet))
        told.append(float(np.median(off_steps[is_own])) if is_stood_on else height)
    return _without_overlaps(told)


def with_open_ends(fixed: Sequence[float], ends: StairEnds) -> list[float]:
    """Heights of all floors: those that are known, and those that only open ends tell of."""
    alone = [
        height
        for height, side in zip(ends.heights[ends.are_open], np.nonzero(ends.are_open)[1], strict=True)
        if not any(may_be_floor_of(floor - height, 1 if side else -1, ends.tolerance) for floor in fixed)
    ]
    bounds = [
        height
        for height in _cluster_heights(np.array(alone), ends.tolerance)
        if not any(abs(height - floor) < MIN_FLOOR_DISTANCE for floor in fixed)
    ]
    return sorted([*fixed, *bounds])


def may_be_floor_of(distance: float, side: int, tolerance: float) -> bool:
    """Whether a floor so far above an open end is the one that the stairs lead to, up (1) or down (-1)."""
    return -tolerance < distance * side < max(tolerance, MAX_UNSEEN_RISE)


def _find_reached_floors(feet: Float64Array, heights: Sequence[float], ends: StairEnds) -> list[float]:
    """Heights at which the robot stayed within reach of an end of stairs that nobody saw."""
    found: list[float] = []
    for height, side in zip(ends.heights[ends.are_open], np.nonzero(ends.are_open)[1], strict=True):
        distance = feet - height
        is_near = [may_be_floor_of(float(value), 1 if side else -1, ON_FLOOR) for value in distance]
        rest = feet[np.array(is_near, dtype=np.bool_)]
        known = [*heights, *found]
        if known:
            rest = rest[np.abs(rest[:, None] - np.array(known)).min(axis=1) >= MIN_FLOOR_DISTANCE]
        stay = _find_stay(rest, _STAY_BAND)
        if stay is not None:
            found.append(stay)
    return found


def _find_other_floors(feet: Float64Array, heights: Sequence[float]) -> list[float]:
    """Heights at which the robot stayed, a storey away from all floors that are known."""
    found: list[float] = []
    rest = feet
    while len(rest):
        known = np.array([*heights, *found])
        if len(known):
            rest = rest[np.abs(rest[:, None] - known).min(axis=1) >= MIN_STOREY]
        stay = _find_stay(rest, ON_FLOOR / 2)
        if stay is None:
            break
        found.append(stay)
    return found


def _find_stay(feet: Float64Array, band: float) -> float | None:
    """Height at which most of the feet are, if it is at least ten within a band to either side, m."""
    if len(feet) < _MIN_STAY_POSES:
        return None
    is_near = np.abs(feet[:, None] - feet) < band
    best = int(np.argmax(np.count_nonzero(is_near, axis=1)))
    if np.count_nonzero(is_near[best]) < _MIN_STAY_POSES:
        return None
    return float(np.median(feet[is_near[best]]))


def _are_on_steps(places: Points, stairways: Sequence[Stairway]) -> Mask:
    """Tell which (N, 3) places of feet are on the steps of a flight or on a landing between two."""
    result = np.zeros(len(places), dtype=np.bool_)
    for stairway in stairways:
        for flight in stairway.flights:
            along, across, above = transform_points(invert_transform(flight.map_from_flight), places).T
            line = np.clip(along / flight.run, 0.0, flight.num_risers) * flight.rise
            is_between = (above > _ON_STEPS) & (above < flight.num_risers * flight.rise - _ON_STEPS)
            is_beside = np.abs(across) < flight.width / 2 + ON_FLOOR
            result |= is_between & is_beside & (np.abs(above - line) < ON_FLOOR + flight.rise)
        for landing in stairway.landings:
            near = np.hypot(*(places[:, :2] - landing.center[:2]).T) < max(landing.size)
            result |= near & (np.abs(places[:, 2] - landing.center[2]) < ON_FLOOR)
    return result


def _are_on_stairs(places: Points, stairways: Sequence[Stairway]) -> Mask:
    """Tell which (N, 3) places are on a flight or a landing: who stays there is on no floor."""
    result = np.zeros(len(places), dtype=np.bool_)
    shares = np.linspace(0.0, 1.0, 30)[:, None, None]
    for stairway in stairways:
        way = np.array([end for flight in stairway.flights for end in (flight.base, top_of(flight))])
        points = (way[:-1] + shares * np.diff(way, axis=0)).reshape(-1, 3)
        apart = np.abs(places[:, None] - points)
        is_near = (np.hypot(apart[..., 0], apart[..., 1]) < _ON_STAIRS) & (apart[..., 2] < ON_FLOOR)
        result |= is_near.any(axis=1)
    return result


def _tolerance(ends: Float64Array) -> float:
    """Largest spread of one floor: both ends of the lowest stairway must stay apart."""
    if not len(ends):
        return SAME_FLOOR
    return min(SAME_FLOOR, 0.9 * float((ends[:, 1] - ends[:, 0]).min()))


def _cluster_heights(values: Float64Array, tolerance: float) -> list[float]:
    clusters: list[list[float]] = []
    for value in np.sort(values):
        if clusters and value - clusters[-1][0] < tolerance:
            clusters[-1].append(float(value))
        else:
            clusters.append([float(value)])
    return _without_overlaps([float(np.median(cluster)) for cluster in clusters])


def _without_overlaps(heights: Sequence[float]) -> list[float]:
    """Ascending heights, without those that come closer to the one below than floors can be."""
    kept: list[float] = []
    for height in sorted(heights):
        if not kept or height - kept[-1] >= MIN_FLOOR_DISTANCE:
            kept.append(height)
    return kept
