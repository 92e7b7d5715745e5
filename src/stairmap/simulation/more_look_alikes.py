"""More scenes without a stairway: shelves, benches, chairs, curtains, terraces and tiles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from stairmap.simulation.flight_scenes import SceneMaker
from stairmap.simulation.rooms import make_room
from stairmap.simulation.scene import Route, Scene
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_cylinder,
    make_prism,
    make_rectangle,
    make_wall,
)

_ROUTE = Route(
    waypoints=np.array([[-4.5, 0.7, 0.0], [-2.3, 0.2, 0.0], [-0.8, 0.0, 0.0]]),
    first_heading=0.4,
    last_heading=0.0,
)
"""Towards the origin, where the look-alike begins."""


def _slatted_benches(random: np.random.Generator) -> list[TriangleMesh]:
    """Two park benches one behind the other: seats and leaning backs of slats."""
    parts = []
    for x in (0.0, 1.1):
        for number in range(5):
            front = x + 0.09 * number
            parts.append(make_block([front, -0.9, 0.43], [front + 0.07, 0.9, 0.46]))
        for number in range(4):
            back, low = x + 0.47 + 0.03 * number, 0.52 + 0.11 * number
            parts.append(make_block([back, -0.9, low], [back + 0.03, 0.9, low + 0.08]))
        for y in (-0.75, 0.70):
            parts.append(make_block([x + 0.03, y, 0.0], [x + 0.08, y + 0.05, 0.43]))
            parts.append(make_block([x + 0.42, y, 0.0], [x + 0.47, y + 0.05, 0.43]))
    return parts


def _empty_shelves(random: np.random.Generator) -> list[TriangleMesh]:
    """Open rack of 2.4 m by 2 m with six boards, each as deep as the others, and a back."""
    parts = [make_block([0.45, -1.2, 0.0], [0.46, 1.2, 2.0])]
    for z in np.linspace(0.08, 1.96, 7):
        parts.append(make_block([0.0, -1.2, z], [0.45, 1.2, z + 0.025]))
    for y in (-1.2, -0.4, 0.36, 1.16):
        parts.append(make_block([0.0, y, 0.0], [0.04, y + 0.04, 2.0]))
    return parts


def _box_terraces(random: np.random.Generator) -> list[TriangleMesh]:
    """Rows of boxes, each 0.30 to 0.40 m higher and 0.45 to 0.7 m deeper: too high for stairs."""
    parts, x, z = [], 0.0, 0.0
    for _ in range(4):
        z += random.uniform(0.30, 0.40)
        depth = random.uniform(0.45, 0.70)
        for y in np.arange(-1.5, 1.4, 0.5):
            parts.append(make_block([x + random.uniform(0, 0.02), y, 0.0], [x + depth, y + 0.48, z]))
        x += depth
    return parts


def _curtains(random: np.random.Generator) -> list[TriangleMesh]:
    """Curtain of 4 m by 2.5 m with upright folds of 0.15 m."""
    y = np.arange(-2.0, 2.0, 0.02)
    x = 0.06 * np.sin(2 * np.pi * y / 0.15 + 0.6 * np.sin(3 * y)) * (1 + 0.2 * np.sin(1.7 * y))
    points = np.stack([x, y], axis=1)
    return [make_wall(a, b, 0.03, 2.5) for a, b in pairwise(points)]


def _stacked_chairs(random: np.random.Generator) -> list[TriangleMesh]:
    """Three stacks of chairs, each chair 0.10 m above and 0.04 m before the one below it."""
    parts = []
    for y, count in ((-0.7, 6), (0.0, 4), (0.7, 5)):
        for number in range(count):
            x, z = 0.3 - 0.04 * number, 0.42 + 0.10 * number
            parts.append(make_block([x, y - 0.22, z], [x + 0.42, y + 0.22, z + 0.02]))
            back = [(x + 0.40, z), (x + 0.42, z), (x + 0.50, z + 0.40), (x + 0.48, z + 0.40)]
            parts.append(make_prism(back, y - 0.20, y + 0.20))
            for dx in (0.02, 0.40):
                for dy in (-0.20, 0.20):
                    foot = [x + dx, y + dy, z - 0.42]
                    parts.append(make_cylinder(foot, [x + dx, y + dy, z], 0.011, 6))
    return parts


def _shelves_with_boxes(random: np.random.Generator) -> list[TriangleMesh]:
    """Rack of four boards with boxes that stand back by different depths."""
    parts = [make_block([0.6, -1.2, 0.0], [0.61, 1.2, 2.0])]
    for z in (0.10, 0.58, 1.06, 1.54):
        parts.append(make_block([0.0, -1.2, z], [0.6, 1.2, z + 0.03]))
        y = -1.15
        while y < 0.9:
            width, height = random.uniform(0.2, 0.4), random.uniform(0.15, 0.4)
            front = random.uniform(0.02, 0.25)
            parts.append(make_block([front, y, z + 0.03], [0.6, y + width, z + 0.03 + height]))
            y += width + random.uniform(0.01, 0.08)
    return parts


def _double_kerb(random: np.random.Generator) -> list[TriangleMesh]:
    """Road, cycle track and pavement: two kerbs of 0.08 m, 1.5 m apart."""
    return [make_block([0.0, -4, 0.0], [4.9, 4, 0.08]), make_block([1.5, -4, 0.08], [4.9, 4, 0.16])]


_OBJECTS = {
    "slatted_benches": _slatted_benches,
    "empty_shelves": _empty_shelves,
    "box_terraces": _box_terraces,
    "curtains": _curtains,
    "stacked_chairs": _stacked_chairs,
    "shelves_with_boxes": _shelves_with_boxes,
    "double_kerb": _double_kerb,
}


def make_other_look_alike(name: str, random: np.random.Generator) -> Scene:
    """Return a room 11 m by 8 m with one look-alike at the origin."""
    return Scene(name=name, mesh=joined([make_room((-6, -4), (5, 4)), *_OBJECTS[name](random)]), route=_ROUTE)


def make_tiled_floor(name: str, random: np.random.Generator) -> Scene:
    """Return a hall 24 m long whose tiles of 0.3 m stand up to 2 mm too high, with joints 3 mm deep."""
    parts = [make_rectangle((-7, -6), (17, 6), -0.003)]
    parts.append(make_room((-7, -6), (17, 6), floor=-0.003, height=4.0, has_floor=False))
    for x in np.arange(-7.0, 17.0, 0.3):
        for y in np.arange(-6.0, 6.0, 0.3):
            lift = random.uniform(-0.001, 0.002)
            parts.append(make_rectangle((x, y), (x + 0.294, y + 0.294), lift))
    return Scene(name=name, mesh=joined(parts), route=_ROUTE)


MORE_LOOK_ALIKES: dict[str, SceneMaker] = {
    **dict.fromkeys(_OBJECTS, make_other_look_alike),
    "tiled_floor": make_tiled_floor,
}
"""Scene makers of this module by name."""
