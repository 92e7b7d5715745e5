"""Scenes without a stairway that have what stairways have: parallel edges, levels, slopes.

Bleachers (rise 0.40 m, run 0.75 m) count as no stairway: no stair code allows such a
rise, and no robot's profile climbs it as stairs. A kerb is one step, and one step is
no stairway either.
"""

from __future__ import annotations

import numpy as np

from stairmap.simulation.flight_scenes import SceneMaker
from stairmap.simulation.rooms import make_clutter, make_person, make_railing, make_room
from stairmap.simulation.scene import Route, Scene
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_cylinder,
    make_prism,
    make_turned_block,
)

_ROUTE = Route(
    waypoints=np.array([[-4.5, 0.7, 0.0], [-2.3, 0.2, 0.0], [-0.8, 0.0, 0.0]]),
    first_heading=0.4,
    last_heading=0.0,
)
"""Towards the origin, where the look-alike begins."""


def _bookshelf(random: np.random.Generator) -> list[TriangleMesh]:
    """Shelf of 2 m by 2.1 m with books of all sizes."""
    parts = [make_block([0.30, -1, 0], [0.31, 1, 2.1])]
    for y in (-1.0, 0.0, 0.98):
        parts.append(make_block([0, y, 0], [0.30, y + 0.02, 2.1]))
    for level in range(7):
        z = 0.05 + level * 0.33
        parts.append(make_block([0, -1, z], [0.30, 1, z + 0.02]))
        y = -0.95
        while y < 0.9 and level < 6:
            width = random.uniform(0.015, 0.06)
            if random.random() < 0.85:
                depth, height = random.uniform(0.03, 0.12), random.uniform(0.18, 0.30)
                parts.append(make_block([depth, y, z + 0.02], [0.30, y + width, z + 0.02 + height]))
            y += width + 0.001
    return parts


def _blinds(random: np.random.Generator) -> list[TriangleMesh]:
    """Window of 2 m with slats of 50 mm every 60 mm, turned by 35 deg."""
    parts = [make_block([0.3, -1.2, 0.0], [0.35, 1.2, 2.6])]
    for z in np.arange(0.7, 2.3, 0.06):
        profile = [(0.0, z), (0.041, z + 0.029), (0.041, z + 0.030), (0.0, z + 0.001)]
        parts.append(make_prism(profile, -1.0, 1.0))
    return parts


def _radiator(random: np.random.Generator) -> list[TriangleMesh]:
    """Ribbed radiator of 1.6 m by 0.9 m before a wall, ribs upright, with two level pipes."""
    parts = [make_block([0.25, -3, 0.0], [0.3, 3, 2.6])]
    for y in np.arange(-0.8, 0.8, 0.06):
        parts.append(make_block([0.05, y, 0.12], [0.18, y + 0.04, 1.02]))
    for z in (0.16, 0.98):
        parts.append(make_cylinder([0.12, -0.85, z], [0.12, 0.85, z], 0.02))
    return parts


def _pallets(random: np.random.Generator) -> list[TriangleMesh]:
    """Stacks of eight and of four pallets (1.2 m by 0.8 m by 0.144 m)."""
    parts = []
    for x, y, count in ((0.0, -0.6, 8), (0.1, 0.7, 4)):
        for level in range(count):
            shift = random.normal(0, 0.01, 2)
            parts += _pallet(x + shift[0], y + shift[1], level * 0.144)
    return parts


def _pallet(x: float, y: float, z: float) -> list[TriangleMesh]:
    parts = []
    for offset in np.linspace(0, 0.68, 5):
        parts.append(make_block([x + offset, y - 0.6, z + 0.122], [x + offset + 0.1, y + 0.6, z + 0.144]))
    for offset in (0.0, 0.34, 0.70):
        parts.append(make_block([x + offset, y - 0.6, z], [x + offset + 0.1, y + 0.6, z + 0.022]))
        for across in (-0.6, -0.07, 0.46):
            lower = [x + offset, y + across, z + 0.022]
            parts.append(make_block(lower, [x + offset + 0.1, y + across + 0.14, z + 0.122]))
    return parts


def _bleachers(random: np.random.Generator) -> list[TriangleMesh]:
    """Five rows of seating: rise 0.40 m, run 0.75 m, 5 m wide."""
    return [make_block([0.75 * row, -2.5, 0.0], [0.75 * (row + 1), 2.5, 0.4 * (row + 1)]) for row in range(5)]


def _railing(random: np.random.Generator) -> list[TriangleMesh]:
    """Railing of 4 m with five level rails."""
    return [make_railing((0.0, -2.0), (0.0, 2.0), 0.0, num_rails=5)]


