"""The floors of a building, from the robot's way and the ends of its stairways.

Where the robot stood is a floor, also one that no stairway leads to (a lift does). The ends of a stairway lie
on two floors, and tell of those where nobody was. An end that nobody saw is *open*: the stairs may go on
there, so its height is only a bound of that of its floor, and its place is no edge of a floor. Level 0 is
where the robot began, or the lowest without a way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from stairmap.navigation.floor_heights import (
    MIN_FLOOR_DISTANCE,
    MIN_POSES,
    ON_FLOOR,
    SAME_FLOOR,
    FloorError,
    StairEnds,
    estimate_camera_height,
    find_stood_floors,
    may_be_floor_of,
    told_heights,
    with_open_ends,
)
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

__all__ = ["Floor", "FloorError", "FloorStack", "find_floors"]


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
    id
        Its number, which stays when floors are found between others and levels change; see ``find_floors``.
    """

    level: int
    height: float
    is_explored: bool
    is_open: bool = False
    id: int | None = None


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
    stairways: Sequence[Stairway],
    trajectory: Trajectory | None = None,
    *,
    camera_height: float | None = None,
    known: FloorStack | None = None,
) -> FloorStack:
    """Find the floors of a building from where the robot drove and where its stairways end.

    Where the robot stood, the height of a floor is that of the camera minus the camera's height above the
    floor. Ends of stairs count for floors where the robot never was. An end that was not seen counts only if
    nothing else gives that floor.

    Parameters
    ----------
    stairways
        Each links two floors.
    trajectory
        Poses of the camera.
    camera_height
        Height of the camera above the floor, m, measured or from ``MapSession.camera_height``; ``None``: the
        median over the floors at the ends of stairways, which is as accurate as these ends.
    known
        Floors that were found before; those found again keep their ``id``.

    Raises
    ------
    FloorError
        If there is neither a stairway nor a trajectory with a camera height.
    """
    ends = StairEnds.of(stairways)
    if trajectory is None:
        if not len(ends.heights):
            raise FloorError("there are no floors: the run has no stairway and no trajectory")
        feet, fixed = np.empty(0), ends.seen_heights()
        camera_height = float("nan") if camera_height is None else camera_height
    else:
        poses = trajectory.map_from_camera[:, :3, 3]
        if camera_height is None:
            camera_height = estimate_camera_height(poses[:, 2], told_heights(ends))
        feet = poses[:, 2] - camera_height
        fixed = find_stood_floors(poses - [0.0, 0.0, camera_height], stairways, ends)
    heights = with_open_ends(fixed, ends)
    first = int(np.argmin(np.abs(np.array(heights) - feet[0]))) if len(feet) else 0
    floors = []
    for index, height in enumerate(heights):
        num_on = int(np.count_nonzero(np.abs(feet - height) < ON_FLOOR))
        is_explored = num_on >= min(MIN_POSES, len(feet) or 1)
        floors.append(
            Floor(
                level=index - first,
                height=height,
                is_explored=is_explored,
                is_open=height not in fixed and not is_explored,
            )
        )
    floors = _with_ids(floors, known)
    levels, open_ends = {}, {}
    for stairway, (low, high), (is_low_open, is_high_open) in zip(
        stairways, ends.heights, ends.are_open, strict=True
    ):
        lower = _floor_of_end(floors, low, is_open=is_low_open, side=-1)
        upper = _floor_of_end(floors, high, is_open=is_high_open, side=1)
        levels[stairway.id] = (lower.level, upper.level)
        open_ends[stairway.id] = (
            bool(is_low_open and not _is_at(lower, low)),
            bool(is_high_open and not _is_at(upper, high)),
        )
    return FloorStack(floors=tuple(floors), levels=levels, camera_height=camera_height, open_ends=open_ends)


def _with_ids(floors: Sequence[Floor], known: FloorStack | None) -> list[Floor]:
    """Give floors the ids of those known before at their height, and new ones to others."""
    left = [] if known is None else [floor for floor in known.floors if floor.id is not None]
    taken = {floor.id for floor in left if floor.id is not None}
    ids: dict[int, int] = {}
    pairs = sorted(
        (abs(floor.height - other.height), place, number)
        for place, floor in enumerate(floors)
        for number, other in enumerate(left)
    )
    used: set[int] = set()
    for distance, place, number in pairs:
        known_id = left[number].id
        if distance < SAME_FLOOR and place not in ids and number not in used and known_id is not None:
            ids[place] = known_id
            used.add(number)
    for place, floor in enumerate(floors):
        if place not in ids:
            # Without floors known before, an id is the level; otherwise a number that none ever had.
            ids[place] = floor.level if known is None else max(taken, default=-1) + 1
            taken.add(ids[place])
    return [replace(floor, id=ids[place]) for place, floor in enumerate(floors)]


def _is_at(floor: Floor, height: float) -> bool:
    """Whether a floor that is known otherwise lies at the height of an end that was not seen."""
    return not floor.is_open and abs(floor.height - height) < ON_FLOOR


def _floor_of_end(floors: Sequence[Floor], height: float, *, is_open: bool, side: int) -> Floor:
    """The floor on which an end lies; for an open one, the first that the stairs come to if they go on."""
    nearest = min(floors, key=lambda floor: abs(floor.height - height))
    if not is_open or abs(nearest.height - height) < ON_FLOOR:
        return nearest
    ahead = [
        floor
        for floor in floors
        if may_be_floor_of(floor.height - height, side, ON_FLOOR) and not floor.is_open
    ]
    return min(ahead, key=lambda floor: abs(floor.height - height)) if ahead else nearest
