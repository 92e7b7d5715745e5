"""All that an exploring robot knows: levels with their maps, stairs, and where it believes to be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Points, Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.exploration.body import Body
from stairmap.exploration.layer_map import RESOLUTION
from stairmap.exploration.levels import Level, LevelBook
from stairmap.exploration.localizer import Localizer, Placed, ScanStore
from stairmap.exploration.odometry import Planar
from stairmap.exploration.open_ground import find_open_ground
from stairmap.exploration.scans import Scan, scan_from_view
from stairmap.exploration.simulated_robot import View
from stairmap.exploration.stair_links import StairBook
from stairmap.navigation.occupancy import FREE, OccupancyGrid
from stairmap.navigation.planner import FloorPlanner, SearchResult
from stairmap.session import MapSession
from stairmap.transforms import rotation_from_vector, transform_from_parts


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelSearch:
    """A level as a planner sees it from where the robot is.

    Attributes
    ----------
    level
        Its number.
    grid
        Its map.
    open_ground
        Where the robot's middle can be.
    planner, found
        The planner of this level and its search from the robot's place.
    """

    level: int
    grid: OccupancyGrid
    open_ground: OccupancyGrid
    planner: FloorPlanner
    found: SearchResult

    @property
    def costs(self) -> Float64Array:
        """Cost to each cell of the open ground, s; infinite where there is no way."""
        numbers = self.planner.graph.nodes[self.level]
        costs = np.full(numbers.shape, np.inf)
        costs[numbers >= 0] = self.found.costs[numbers[numbers >= 0]]
        return costs

    def way_to(self, place: Float64Array) -> Points | None:
        """Return the (N, 2) way to a place on open ground, m; ``None`` without one."""
        from stairmap.navigation.planning_graph import nearest_node  # noqa: PLC0415

        node = nearest_node(self.open_ground, self.planner.graph.nodes[self.level], place)
        if node is None:
            return None
        route = self.planner.route_to(self.found, node)
        return shortened(route.legs[0].points[:, :2], self.open_ground) if route else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """When a frame was taken, where by odometry, and on which level (``None``: on stairs)."""

    stamp_ns: int
    odometry: Planar
    level: int | None


SAME_PLACE = 1.0
"""Sightings and looks nearer together than this are of the same place, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """Stairs that a single frame showed: (3,) place of their first or last nosing, heading up, rad."""

    level: int
    place: Float64Array
    heading: float
    view: str


