"""Ground that a robot must keep out of, as masks and on maps: stairs that it cannot climb, and edges."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Mask
from stairmap.drop import Drop
from stairmap.navigation.edge_pieces import drops_not_climbed
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.footprints import (
    EDGE_MARGIN,
    Rectangle,
    drop_rectangles,
    side_rectangles,
    stair_rectangles,
)
from stairmap.navigation.occupancy import OCCUPIED, UNKNOWN, MapError, OccupancyGrid
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.traversability import assess
from stairmap.stairway import Stairway

_BORDER = 1.0
"""Border around the stairs of a mask that no map gives its extent, m."""

MAX_CELLS = 200_000_000
"""Most cells of such a mask: half a square kilometre of cells of 0.05 m."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ForbiddenGround:
    """What a robot must keep out of.

    Attributes
    ----------
    stairways
        Stairs that it cannot climb: forbidden as a whole.
    drops
        Edges, but where stairs begin that it climbs.
    climbed
        Stairs that it climbs: only the sides of their wells are forbidden.
    """

    stairways: tuple[Stairway, ...] = ()
    drops: tuple[Drop, ...] = ()
    climbed: tuple[Stairway, ...] = ()


def make_keepout_mask(
    ground: ForbiddenGround,
    floors: FloorStack,
    level: int,
    *,
    like: OccupancyGrid | None = None,
    resolution: float = 0.05,
) -> OccupancyGrid | None:
    """Return the ground of a floor that stairs and drops forbid: 100 there, -1 elsewhere.

    Nowhere does a mask say 0: Nav2's keep-out filter writes that over unknown ground of a costmap, which then
    is free. Cells of -1 it leaves as they are.

    Parameters
    ----------
    ground
        What is forbidden; see ``forbidden_ground``.
    floors, level
        Which floor.
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
        for stairway in ground.stairways
        for rectangle in stair_rectangles(
            stairway, floors, level, drops=ground.drops, side_margin=EDGE_MARGIN
        )
    ]
    rectangles += drop_rectangles(ground.drops, floors, level)
    beside: list[Rectangle] = []
    ways: list[Rectangle] = []
    for stairway in ground.climbed:
        sides, way = side_rectangles(stairway, floors, level)
        beside += sides
        ways += way
    if like is None:
        if not rectangles and not beside:
            return None
        like = _grid_around([*rectangles, *beside], level, resolution)
    is_forbidden = cover_mask(like, rectangles)
    if beside:
        is_forbidden |= cover_mask(like, beside) & ~cover_mask(like, ways)
    cells = np.where(is_forbidden, OCCUPIED, UNKNOWN)
    return OccupancyGrid(cells=cells.astype(np.int8), resolution=like.resolution, origin=like.origin)


def _grid_around(rectangles: Sequence[Rectangle], level: int, resolution: float) -> OccupancyGrid:
    """A grid around rectangles on a floor."""
    corners = np.concatenate([rectangle.corners() for rectangle in rectangles])
    low = np.floor((corners.min(axis=0) - _BORDER) / resolution) * resolution
    size = np.ceil((corners.max(axis=0) + _BORDER - low) / resolution).astype(int)
    if float(size[0]) * float(size[1]) > MAX_CELLS:
        wide, deep = size * resolution / 1000
        raise MapError(
            f"a keep-out mask of floor {level} would be {wide:.1f} x {deep:.1f} km large: its stairs and "
            "drops lie so far apart; export a part of the run, or look whether its poses jump"
        )
    return OccupancyGrid(
        cells=np.zeros((size[1], size[0]), dtype=np.int8),
        resolution=resolution,
        origin=(float(low[0]), float(low[1])),
    )


def forbidden_ground(
    stairways: Sequence[Stairway], drops: Sequence[Drop], robot: RobotProfile | None
) -> ForbiddenGround:
    """Return what a robot must keep out of; ``None`` stands for any robot on wheels, which climbs nothing."""
    if robot is None:
        return ForbiddenGround(stairways=tuple(stairways), drops=tuple(drops))
    climbed = {stairway.id for stairway in stairways if assess(stairway, robot).verdict == "passable"}
    return ForbiddenGround(
        stairways=tuple(stairway for stairway in stairways if stairway.id not in climbed),
        drops=drops_not_climbed(drops, [stairway for stairway in stairways if stairway.id in climbed]),
        climbed=tuple(stairway for stairway in stairways if stairway.id in climbed),
    )
