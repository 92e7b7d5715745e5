"""A mission of a simulated robot in a world, from start to end.

exploration = SimulatedExploration(mesh, load_body("spot"), seed=1)
outcome = exploration.run()
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from stairmap.exploration.body import Body
from stairmap.exploration.decision_log import DecisionLog
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.landings import classify_landings, free_area
from stairmap.exploration.mission import Mission
from stairmap.exploration.odometry import Planar
from stairmap.exploration.outcome import ExplorationOutcome
from stairmap.exploration.simulated_pilot import SimulatedPilot
from stairmap.exploration.simulated_robot import SimulatedRobot
from stairmap.exploration.start import check_start, find_start
from stairmap.exploration.world import World
from stairmap.simulation.odometry import PERFECT_ODOMETRY, OdometryModel
from stairmap.simulation.sensors import make_sensor
from stairmap.simulation.triangle_mesh import TriangleMesh

SENSOR = "kinect_v2"
"""The camera: time of flight, whose noise grows least with distance of those that are simulated."""

DRIVING_FACTOR = 0.5
"""Part of its resolution that is used while driving: a quarter of the rays, and of the time."""

MAX_DECISIONS = 5_000
"""A mission that decides more often does not come to an end by itself."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplorationOptions:
    """How to explore: strategy, seed, whether odometry is perfect, whether unknown stairs are tried."""

    strategy: str = "gain"
    seed: int = 0
    has_perfect_odometry: bool = False
    allow_unknown: bool = False


class SimulatedExploration:
    """A robot let loose in a mesh.

    Parameters
    ----------
    mesh
        The world.
    body
        The robot.
    start
        Where it begins; ``None``: found.
    options
        See ``ExplorationOptions``.

    Raises
    ------
    ConfigError
        If the robot cannot stand at the start.
    MissingPackageError
        If a package of the extra ``explore`` is not installed.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        body: Body,
        start: Planar | None = None,
        options: ExplorationOptions | None = None,
    ) -> None:
        options = ExplorationOptions() if options is None else options
        world = World(mesh)
        placed = find_start(world, body) if start is None else check_start(world, body, start)
        model = PERFECT_ODOMETRY if options.has_perfect_odometry else OdometryModel()
        sensor = make_sensor(SENSOR, factor=DRIVING_FACTOR)
        self.options = options
        self.robot = SimulatedRobot(world, body, sensor, placed, seed=options.seed, model=model)
        self.known = ExplorationMap(
            body,
            placed,
            allow_unknown=options.allow_unknown,
            has_perfect_odometry=options.has_perfect_odometry,
        )
        self.start = placed
        self.log = DecisionLog()
        self.mission = Mission(
            known=self.known,
            pilot=SimulatedPilot(self.robot, self.known, make_sensor(SENSOR)),
            clock=lambda: self.robot.counters.time_s,
            log=self.log,
            strategy=options.strategy,
        )

    def run(
        self, *, should_stop: Callable[[], bool] = lambda: False, on_tick: Callable[[], None] = lambda: None
    ) -> ExplorationOutcome:
        """Explore until nothing is left, or until told to stop; return what came of it."""
        while self.mission.tick():
            if should_stop():
                self.mission.interrupt()
            elif len(self.log.decisions) >= MAX_DECISIONS:
                self.mission.stop(f"more than {MAX_DECISIONS} decisions")
            on_tick()
        return self.outcome()

    def outcome(self) -> ExplorationOutcome:
        """Return what came of the mission so far."""
        known, counters = self.known, self.robot.counters
        known.refresh_stairs()
        classify_landings(known)
        levels = sorted(known.levels.levels, key=lambda level: level.height)
        return ExplorationOutcome(
            floors_reached=len(known.levels.floors),
            area_m2=known.area(),
            path_m=counters.path_m,
            time_s=counters.time_s,
            falls=counters.falls,
            collisions=counters.collisions,
            sensor_stops=counters.sensor_stops,
            stairs_climbed=self.mission.stairs_climbed,
            stopped=self.mission.stopped,
            coverage=tuple(self.mission.coverage),
            floors=tuple(
                {
                    "level": level.number,
                    "height": round(level.height, 3),
                    "area_m2": round(free_area(level), 2),
                    "is_landing": level.is_landing,
                }
                for level in levels
            ),
        )