class ExplorationMap:
    """Takes in what the robot sees; knows levels, stairs and the robot's place.

    Parameters
    ----------
    body
        The robot.
    start
        Where it begins.
    config
        Of the stair detector and modeler.
    allow_unknown
        Whether stairs are also tried where nobody knows whether the robot can climb them.
    has_perfect_odometry
        Whether the poses of odometry need no correction.
    """

    def __init__(
        self,
        body: Body,
        start: Planar,
        config: Config | None = None,
        *,
        allow_unknown: bool = False,
        has_perfect_odometry: bool = True,
    ) -> None:
        self.body, self.pose = body, start
        self.session = MapSession(config)
        self.levels = LevelBook()
        self.stairs = StairBook(body.profile, allow_unknown=allow_unknown)
        self.localizer = Localizer(start, is_perfect=has_perfect_odometry)
        self._scans = ScanStore()
        self.records: list[Record] = []
        self.poses: list[Planar] = []
        self.last_scan: Scan | None = None
        self.last_detection: Detection | None = None
        self.level: Level | None = None
        self.on_frame: Callable[[View, Transform, Detection], None] = lambda *_: None
        self._is_stale = True
        self.num_detections = 0
        self._searches: dict[int, tuple[tuple[int, int, tuple[float, ...]], LevelSearch]] = {}
        self.num_stair_changes = 0
        self._sightings: list[Sighting] = []
        self._looks: list[tuple[int, Float64Array]] = []

    def believed(self, odometry: Planar) -> Planar:
        """Return where the robot is in the map when odometry says where it is."""
        return self.localizer.predict(odometry)

    def believe(self, odometry: Planar) -> None:
        """Move the robot to where odometry says that it is."""
        self.pose = self.believed(odometry)

    def take(self, view: View) -> None:
        """Take in a frame of the robot where it is now, on its level or, without one, on stairs."""
        scan = scan_from_view(view, top=self.body.top + 0.1)
        self.pose = self.localizer.correct(scan, view.odometry, self._scans)
        self._scans.add(Placed(scan=scan, pose=self.pose))
        map_from_camera = map_from_body(self.pose) @ view.body_from_camera
        self.last_detection = self.session.add(view.frame, map_from_camera)
        self.num_detections += bool(self.last_detection)
        self._is_stale |= bool(self.last_detection)
        self.last_scan = scan
        number = None if self.level is None else self.level.number
        self.records.append(Record(stamp_ns=scan.stamp_ns, odometry=view.odometry, level=number))
        self.poses.append(self.pose)
        self._note_sightings(map_from_camera)
        self.on_frame(view, map_from_camera, self.last_detection)
        if self.level is not None:
            self.level.map.add(scan, self.pose, radius=self.body.radius)

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
        """Bring the links up to date if frames showed stairs since."""
        if self._is_stale:
            self.stairs.update(self.session.stairways(), self.levels)
            self._is_stale = False
            self.num_stair_changes += 1

    def sightings(self, level: int) -> list[Sighting]:
        """Return the places of a level where single frames showed stairs, one for each place."""
        found: list[Sighting] = []
        for sighting in self._sightings:
            if sighting.level == level and not any(
                math.dist(sighting.place[:2], other.place[:2]) < SAME_PLACE for other in found
            ):
                found.append(sighting)
        return found

    def note_look(self, level: int, place: Float64Array) -> None:
        """Note that the robot looked for stairs at a (2,) place."""
        self._looks.append((level, np.asarray(place[:2])))

    def num_looks(self, level: int, place: Float64Array) -> int:
        """Return how often it looked there."""
        return sum(number == level and math.dist(place, other) < SAME_PLACE for number, other in self._looks)

    def _note_sightings(self, map_from_camera: Transform) -> None:
        if self.level is None or self.last_detection is None:
            return
        for observation in self.last_detection.observations:
            edge = observation.edges[0 if observation.view == "ascending" else -1].nosing.mean(axis=0)
            forward = map_from_camera[:3, :3] @ observation.forward
            self._sightings.append(
                Sighting(
                    level=self.level.number,
                    place=map_from_camera[:3, :3] @ edge + map_from_camera[:3, 3],
                    heading=math.atan2(forward[1], forward[0]),
                    view=observation.view,
                )
            )

    def search_elsewhere(self, level: Level, place: Float64Array) -> LevelSearch:
        """Return what ``search`` does for a level where the robot is not; it is kept until it changes."""
        key = (level.map.num_changes, self.num_stair_changes, tuple(np.round(place[:2], 1)))
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

    def area(self) -> float:
        """Return the free ground mapped so far on all levels, m²."""
        return sum(
            float(np.count_nonzero(level.map.grid().cells == FREE)) * RESOLUTION**2
            for level in self.levels.levels
        )


def map_from_body(pose: Planar) -> Transform:
    """Return (4, 4) the level body frame of a robot in the map."""
    return transform_from_parts(rotation_from_vector([0.0, 0.0, pose.heading]), pose.place)


def shortened(points: Points, open_ground: OccupancyGrid) -> Points:
    """Leave out points of a way between which a straight line stays on open ground."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        ahead = len(points) - 1
        while ahead > kept[-1] + 1 and not _is_line_open(points[kept[-1]], points[ahead], open_ground):
            # Halving finds a far one quickly; the way is made again every few metres anyhow.
            ahead = kept[-1] + 1 + (ahead - kept[-1] - 1) // 2
        kept.append(ahead)
    return points[kept]


def _is_line_open(start: Float64Array, end: Float64Array, open_ground: OccupancyGrid) -> bool:
    length = math.dist(start, end)
    num = max(math.ceil(2 * length / open_ground.resolution), 1)
    line = start + np.linspace(0.0, 1.0, num + 1)[:, None] * (end - start)
    index, inside = open_ground.cells_at(line)
    if not inside.all():
        return False
    return bool((open_ground.cells[index[:, 0], index[:, 1]] == FREE).all())
