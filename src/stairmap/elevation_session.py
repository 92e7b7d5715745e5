"""Map stairways from a robot's elevation maps as they come in.

    session = ElevationSession()
    for grid in recording:
        session.add(grid)
    session.finish()
    print(session.stairways())

An elevation map holds what was measured since the robot set out. So one that was made half a step further on
says nearly nothing new: a map is looked at when the robot has moved by half a metre, and the last one always.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import Transform
from stairmap.clouds.detector import detect_points
from stairmap.config import Config
from stairmap.detection.observation import Detection, StairObservation
from stairmap.height_grid import HeightGrid
from stairmap.modeling.single_views import stairways_from_observations
from stairmap.session import MapSession
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory
from stairmap.transforms import invert_transform, transform_points

MIN_MOVE = 0.5
"""The middle of a map must have moved by this, m, for the map to be looked at."""

HEIGHT_NOISE = 0.01
"""Standard deviation of a cell's height, m, after the filters that elevation maps go through."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenGrid:
    """A grid that was looked at: its stamp and the pose of its middle, which its observations are relative
    to."""

    stamp_ns: int
    map_from_sensor: Transform


@dataclass(frozen=True, slots=True, kw_only=True)
class GridResult:
    """A grid and what was found in it."""

    window: SeenGrid
    detection: Detection


class ElevationSession:
    """Detects stairs in elevation maps and models them in one map.

    Fewer maps than confirm a stairway are taken as finished maps: each says all that is known.

    Parameters
    ----------
    config
        Configuration of all stages; the default one if not given.

    Attributes
    ----------
    map_session
        The map: its poses are those of the middles of grids.
    num_sweeps, num_without_pose, num_windows
        How many grids came in, 0, and how many were looked at.
    """

    def __init__(self, config: Config | None = None) -> None:
        self.config = Config() if config is None else config
        self.map_session = MapSession(self.config)
        self.num_sweeps = self.num_without_pose = self.num_windows = 0
        self._last: HeightGrid | None = None
        self._looked_at: Transform | None = None
        self._in_map: list[StairObservation] = []

    def add(self, grid: HeightGrid, trajectory: Trajectory | None = None) -> GridResult | None:
        """Take in a grid, newer than those before it; return what was found if it was looked at.

        Raises
        ------
        MapFullError
            See ``MapSession.add``.
        """
        del trajectory
        self.num_sweeps += 1
        self._last = grid
        middle = grid.map_from_middle
        if self._looked_at is not None and _distance(middle, self._looked_at) < MIN_MOVE:
            return None
        return self._look_at(grid)

    def finish(self) -> GridResult | None:
        """Look at the last grid, if it was not looked at."""
        return None if self._last is None else self._look_at(self._last)

    def stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways found so far, by id."""
        if self.num_windows >= self.config.modeling.min_observations:
            return self.map_session.stairways()
        return stairways_from_observations(self._in_map)

    def _look_at(self, grid: HeightGrid) -> GridResult:
        self._last, self._looked_at = None, grid.map_from_middle
        middle_from_map = invert_transform(grid.map_from_middle)
        noise = float(np.hypot(HEIGHT_NOISE, grid.resolution / np.sqrt(12)))
        points = transform_points(middle_from_map, grid.points())
        up = middle_from_map[:3, 2]
        detection = detect_points(points, up=up, noise=noise, config=self.config, stamp_ns=grid.stamp_ns)
        told = tuple(_with_cells(item, grid.resolution) for item in detection.observations)
        detection = replace(detection, observations=told)
        self.map_session.take_points(detection, grid.map_from_middle)
        self.num_windows += 1
        self._in_map = [_moved(item, grid.map_from_middle) for item in detection.observations]
        window = SeenGrid(stamp_ns=grid.stamp_ns, map_from_sensor=grid.map_from_middle)
        return GridResult(window=window, detection=detection)


def _with_cells(observation: StairObservation, resolution: float) -> StairObservation:
    """The observation, as uncertain along the stairs as risers are that stand anywhere within a cell.

    Each is off by up to half a cell, evenly, and their line's step by what that leaves of it: with n of them
    1, 2, ... n, the sum of squares about their middle is n (n² - 1) / 12.
    """
    num = max(observation.num_steps, 2)
    covariance = observation.covariance.copy()
    covariance[1, 1] += resolution**2 / (num * (num**2 - 1))
    covariance[2, 2] += resolution**2 / 12
    return replace(observation, covariance=covariance)


def _distance(one: Transform, other: Transform) -> float:
    return float(np.linalg.norm((one - other)[:2, 3]))


def _moved(observation: StairObservation, map_from_middle: Transform) -> StairObservation:
    """The observation in the map."""
    turn = map_from_middle[:3, :3]
    return replace(
        observation,
        up=turn @ observation.up,
        forward=turn @ observation.forward,
        origin=transform_points(map_from_middle, observation.origin),
        edges=tuple(
            replace(edge, nosing=transform_points(map_from_middle, edge.nosing)) for edge in observation.edges
        ),
        points=transform_points(map_from_middle, observation.points),
    )