def _ramp(random: np.random.Generator) -> list[TriangleMesh]:
    """Ramp of 12 deg and 1.2 m width, 5 m long, with kerbs."""
    top = 5 * np.tan(np.radians(12))
    parts = [make_prism([(0, 0), (5, 0), (5, top)], -0.6, 0.6)]
    for y in (-0.7, 0.6):
        parts.append(make_prism([(0, 0), (5, 0), (5, top + 0.1), (0, 0.1)], y, y + 0.1))
    return parts


def _stacked_boxes(random: np.random.Generator) -> list[TriangleMesh]:
    """Cartons stacked higher to the back, each of its own size and angle."""
    parts = []
    for row in range(3):
        y = -1.2
        while y < 1.2:
            width, z = random.uniform(0.35, 0.65), 0.0
            for _ in range(row + 1):
                height = random.uniform(0.25, 0.50)
                center = [0.25 + row * 0.55 + random.normal(0, 0.05), y + width / 2, z + height / 2]
                size = [random.uniform(0.35, 0.5), width - 0.03, height]
                parts.append(make_turned_block(center, size, random.normal(0, 0.12)))
                z += height
            y += width
    return parts


def _striped_floor(random: np.random.Generator) -> list[TriangleMesh]:
    """Flat floor with strips of 0.15 m every 0.30 m that stand up by 3 mm."""
    return [make_block([x, -1.5, 0.0], [x + 0.15, 1.5, 0.003]) for x in np.arange(-3.9, 2.5, 0.3)]


def _kerb(random: np.random.Generator) -> list[TriangleMesh]:
    """Kerb of 0.15 m with the pavement behind it."""
    return [make_block([0.0, -4, 0.0], [4.9, 4, 0.15])]


def _ladder(random: np.random.Generator) -> list[TriangleMesh]:
    """Ladder of 3 m leaning at 72 deg, rungs every 0.28 m."""
    angle = np.radians(72)
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    parts = [make_block([0.95, -3, 0], [1.0, 3, 2.8])]
    for y in (-0.22, 0.22):
        parts.append(make_cylinder([0, y, 0], [*(3 * along[:1]), y, 3 * along[2]], 0.03))
    for distance in np.arange(0.25, 2.95, 0.28):
        x, _, z = distance * along
        parts.append(make_cylinder([x, -0.22, z], [x, 0.22, z], 0.016, 8))
    return parts


def _empty_room(random: np.random.Generator) -> list[TriangleMesh]:
    """Nothing but floor, walls and ceiling."""
    return []


def _cluttered_room(random: np.random.Generator) -> list[TriangleMesh]:
    """Boxes, cylinders and two people."""
    clutter = make_clutter((-5.5, -3.5), (4.5, 3.5), 30, random, keep_clear=_ROUTE)
    return [clutter, make_person(0.6, 0.4), make_person(-1.5, -1.3)]


_OBJECTS = {
    "bookshelf": _bookshelf,
    "blinds": _blinds,
    "radiator": _radiator,
    "pallets": _pallets,
    "bleachers": _bleachers,
    "railing": _railing,
    "ramp": _ramp,
    "stacked_boxes": _stacked_boxes,
    "striped_floor": _striped_floor,
    "kerb": _kerb,
    "ladder": _ladder,
    "empty_room": _empty_room,
    "cluttered_room": _cluttered_room,
}


def make_look_alike(name: str, random: np.random.Generator) -> Scene:
    """Return a room 11 m by 8 m with one look-alike at the origin."""
    room = make_room((-6, -4), (5, 4))
    return Scene(name=name, mesh=joined([room, *_OBJECTS[name](random)]), route=_ROUTE)


def make_corridor(name: str, random: np.random.Generator) -> Scene:
    """Return an empty corridor 1.8 m wide with door frames every 1.5 m."""
    parts = [make_room((-6, -0.9), (9, 0.9), height=2.5)]
    for x in np.arange(-5.0, 8.5, 1.5):
        for y in (-0.9, 0.86):
            parts.append(make_block([x, y, 0.0], [x + 0.08, y + 0.04, 2.1]))
            parts.append(make_block([x + 0.9, y, 0.0], [x + 0.98, y + 0.04, 2.1]))
            parts.append(make_block([x, y, 2.02], [x + 0.98, y + 0.04, 2.1]))
    route = Route(waypoints=np.array([[-5.0, -0.2, 0.0], [-2.0, 0.1, 0.0], [1.0, 0.0, 0.0]]))
    return Scene(name=name, mesh=joined(parts), route=route)


LOOK_ALIKES: dict[str, SceneMaker] = {**dict.fromkeys(_OBJECTS, make_look_alike), "corridor": make_corridor}
"""Scene makers of this module by name."""
