"""What a mission knows of a building: levels with their maps, stairs, and where the robot is.

Where it comes from is another matter: ``exploration_map`` makes it of frames, a ROS 2 node of what others
map.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.exploration.body import Body
from stairmap.exploration.level_map import LevelMap
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.levels import Level, LevelBook
from stairmap.exploration.odometry import Planar
from stairmap.exploration.open_ground import find_open_ground
from stairmap.exploration.stair_links import StairBook
from stairmap.exploration.tasks import Task
from stairmap.navigation.occupancy import FREE, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner
from stairmap.stairway import Stairway

SAME_PLACE = 1.0
"""Sightings and looks nearer together than this are of the same place, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """Stairs that a single frame showed: (3,) place of their first or last nosing, heading up, rad."""

    level: int
    place: Float64Array
    heading: float
    view: str


class KnownBuilding(ABC):
    """Levels, stairs and the robot's place, as the behaviours of a mission ask for them.

    Parameters
    ----------
    body
        The robot.
    start
        Where it begins.
    make_map
        Gives the empty map of a level at a height, m.
    allow_unknown
        Whether stairs are also tried where nobody knows whether the robot can climb them.

    Attributes
    ----------
    body
        As given.
    pose
        Where the robot believes to be.
    levels, stairs
        What is known of them.
    level
        Where it stands; ``None`` on stairs, and before it entered the first.
    num_stair_changes
        Grows whenever the stairs change.
    half_view
        Half of the width of the camera's view, rad; 0 before it is known.
    """

    def __init__(
        self, body: Body, start: Planar, make_map: Callable[[float], LevelMap], *, allow_unknown: bool = False
    ) -> None:
        self.body, self.pose = body, start
        self.levels = LevelBook(make_map)
        self.stairs = StairBook(body.profile, allow_unknown=allow_unknown)
        self.level: Level | None = None
        self.num_stair_changes = 0
        self.half_view = 0.0
        self._stairs_are_stale = True
        self._searches: dict[int, tuple[tuple[object, ...], LevelSearch]] = {}
        self.tasks_elsewhere: dict[int, tuple[LevelSearch, list[Task]]] = {}
        self._looks: list[tuple[int, Float64Array]] = []

    @abstractmethod
    def find_stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways found so far."""

    @abstractmethod
    def sightings(self, level: int) -> list[Sighting]:
        """Return the places of a level where single frames showed stairs, one for each place."""

    def enter_level(self) -> tuple[Level, bool]:
        """Note that the robot stands on a level; return it, and whether it is new."""
        self.level, is_new = self.levels.enter(self.pose.z)
        self.stairs.refresh(self.levels)
        self.num_stair_changes += 1
        return self.level, is_new

    def leave_level(self) -> None:
        """Note that the robot is on stairs."""
        self.level = None

    def refresh_stairs(self) -> None:
        """Bring the links up to date if something showed stairs since."""
        if self._stairs_are_stale:
            self.stairs.update(self.find_stairways(), self.levels)
            self._stairs_are_stale = False
            self.num_stair_changes += 1

    def note_look(self, level: int, place: Float64Array) -> None:
        """Note that the robot looked for stairs at a (2,) place."""
        self._looks.append((level, np.asarray(place[:2])))

    def num_looks(self, level: int, place: Float64Array) -> int:
        """Return how often it looked there."""
        return sum(number == level and math.dist(place, other) < SAME_PLACE for number, other in self._looks)

    def was_faced(self, level: Level, place: Float64Array, heading: float) -> bool:
        """Tell whether a frame showed a (2,) place of a level from the front, as stairs are detected best.

        Parameters
        ----------
        level, place
            Where stairs may begin.
        heading
            In which they would go up, rad.
        """
        return False

    def search_elsewhere(self, level: Level, place: Float64Array) -> LevelSearch:
        """Return what ``search`` does for a level where the robot is not; it is kept until it changes."""
        links = tuple(
            link.fingerprint for link in self.stairs.links if level.number in (link.lower, link.upper)
        )
        key = (level.map.num_changes, links, tuple(np.round(place[:2], 1)))
        kept = self._searches.get(level.number)
        if kept is None or kept[0] != key:
            kept = (key, self.search(level, place))
            self._searches[level.number] = kept
        return kept[1]

    def search(self, level: Level, place: Float64Array | None = None) -> LevelSearch:
        """Return a level as a planner sees it, from a (2,) place or from the robot's own.

        Raises
        ------
        FloorError
            If the robot cannot be there.
        """
        grid = level.map.grid()
        open_ground = self.open_ground(level, grid)
        planner = FloorPlanner({level.number: open_ground}, (), self.body.profile)
        start = self.pose.place[:2] if place is None else place
        return LevelSearch(
            level=level.number,
            grid=grid,
            open_ground=open_ground,
            opaque=level.map.opaque(),
            planner=planner,
            found=planner.search(level.number, start),
        )

    def open_ground(self, level: Level, grid: OccupancyGrid) -> OccupancyGrid:
        """Return where the robot's middle can be on a level."""
        stairs = [
            link.footprint(level.number, level.height)
            for link in self.stairs.links
            if level.number in (link.lower, link.upper)
        ]
        return find_open_ground(grid, level.map.trail, self.body, stairs)

    def forgive_stops(self) -> bool:
        """Forget what stopped the robot on its levels; return whether there was any."""
        forgiven = [level.map.forgive() for level in self.levels.levels]
        return any(forgiven)

    def area(self) -> float:
        """Return the free ground mapped so far on all levels, m²."""
        grids = [level.map.grid() for level in self.levels.levels]
        return sum(float(np.count_nonzero(grid.cells == FREE)) * grid.resolution**2 for grid in grids)
