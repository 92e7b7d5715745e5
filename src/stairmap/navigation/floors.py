"""The floors of a building, from the ends of its stairways and the robot's way.

The ends of a stairway lie on two floors. An end that nobody saw is *open*: the stairs may go on there, so its
height is only a bound of that of its floor, and its place is no edge of a floor. The way tells which floors
were explored, and finds those that no stairway leads to (a lift does). Level 0 is where the robot began, or
the lowest without a way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points
from stairmap.errors import StairmapError
from stairmap.modeling.landings import top_of
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

SAME_FLOOR = 0.6
"""Ends of stairways whose heights differ by less are on one floor, m: drift and sills, but no half storey."""

MIN_STOREY = 1.9
"""A floor that only the way tells of lies so far from all others, m: a landing lies nearer."""

MIN_FLOOR_DISTANCE = 0.3
"""Floors that are nearer than this overlap, m."""

MAX_UNSEEN_RISE = 1.0
"""By how much stairs may go on beyond an open end to a floor that is known otherwise, m: six risers of which
no frame showed anything. A floor farther off is another one."""

_ON_FLOOR = 0.3
_ON_STAIRS = 1.5
_MIN_CAMERA_HEIGHT = 0.15
_MIN_POSES = 3
_MIN_LIFT_POSES = 10


class FloorError(StairmapError):
    """Floors cannot be told apart or placed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """One level of a building.

    Attributes
    ----------
    level
        Its number, from the bottom up without gaps.
    height
        Height of its surface, m, map z.
    is_explored
        Whether the robot was on it.
    is_open
        Whether only open ends of stairs and no robot tell of it: it lies at ``height`` or beyond.
    """

    level: int
    height: float
    is_explored: bool
    is_open: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorStack:
    """The floors of a building and which of them its stairways join.

    Attributes
    ----------
    floors
        Lowest first.
    levels
        (lower, upper) level of each stairway by its id.
    camera_height
        Height of the camera above the floor, m; NaN without a way.
    open_ends
        (lower, upper) by the id of each stairway: whether that end is open. One that was not seen, but at
        whose height a robot was or other stairs end, is not.

    Raises
    ------
    FloorError
        If two floors overlap.
    """

    floors: tuple[Floor, ...]
    levels: Mapping[int, tuple[int, int]]
    camera_height: float = float("nan")
    open_ends: Mapping[int, tuple[bool, bool]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "open_ends", MappingProxyType(dict(self.open_ends)))
        object.__setattr__(self, "levels", MappingProxyType(dict(self.levels)))
        for below, above in zip(self.floors, self.floors[1:], strict=False):
            if above.height - below.height < MIN_FLOOR_DISTANCE:
                raise FloorError(
                    f"floors {below.level} and {above.level} overlap: they lie at {below.height:.2f} m and "
                    f"{above.height:.2f} m, expected at least {MIN_FLOOR_DISTANCE} m between them"
                )

    def has_open_end(self, stairway_id: int, *, upper: bool) -> bool:
        """Tell whether the lower or upper end of a stairway is open; one that is not known is."""
        return self.open_ends.get(stairway_id, (True, True))[upper]

    def floor(self, level: int) -> Floor:
        """Return the floor of a level.

        Raises
        ------
        FloorError
            If there is none.
        """
        for floor in self.floors:
            if floor.level == level:
                return floor
        known = ", ".join(f"{floor.level} at {floor.height:.2f} m" for floor in self.floors)
        raise FloorError(f"there is no floor {level}; floors are {known or 'none'}")


def find_floors(
    stairways: Sequence[Stairway], trajectory: Trajectory | None = None, *, camera_height: float | None = None
) -> FloorStack:
    """Return the floors that stairways and a robot's way tell of.

    Parameters
    ----------
    stairways
        Each links two floors.
    trajectory
        Poses of the camera.
    camera_height
        Height of the camera above the floor, m; ``None``: the median over the floors that stairways
        tell of.

    Raises
    ------
    FloorError
        If there is nothing that tells of a floor, or no stairway and no camera height.
    """
    ends = np.array(
        [(stairway.flights[0].base[2], top_of(stairway.flights[-1])[2]) for stairway in stairways]
    )
    are_open = np.array(
        [(stairway.flights[0].is_open_below, stairway.flights[-1].is_open_above) for stairway in stairways],
        dtype=np.bool_,
    ).reshape(-1, 2)
    ends, tolerance = ends.reshape(-1, 2), _tolerance(ends.reshape(-1, 2))
    seen = _cluster_heights(ends[~are_open], tolerance)
    told = seen or _cluster_heights(ends.reshape(-1), tolerance)
    if trajectory is None:
        if not told:
            raise FloorError("there are no floors: the run has no stairway and no trajectory")
        feet = np.empty(0)
        camera_height = float("nan") if camera_height is None else camera_height
    else:
        poses = trajectory.map_from_camera[:, 2, 3]
        if camera_height is None:
            camera_height = _estimate_camera_height(poses, told)
        feet = poses - camera_height
        places = trajectory.map_from_camera[:, :3, 3] - [0.0, 0.0, camera_height]
        off_stairs = feet[~_are_on_stairs(places, stairways)]
        seen = sorted([*seen, *_find_other_floors(off_stairs, told)])
    heights = _with_open_ends(seen, ends, are_open, tolerance)
    first = int(np.argmin(np.abs(np.array(heights) - feet[0]))) if len(feet) else 0
    floors = []
    for index, height in enumerate(heights):
        num_on = int(np.count_nonzero(np.abs(feet - height) < _ON_FLOOR))
        is_explored = num_on >= min(_MIN_POSES, len(feet) or 1)
        floors.append(
            Floor(
                level=index - first,
                height=height,
                is_explored=is_explored,
                is_open=height not in seen and not is_explored,
            )
        )
    levels, open_ends = {}, {}
    for stairway, (low, high), (is_low_open, is_high_open) in zip(stairways, ends, are_open, strict=True):
        lower = _floor_of_end(floors, low, is_open=is_low_open, side=-1)
        upper = _floor_of_end(floors, high, is_open=is_high_open, side=1)
        levels[stairway.id] = (lower.level, upper.level)
        open_ends[stairway.id] = (
            bool(is_low_open and not _is_at(lower, low)),
            bool(is_high_open and not _is_at(upper, high)),
        )
    return FloorStack(floors=tuple(floors), levels=levels, camera_height=camera_height, open_ends=open_ends)


