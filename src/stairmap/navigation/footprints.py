"""Where stairs are on the map of a floor: ground that wheels must never touch.

On the floor below it is the part of the stairway under which nobody can pass; on the floor above it is the
whole well, and a strip before the descending edge, which no depth camera sees as an obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.occupancy import FREE, OCCUPIED, OccupancyGrid
from stairmap.stairway import Flight, Stairway

HEADROOM = 2.0
"""Under stairs that are higher than this above a floor one can pass, m."""

EDGE_MARGIN = 0.30
"""Width of the strip before a descending edge, m: the way a robot rolls on after it saw its mistake."""

FOOT_MARGIN = 0.05
"""Width of the strip before the first riser, m."""

OPEN_MARGIN = 1.2
"""Width of the strip beyond an end of stairs that nobody saw, m, where they may go on: four treads."""

_BORDER = 1.0
"""Free border around the stairs of a mask that no map gives its extent, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectangle:
    """A level rectangle: (x, y) of its centre, m, map, direction of its length, rad, and its size, m."""

    center: tuple[float, float]
    heading: float
    length: float
    width: float

    def contains(self, points: Float64Array) -> Mask:
        """Tell which of (..., 2) points lie in it."""
        offset = points - np.array(self.center)
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        along = offset[..., 0] * cosine + offset[..., 1] * sine
        across = offset[..., 1] * cosine - offset[..., 0] * sine
        return np.asarray((np.abs(along) <= self.length / 2) & (np.abs(across) <= self.width / 2))

    def corners(self) -> Float64Array:
        """Return its (4, 2) corners, counter-clockwise."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [self.length / 2, self.width / 2]
        return np.asarray(local @ np.array([[cosine, sine], [-sine, cosine]]) + np.array(self.center))


def stair_rectangles(stairway: Stairway, floors: FloorStack, level: int) -> tuple[Rectangle, ...]:
    """Return what a stairway covers on a floor; nothing on a floor that it does not end on."""
    lower, upper = floors.levels[stairway.id]
    if level not in (lower, upper):
        return ()
    floor_height = floors.floor(level).height
    rectangles = []
    for flight in stairway.flights:
        covered = flight.num_risers
        if level == lower:
            covered = int((floor_height + HEADROOM - flight.base[2]) / flight.rise)
        foot = FOOT_MARGIN if level == lower and flight is stairway.flights[0] else 0.0
        edge = EDGE_MARGIN if level == upper and flight is stairway.flights[-1] else 0.0
        if foot and floors.has_open_end(stairway.id, upper=False):
            foot += OPEN_MARGIN
        if edge and floors.has_open_end(stairway.id, upper=True):
            edge += OPEN_MARGIN
        if covered > 0:
            rectangles.append(_flight_rectangle(flight, min(covered, flight.num_risers), foot, edge))
    for landing in stairway.landings:
        if level == upper or landing.center[2] < floor_height + HEADROOM:
            rectangles.append(
                Rectangle(
                    center=(float(landing.center[0]), float(landing.center[1])),
                    heading=landing.heading,
                    length=landing.size[0],
                    width=landing.size[1],
                )
            )
    return tuple(rectangles)


def cover_mask(grid: OccupancyGrid, rectangles: Iterable[Rectangle]) -> Mask:
    """Return which cells of a grid have their centre in one of the rectangles."""
    cells = np.indices(grid.cells.shape).astype(np.int64)
    centers = grid.centers(cells[0], cells[1])
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    for rectangle in rectangles:
        mask |= rectangle.contains(centers)
    return mask


def block_stairs(
    grid: OccupancyGrid, stairways: Iterable[Stairway], floors: FloorStack, level: int
) -> OccupancyGrid:
    """Return a map of a floor on which the only way over stairs is their portal."""
    rectangles = [
        rectangle for stairway in stairways for rectangle in stair_rectangles(stairway, floors, level)
    ]
    cells = np.where(cover_mask(grid, rectangles), OCCUPIED, grid.cells).astype(np.int8)
    return OccupancyGrid(cells=cells, resolution=grid.resolution, origin=grid.origin)


def make_keepout_mask(
    stairways: Sequence[Stairway],
    floors: FloorStack,
    level: int,
    *,
    like: OccupancyGrid | None = None,
    resolution: float = 0.05,
) -> OccupancyGrid | None:
    """Return the ground of a floor that stairs forbid: 100 there, 0 elsewhere.

    Parameters
    ----------
    stairways
        Those that are forbidden, such as all that a robot cannot climb.
    floors, level
        Which floor.
    like
        Map whose extent and resolution the mask takes; ``None``: around the stairs.
    resolution
        Size of a cell without ``like``, m.

    Returns
    -------
    The mask; ``None`` where no stairway touches the floor and no map gives an extent.
    """
    rectangles = [
        rectangle for stairway in stairways for rectangle in stair_rectangles(stairway, floors, level)
    ]
    if like is None:
        if not rectangles:
            return None
        corners = np.concatenate([rectangle.corners() for rectangle in rectangles])
        low = np.floor((corners.min(axis=0) - _BORDER) / resolution) * resolution
        size = np.ceil((corners.max(axis=0) + _BORDER - low) / resolution).astype(int)
        like = OccupancyGrid(
            cells=np.zeros((size[1], size[0]), dtype=np.int8),
            resolution=resolution,
            origin=(float(low[0]), float(low[1])),
        )
    cells = np.where(cover_mask(like, rectangles), OCCUPIED, FREE)
    return OccupancyGrid(cells=cells.astype(np.int8), resolution=like.resolution, origin=like.origin)


def _flight_rectangle(flight: Flight, num_risers: int, foot: float, edge: float) -> Rectangle:
    begin = -foot
    # The tread of the last riser that counts belongs to the stairs, unless that is the floor itself.
    end = (num_risers - 1) * flight.run + edge
    if num_risers < flight.num_risers:
        end += flight.run
    middle = flight.base + flight.forward * (begin + end) / 2
    return Rectangle(
        center=(float(middle[0]), float(middle[1])),
        heading=flight.heading,
        length=end - begin,
        width=flight.width,
    )
