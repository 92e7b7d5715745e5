"""What an exploring robot knows: levels from its own depth images, stairs from the map's node."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.exploration.body import Body
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.levels import Level
from stairmap.exploration.odometry import Planar
from stairmap.exploration.open_ground import STRIDE
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.stairway import Stairway
from stairmap_ros.map_results_in import MapResultsIn


class RobotMap(ExplorationMap):
    """An ``ExplorationMap`` whose stairways and forbidden places are those that Nav2 has too.

    Parameters
    ----------
    body, start, allow_unknown
        As of ``ExplorationMap``; poses come from a localiser and are taken as they are.
    results
        What the map's node says.
    """

    def __init__(self, body: Body, start: Planar, results: MapResultsIn, *, allow_unknown: bool) -> None:
        super().__init__(body, start, allow_unknown=allow_unknown)
        self._results = results
        self._num_changes = -1

    def find_stairways(self) -> tuple[Stairway, ...]:
        """Return the stairways of the map's node."""
        return self._results.stairways

    def refresh_stairs(self) -> None:
        """Bring the links up to date if the map's node found something since."""
        num_changes = self._results.num_changes
        self._stairs_are_stale |= num_changes != self._num_changes
        self._num_changes = num_changes
        super().refresh_stairs()

    def open_ground(self, level: Level, grid: OccupancyGrid) -> OccupancyGrid:
        """Return where the robot's middle can be: not in the keep-out mask, unless it was there before."""
        ground = super().open_ground(level, grid)
        mask = self._results.mask(level.height)
        if mask is None:
            return ground
        rows, columns = np.nonzero(ground.cells == FREE)
        index, inside = mask.cells_at(ground.centers(rows, columns))
        forbidden = np.zeros(len(rows), dtype=bool)
        forbidden[inside] = mask.cells[index[inside, 0], index[inside, 1]] == OCCUPIED
        forbidden &= ~level.map.trail[::STRIDE, ::STRIDE][rows, columns]
        cells = ground.cells.copy()
        cells[rows[forbidden], columns[forbidden]] = UNKNOWN
        return replace(ground, cells=cells)
