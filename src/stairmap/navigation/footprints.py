"""Where stairs are on the map of a floor: ground that wheels must never touch.

On the floor below it is the part of the stairway under which nobody can pass; on the floor above it is the
whole well, and a strip before each edge, which no depth camera sees as an obstacle. So it is on each floor
that the well cuts in passing, and before every other drop.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.drop import Drop
from stairmap.navigation.carried_stairs import carry_to_floors
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.occupancy import FREE, OCCUPIED, MapError, OccupancyGrid
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.traversability import assess
from stairmap.stairway import Flight, Stairway

HEADROOM = 2.0
"""Under stairs that are higher than this above a floor one can pass, m."""

EDGE_MARGIN = 0.30
"""Width of the strip before a descending edge, m: the way a robot rolls on after it saw its mistake."""

FOOT_MARGIN = 0.05
"""Width of the strip before the first riser, m."""

BEYOND_EDGE = 0.20
"""Width of the strip beyond an edge that is forbidden too, m: the edge is known to a few centimetres."""

PLACE_ERROR = 0.05
"""How far beyond its true place an edge may be modelled, m: stereo cameras fatten near ground by half a
window, and a cell of a mask counts by its middle. The strip before it is so much wider."""

MAX_DROP_OFFSET = 0.4
"""A drop is on a floor within this of its height, m."""

_BORDER = 1.0
"""Free border around the stairs of a mask that no map gives its extent, m."""

MAX_CELLS = 200_000_000
"""Most cells of such a mask: half a square kilometre of cells of 0.05 m."""


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


def stair_rectangles(
    stairway: Stairway,
    floors: FloorStack,
    level: int,
    *,
    drops: Sequence[Drop] = (),
    side_margin: float = 0.0,
) -> tuple[Rectangle, ...]:
    """Return what a stairway covers on a floor; nothing on a floor below or above it.

    Parameters
    ----------
    stairway, floors, level
        Which stairs on which floor.
    drops
        Edges of the ground; those of this stairway tell where its upper end is.
    side_margin
        Width of the strip beside the well on floors that it cuts, m.
    """
    lower, upper = floors.levels[stairway.id]
    if not lower <= level <= upper:
        return ()
    floor_height = floors.floor(level).height
    carried = carry_to_floors(stairway, floors, drops)
    flights = carried.stairway.flights
    side = 0.0 if level == lower else side_margin
    rectangles = []
    for flight in flights:
        covered = flight.num_risers
        if level == lower:
            covered = int((floor_height + HEADROOM - flight.base[2]) / flight.rise)
        foot = edge = 0.0
        if flight is flights[0]:
            # On a floor that the well cuts in passing, both ends of the hole are edges.
            foot = EDGE_MARGIN if level not in (lower, upper) else FOOT_MARGIN if level == lower else 0.0
            foot += carried.unknown_below if level == lower else 0.0
        if flight is flights[-1] and level != lower:
            edge = EDGE_MARGIN + carried.unknown_above
        if covered > 0:
            rectangles.append(_flight_rectangle(flight, min(covered, flight.num_risers), (foot, edge), side))
    for landing in stairway.landings:
        if level != lower or landing.center[2] < floor_height + HEADROOM:
            rectangles.append(
                Rectangle(
                    center=(float(landing.center[0]), float(landing.center[1])),
                    heading=landing.heading,
                    length=landing.size[0] + 2 * side,
                    width=landing.size[1] + 2 * side,
                )
            )
    return tuple(rectangles)


def drop_rectangles(drops: Iterable[Drop], floors: FloorStack, level: int) -> tuple[Rectangle, ...]:
    """Return the strips before the edges of a floor: from ``EDGE_MARGIN`` before each to a bit beyond."""
    height = floors.floor(level).height
    nearest = {drop.id: _level_of(drop, floors) for drop in drops}
    rectangles = []
    for drop in drops:
        if nearest[drop.id] != level or abs(float(drop.center[2]) - height) > MAX_DROP_OFFSET:
            continue
        before = EDGE_MARGIN + PLACE_ERROR
        middle = drop.center + 0.5 * (BEYOND_EDGE - before) * drop.outward
        rectangles.append(
            Rectangle(
                center=(float(middle[0]), float(middle[1])),
                heading=math.atan2(drop.outward[1], drop.outward[0]),
                length=before + BEYOND_EDGE,
                width=drop.length + 2 * EDGE_MARGIN,
            )
        )
    return tuple(rectangles)


def _level_of(drop: Drop, floors: FloorStack) -> int:
    return min(floors.floors, key=lambda floor: abs(floor.height - float(drop.center[2]))).level


def cover_mask(grid: OccupancyGrid, rectangles: Iterable[Rectangle]) -> Mask:
    """Return which cells of a grid have their centre in one of the rectangles."""
    cells = np.indices(grid.cells.shape).astype(np.int64)
    centers = grid.centers(cells[0], cells[1])
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    for rectangle in rectangles:
        mask |= rectangle.contains(centers)
    return mask


def block_stairs(
    grid: OccupancyGrid,
    stairways: Iterable[Stairway],
    floors: FloorStack,
    level: int,
    *,
    drops: Sequence[Drop] = (),
) -> OccupancyGrid:
    """Return a map of a floor on which the only way over stairs is their portal, and none over drops."""
    rectangles = [
        rectangle
        for stairway in stairways
        for rectangle in stair_rectangles(stairway, floors, level, drops=drops)
    ]
    rectangles += drop_rectangles(drops, floors, level)
    cells = np.where(cover_mask(grid, rectangles), OCCUPIED, grid.cells).astype(np.int8)
    return OccupancyGrid(cells=cells, resolution=grid.resolution, origin=grid.origin)


def make_keepout_mask(
    stairways: Sequence[Stairway],
    floors: FloorStack,
    level: int,
    *,
    drops: Sequence[Drop] = (),
    like: OccupancyGrid | None = None,
    resolution: float = 0.05,
) -> OccupancyGrid | None:
    """Return the ground of a floor that stairs and drops forbid: 100 there, 0 elsewhere.

    Parameters
    ----------
    stairways
        Those that are forbidden, such as all that a robot cannot climb.
    floors, level
        Which floor.
    drops
        Edges that are forbidden; see ``forbidden_ground``.
    like
        Map whose extent and resolution the mask takes; ``None``: around the stairs.
    resolution
        Size of a cell without ``like``, m.

    Returns
    -------
    The mask; ``None`` where nothing touches the floor and no map gives an extent.

    Raises
    ------
    MapError
        If it would have more than ``MAX_CELLS`` cells.
    """
    rectangles = [
        rectangle
        for stairway in stairways
        for rectangle in stair_rectangles(stairway, floors, level, drops=drops, side_margin=EDGE_MARGIN)
    ]
    rectangles += drop_rectangles(drops, floors, level)
    if like is None:
        if not rectangles:
            return None
        corners = np.concatenate([rectangle.corners() for rectangle in rectangles])
        low = np.floor((corners.min(axis=0) - _BORDER) / resolution) * resolution
        size = np.ceil((corners.max(axis=0) + _BORDER - low) / resolution).astype(int)
        if float(size[0]) * float(size[1]) > MAX_CELLS:
            wide, deep = size * resolution / 1000
            raise MapError(
                f"a keep-out mask of floor {level} would be {wide:.1f} x {deep:.1f} km large: its stairs and "
                "drops lie so far apart; export a part of the run, or look whether its poses jump"
            )
        like = OccupancyGrid(
            cells=np.zeros((size[1], size[0]), dtype=np.int8),
            resolution=resolution,
            origin=(float(low[0]), float(low[1])),
        )
    cells = np.where(cover_mask(like, rectangles), OCCUPIED, FREE)
    return OccupancyGrid(cells=cells.astype(np.int8), resolution=like.resolution, origin=like.origin)


def forbidden_ground(
    stairways: Sequence[Stairway], drops: Sequence[Drop], robot: RobotProfile | None
) -> tuple[tuple[Stairway, ...], tuple[Drop, ...]]:
    """Return the stairways that a robot cannot climb, and the drops but those of stairs that it can.

    ``None`` stands for any robot on wheels: all are forbidden.
    """
    if robot is None:
        return tuple(stairways), tuple(drops)
    passable = {stairway.id for stairway in stairways if assess(stairway, robot).verdict == "passable"}
    return (
        tuple(stairway for stairway in stairways if stairway.id not in passable),
        tuple(drop for drop in drops if drop.stairway_id not in passable),
    )


def _flight_rectangle(
    flight: Flight, num_risers: int, margins: tuple[float, float], side: float
) -> Rectangle:
    foot, edge = margins
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
        width=flight.width + 2 * side,
    )
