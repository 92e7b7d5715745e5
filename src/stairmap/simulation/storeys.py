"""Buildings of two to four floors for robots that explore: loops, wells, several stairways, one too steep.

Rooms have walls of some thickness with doors, floors are slabs with wells, and every stairway is built from
its shape, so that its truth is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from stairmap.simulation.flight_scenes import SceneMaker
from stairmap.simulation.rooms import make_railing
from stairmap.simulation.scene import Scene, make_approach_route
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import BuiltStairway, build_stairway
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block

Corners = tuple[float, float, float, float]
"""x0, y0, x1, y1 of a rectangle of the plan, m."""

WALL = 0.12
"""Thickness of a wall, m."""

SLAB = 0.20
"""Thickness of a floor, m."""

DOOR_HEIGHT = 2.1
STRAIGHT = FlightShape(rise=0.15, run=0.30, width=1.2, num_risers=18)
"""One flight from floor to floor: 2.70 m."""

HALF = FlightShape(rise=0.15, run=0.30, width=1.2, num_risers=9)
"""Two of them make a storey of 2.70 m."""

STEEP = FlightShape(rise=0.226, run=0.22, width=1.0, num_risers=12)
"""Too steep for the robots here; 2.71 m."""


def make_slab(corners: Corners, top: float, holes: Sequence[Corners] = ()) -> TriangleMesh:
    """Return a floor slab with rectangular wells, its top at a height, m."""
    x0, y0, x1, y1 = corners
    xs = sorted({x0, x1, *(x for hole in holes for x in (hole[0], hole[2]) if x0 < x < x1)})
    ys = sorted({y0, y1, *(y for hole in holes for y in (hole[1], hole[3]) if y0 < y < y1)})
    blocks = []
    for left, right in pairwise(xs):
        for low, high in pairwise(ys):
            middle = ((left + right) / 2, (low + high) / 2)
            if not any(h[0] < middle[0] < h[2] and h[1] < middle[1] < h[3] for h in holes):
                blocks.append(make_block([left, low, top - SLAB], [right, high, top]))
    return joined(blocks)


def make_partition(
    start: tuple[float, float],
    end: tuple[float, float],
    floor: float,
    height: float,
    doors: Sequence[tuple[float, float]] = (),
) -> TriangleMesh:
    """Return a wall along x or y with doors, each from one place to another along it, m."""
    axis = 0 if abs(end[0] - start[0]) > abs(end[1] - start[1]) else 1
    low, high = min(start[axis], end[axis]), max(start[axis], end[axis])
    across = start[1 - axis]
    marks = [low, *(mark for door in sorted(doors) for mark in door), high]

    def block(first: float, last: float, bottom: float, top: float) -> TriangleMesh:
        lower, upper = [0.0, 0.0, bottom], [0.0, 0.0, top]
        lower[axis], upper[axis] = first, last
        lower[1 - axis], upper[1 - axis] = across - WALL / 2, across + WALL / 2
        return make_block(lower, upper)

    parts = [
        block(first, last, floor, floor + height)
        for first, last in zip(marks[::2], marks[1::2], strict=True)
        if last - first > 1e-6
    ]
    parts += [block(first, last, floor + DOOR_HEIGHT, floor + height) for first, last in doors]
    return joined(parts)


def make_shell(corners: Corners, floor: float, height: float) -> TriangleMesh:
    """Return the four outer walls of a floor."""
    x0, y0, x1, y1 = corners
    return joined(
        [
            make_partition((x0, y0), (x1, y0), floor, height),
            make_partition((x0, y1), (x1, y1), floor, height),
            make_partition((x0, y0), (x0, y1), floor, height),
            make_partition((x1, y0), (x1, y1), floor, height),
        ]
    )


def make_two_floors(name: str, random: np.random.Generator) -> Scene:
    """Return a house of two floors: three rooms below, two above, a straight flight in the hall."""
    house: Corners = (0.0, 0.0, 10.0, 8.0)
    built = build_stairway(
        StairwayShape(flights=(STRAIGHT,)), base=(3.2, 1.0, 0.0), heading=0.0, stairway_id=1, random=random
    )
    top = built.top_z
    well: Corners = (3.9, 0.06, 8.3, 1.6)
    upper = top + 2.6
    parts = [
        built.mesh,
        make_slab(house, 0.0),
        make_slab(house, top, [well]),
        make_slab(house, upper + SLAB),
        make_shell(house, 0.0, top),
        make_shell(house, top, 2.6),
        make_partition((0.0, 4.0), (10.0, 4.0), 0.0, top - SLAB, [(1.2, 2.2), (7.0, 8.0)]),
        make_partition((5.0, 4.0), (5.0, 8.0), 0.0, top - SLAB, [(5.5, 6.5)]),
        make_partition((0.0, 4.0), (10.0, 4.0), top, 2.6, [(8.4, 9.4)]),
        make_railing((3.9, 1.65), (8.3, 1.65), top),
        make_railing((3.85, 0.1), (3.85, 1.65), top),
    ]
    return _scene(name, parts, [built])


def make_loop_house(name: str, random: np.random.Generator) -> Scene:
    """Return three floors about a core: a corridor that closes a loop, half-turn stairs in the core."""
    house: Corners = (0.0, 0.0, 12.0, 10.0)
    built: list[BuiltStairway] = []
    parts: list[TriangleMesh] = []
    shape = StairwayShape(flights=(HALF, replace(HALF, soffit=True)), turns=(180,), landing_length=1.3)
    storey = 18 * HALF.rise
    for index in range(2):
        built.append(
            build_stairway(
                shape, base=(4.0, 4.2, index * storey), heading=0.0, stairway_id=index + 1, random=random
            )
        )
    well: Corners = (4.0, 3.5, 7.9, 6.3)
    for index in range(3):
        floor = index * storey
        parts += [
            make_slab(house, floor, [well] if index else []),
            make_shell(house, floor, storey),
            # The core's walls, open to the west where the stairs begin and end.
            make_partition((4.0, 3.4), (8.0, 3.4), floor, storey - SLAB),
            make_partition((4.0, 6.4), (8.0, 6.4), floor, storey - SLAB),
            make_partition((8.0, 3.4), (8.0, 6.4), floor, storey - SLAB),
            # One room off the corridor.
            make_partition((9.8, 0.0), (9.8, 10.0), floor, storey - SLAB, [(4.4, 5.4)]),
        ]
    parts.append(make_railing((3.95, 3.5), (3.95, 4.85), 2 * storey))
    parts.append(make_slab(house, 3 * storey))
    return _scene(name, [*[b.mesh for b in built], *parts], built)


def make_two_stairways(name: str, random: np.random.Generator) -> Scene:
    """Return two floors with two stairways, of which one is too steep, and a third floor by a half turn."""
    house: Corners = (0.0, 0.0, 14.0, 9.0)
    steep = build_stairway(
        StairwayShape(flights=(STEEP,)), base=(3.0, 8.2, 0.0), heading=0.0, stairway_id=1, random=random
    )
    good = build_stairway(
        StairwayShape(flights=(STRAIGHT,)), base=(11.0, 0.9, 0.0), heading=np.pi, stairway_id=2, random=random
    )
    storey = good.top_z
    half = replace(HALF, rise=storey / 18)
    turned = build_stairway(
        StairwayShape(flights=(half, replace(half, soffit=True)), turns=(-180,), landing_length=1.3),
        base=(9.0, 8.2, storey), heading=0.0, stairway_id=3, random=random,
    )  # fmt: skip
    wells_1: list[Corners] = [(3.6, 7.6, 5.42, 8.94), (5.9, 0.06, 10.3, 1.55)]
    wells_2: list[Corners] = [(9.0, 6.1, 12.7, 8.94)]
    parts = [
        steep.mesh,
        good.mesh,
        turned.mesh,
        make_slab(house, 0.0),
        make_slab(house, storey, wells_1),
        make_slab(house, 2 * storey, wells_2),
        make_slab(house, 3 * storey),
        *[make_shell(house, index * storey, storey) for index in range(3)],
        make_partition((7.0, 1.7), (7.0, 9.0), 0.0, storey - SLAB, [(3.6, 4.7)]),
        make_partition((0.0, 3.0), (7.0, 3.0), storey, storey - SLAB, [(1.0, 2.0), (5.5, 6.6)]),
        make_partition((7.0, 0.0), (7.0, 6.0), 2 * storey, storey - SLAB, [(2.0, 3.0)]),
        make_railing((5.9, 1.6), (10.3, 1.6), storey),
        make_railing((10.35, 0.1), (10.35, 1.6), storey),
        make_railing((3.6, 7.55), (5.42, 7.55), storey),
        make_railing((3.55, 7.6), (3.55, 8.9), storey),
        make_railing((9.0, 6.05), (12.7, 6.05), 2 * storey),
        make_railing((8.95, 7.55), (8.95, 8.9), 2 * storey),
    ]
    return _scene(name, parts, [good, steep, turned])


def make_tower(name: str, random: np.random.Generator) -> Scene:
    """Return a tower of four floors, with the stairs in turn on either side."""
    house: Corners = (0.0, 0.0, 8.0, 7.0)
    storey = STRAIGHT.num_risers * STRAIGHT.rise
    built, parts = [], [make_slab(house, 0.0)]
    for index in range(3):
        y = 0.9 if index % 2 == 0 else 6.1
        built.append(
            build_stairway(
                StairwayShape(flights=(STRAIGHT,)), base=(1.6, y, index * storey), heading=0.0,
                stairway_id=index + 1, random=random,
            )
        )  # fmt: skip
        well: Corners = (2.2, 0.06, 6.7, 1.52) if index % 2 == 0 else (2.2, 5.48, 6.7, 6.94)
        edge = 1.57 if index % 2 == 0 else 5.43
        parts += [
            make_slab(house, (index + 1) * storey, [well]),
            make_railing((2.2, edge), (6.7, edge), (index + 1) * storey),
            make_railing((2.15, well[1] + 0.05), (2.15, well[3] - 0.05), (index + 1) * storey),
        ]
    parts += [make_shell(house, index * storey, storey) for index in range(4)]
    parts.append(make_slab(house, 4 * storey))
    return _scene(name, [*[b.mesh for b in built], *parts], built)


def _scene(name: str, parts: Sequence[TriangleMesh], built: Sequence[BuiltStairway]) -> Scene:
    stairways = tuple(b.stairway for b in built)
    return Scene(
        name=name,
        mesh=joined(parts),
        stairways=stairways,
        route=make_approach_route(stairways[0].flights[0], distance=2.2, lateral=0.2),
    )


STOREY_SCENES: dict[str, SceneMaker] = {
    "two_floors": make_two_floors,
    "loop_house": make_loop_house,
    "two_stairways": make_two_stairways,
    "tower": make_tower,
}
"""Scenes for robots that explore, by name."""