def _is_at(floor: Floor, height: float) -> bool:
    """Whether a floor that is known otherwise lies at the height of an end that was not seen."""
    return not floor.is_open and abs(floor.height - height) < _ON_FLOOR


def _with_open_ends(
    seen: Sequence[float], ends: Float64Array, are_open: Mask, tolerance: float
) -> list[float]:
    """Heights of all floors: those that are known, and those that only open ends tell of."""
    alone = [
        height
        for height, side in zip(ends[are_open], np.nonzero(are_open)[1], strict=True)
        if not any(_may_be(floor - height, 1 if side else -1, tolerance) for floor in seen)
    ]
    bounds = [
        height
        for height in _cluster_heights(np.array(alone), tolerance)
        if not any(abs(height - floor) < MIN_FLOOR_DISTANCE for floor in seen)
    ]
    return sorted([*seen, *bounds])


def _may_be(distance: float, side: int, tolerance: float) -> bool:
    """Whether a floor so far above an open end is the one that the stairs lead to, up (1) or down (-1)."""
    return -tolerance < distance * side < max(tolerance, MAX_UNSEEN_RISE)


def _floor_of_end(floors: Sequence[Floor], height: float, *, is_open: bool, side: int) -> Floor:
    """The floor on which an end lies; for an open one, the first that the stairs come to if they go on."""
    nearest = min(floors, key=lambda floor: abs(floor.height - height))
    if not is_open or abs(nearest.height - height) < _ON_FLOOR:
        return nearest
    ahead = [
        floor for floor in floors if _may_be(floor.height - height, side, _ON_FLOOR) and not floor.is_open
    ]
    return min(ahead, key=lambda floor: abs(floor.height - height)) if ahead else nearest


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
    heights = [float(np.median(cluster)) for cluster in clusters]
    # Medians of neighbouring clusters may come closer than floors can be.
    return [
        height for index, height in enumerate(heights)
        if not index or height - heights[index - 1] >= MIN_FLOOR_DISTANCE
    ]  # fmt: skip


def _estimate_camera_height(poses: Float64Array, heights: Sequence[float]) -> float:
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


def _are_on_stairs(places: Points, stairways: Sequence[Stairway]) -> Mask:
    """Tell which (N, 3) places are on a flight or a landing: who stays there is on no floor."""
    result = np.zeros(len(places), dtype=np.bool_)
    shares = np.linspace(0.0, 1.0, 30)[:, None, None]
    for stairway in stairways:
        way = np.array([end for flight in stairway.flights for end in (flight.base, top_of(flight))])
        points = (way[:-1] + shares * np.diff(way, axis=0)).reshape(-1, 3)
        apart = np.abs(places[:, None] - points)
        is_near = (np.hypot(apart[..., 0], apart[..., 1]) < _ON_STAIRS) & (apart[..., 2] < _ON_FLOOR)
        result |= is_near.any(axis=1)
    return result


def _find_other_floors(feet: Float64Array, heights: Sequence[float]) -> list[float]:
    """Heights at which the robot stayed, a storey away from all floors that are known."""
    found: list[float] = []
    rest = feet
    while len(rest):
        known = np.array([*heights, *found])
        if len(known):
            rest = rest[np.abs(rest[:, None] - known).min(axis=1) >= MIN_STOREY]
        if len(rest) < _MIN_LIFT_POSES:
            break
        counts = np.count_nonzero(np.abs(rest[:, None] - rest) < _ON_FLOOR / 2, axis=1)
        best = int(np.argmax(counts))
        if counts[best] < _MIN_LIFT_POSES:
            break
        found.append(float(np.median(rest[np.abs(rest - rest[best]) < _ON_FLOOR / 2])))
    return found
