"""What a mission asks of the map of one level, and notes in it, whoever makes it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Mask, Points
from stairmap.navigation.occupancy import OccupancyGrid


class LevelMap(Protocol):
    """Free, occupied and unknown ground of a level. All arrays have the cells of ``grid``."""

    num_changes: int
    """Grows with each change."""

    def grid(self) -> OccupancyGrid:
        """Return the map; drops are occupied in it."""
        ...

    def opaque(self) -> Mask:
        """Return the (rows, columns) cells with obstacles that hide what is behind them."""
        ...

    def drops(self) -> Mask:
        """Return the (rows, columns) cells where the ground lies lower."""
        ...

    @property
    def settled(self) -> Mask:
        """(rows, columns) where looking again gives nothing."""
        ...

    @property
    def trail(self) -> Mask:
        """(rows, columns) where the robot's body was."""
        ...

    @property
    def tops(self) -> NDArray[np.float32]:
        """(rows, columns) height of the highest point on each cell above the level, m; 0 without one."""
        ...

    def settle(self, points: Points, radius: float) -> None:
        """Note that unknown ground about (N, 2) points was looked at from near and stayed unknown."""
        ...

    def block(self, points: Points) -> None:
        """Note that (N, 2) points stopped the robot, whatever was seen of them before."""
        ...

    def forgive(self) -> bool:
        """Forget what stopped the robot; return whether there was any."""
        ...
