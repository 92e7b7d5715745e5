"""Grounds that end: stairs that lead down, docks, wells, voids; and that do not: ramps, kerbs, a plain hall.

In the scenes made here the robot comes along +x on the ground z = 0, and the edge is at x = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from stairmap.arrays import Points
from stairmap.simulation.scene import Route, Scene
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_prism,
    make_rectangle,
    make_wall,
)

EdgeKind: TypeAlias = Literal["stairs", "dock", "well", "void", "ramp", "kerb", "hall"]

_BACK, _HALF, _BEYOND = -6.0, 3.0, 5.0
"""Ends of the ground behind, beside and beyond the edge, m."""

START, STOP = 3.0, 0.45
"""Distances from the edge at which a drive begins and ends, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeScene:
    """A scene and the true edges of the ground that the robot drives on.

    Attributes
    ----------
    kind
        What is there.
    scene
        Surfaces and route.
    edges
        (N, 2, 3) segments, m; none where the ground goes on.
    """

    kind: EdgeKind
    scene: Scene
    edges: Points


def make_edge_scene(kind: EdgeKind, seed: int) -> EdgeScene:
    """Return a scene of a kind; its dimensions, and how the robot comes up to it, are drawn from the seed."""
    random = np.random.default_rng([seed, 7])
    make = {
        "stairs": _stairs, "dock": _dock, "well": _well, "void": _void,
        "ramp": _ramp, "kerb": _kerb, "hall": _hall,
    }[kind]  # fmt: skip
    mesh, edges = make(random)
    lateral = float(random.uniform(-0.4, 0.4))
    waypoints = np.array([[-START, lateral, 0.0], [-STOP, 0.2 * lateral, 0.0]])
    if kind in ("ramp", "kerb", "hall"):
        waypoints[1, 0] = -0.1
    scene = Scene(name=f"{kind}_{seed}", mesh=mesh, route=Route(waypoints=waypoints))
    return EdgeScene(kind=kind, scene=scene, edges=np.array(edges).reshape(-1, 2, 3))


def _front_edge(half: float) -> list[list[float]]:
    return [[0.0, half, 0.0], [0.0, -half, 0.0]]


def _stairs(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """A flight down between the floor's sides, 0.9 to 2 m wide, with a landing and a wall at its foot."""
    rise, run = float(random.uniform(0.15, 0.20)), float(random.uniform(0.25, 0.32))
    half, num = float(random.uniform(0.45, 1.0)), int(random.integers(6, 18))
    profile = [(_BACK, -6.0), (_BACK, 0.0), (0.0, 0.0)]
    for index in range(1, num):
        profile += [((index - 1) * run, -index * rise), (index * run, -index * rise)]
    foot = ((num - 1) * run, -num * rise)
    profile += [foot, (foot[0], -6.0)]
    end = foot[0] + 1.5
    mesh = joined(
        [
            make_prism(profile, -half, half),
            make_block((_BACK, half, -0.3), (end, _HALF, 0.0)),
            make_block((_BACK, -_HALF, -0.3), (end, -half, 0.0)),
            make_wall((0.0, half), (end, half), foot[1], 0.0),
            make_wall((0.0, -half), (end, -half), foot[1], 0.0),
            make_rectangle((foot[0], -half), (end, half), foot[1]),
            make_wall((end, -_HALF), (end, _HALF), foot[1], 2.5),
        ]
    )
    sides = [[[end, y, 0.0], [0.0, y, 0.0]] for y in (half, -half)]
    return mesh, [_front_edge(half), *sides]


def _dock(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """An edge 0.2 to 1.3 m above a yard; in half of them, nothing stands within 15 m."""
    depth = float(random.uniform(0.2, 1.3))
    beyond = 15.0 if random.random() < 0.5 else float(random.uniform(2.0, 5.0))
    mesh = joined(
        [
            make_block((_BACK, -_HALF, -depth), (0.0, _HALF, 0.0)),
            make_rectangle((_BACK, -2 * _HALF), (beyond, 2 * _HALF), -depth),
            make_wall((beyond, -2 * _HALF), (beyond, 2 * _HALF), -depth, 3.0),
        ]
    )
    sides = [[[0.0, y, 0.0], [_BACK, y, 0.0]] for y in (_HALF, -_HALF)]
    return mesh, [_front_edge(_HALF), *sides]


def _well(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """A hole of 0.8 to 2.5 m by 1 to 3 m, a storey deep, in a floor that goes on about it."""
    depth, length = float(random.uniform(2.2, 3.5)), float(random.uniform(0.8, 2.5))
    half = float(random.uniform(0.5, 1.5))
    corners = [(0.0, half), (0.0, -half), (length, -half), (length, half)]
    walls = [
        make_wall(first, second, -depth, 0.0)
        for first, second in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    mesh = joined(
        [
            make_rectangle((_BACK, -_HALF), (0.0, _HALF), 0.0),
            make_rectangle((length, -_HALF), (_BEYOND, _HALF), 0.0),
            make_rectangle((0.0, half), (length, _HALF), 0.0),
            make_rectangle((0.0, -_HALF), (length, -half), 0.0),
            make_rectangle((0.0, -half), (length, half), -depth),
            make_wall((_BEYOND, -_HALF), (_BEYOND, _HALF), 0.0, 2.5),
            *walls,
        ]
    )
    edges = [
        [[*first, 0.0], [*second, 0.0]]
        for first, second in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    return mesh, edges


def _void(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """A dock or a well so deep, in a hall so large, that no sensor sees anything behind the edge."""
    if random.random() < 0.5:
        sides = [[[0.0, y, 0.0], [_BACK, y, 0.0]] for y in (_HALF, -_HALF)]
        return make_block((_BACK, -_HALF, -20.0), (0.0, _HALF, 0.0)), [_front_edge(_HALF), *sides]
    length, half = float(random.uniform(0.8, 2.5)), float(random.uniform(0.5, 1.5))
    mesh = joined(
        [
            make_rectangle((_BACK, -_HALF), (0.0, _HALF), 0.0),
            make_rectangle((length, -_HALF), (_BEYOND, _HALF), 0.0),
            make_rectangle((0.0, half), (length, _HALF), 0.0),
            make_rectangle((0.0, -_HALF), (length, -half), 0.0),
        ]
    )
    corners = [(0.0, half), (0.0, -half), (length, -half), (length, half)]
    edges = [
        [[*first, 0.0], [*second, 0.0]]
        for first, second in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    ends = [[[x, y, 0.0] for x in (_BACK, _BEYOND)] for y in (_HALF, -_HALF)]
    return mesh, [*edges, *ends, [[_BEYOND, _HALF, 0.0], [_BEYOND, -_HALF, 0.0]]]


def _ramp(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """Ground that falls or rises by 3 to 10 degrees, 3 m long, and goes on level."""
    slope = float(np.tan(np.radians(random.uniform(3.0, 10.0)))) * float(random.choice([-1.0, 1.0]))
    end = 3.0 * slope
    profile = [(_BACK, -3.0), (_BACK, 0.0), (0.0, 0.0), (3.0, end), (8.0, end), (8.0, -3.0)]
    return joined([make_prism(profile, -_HALF, _HALF), make_wall((8.0, -_HALF), (8.0, _HALF), -2.0, 3.0)]), []


def _kerb(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """A kerb of 0.03 to 0.07 m down to a street that goes on."""
    step = float(random.uniform(0.03, 0.07))
    return joined(
        [
            make_block((_BACK, -_HALF, -1.0), (0.0, _HALF, 0.0)),
            make_rectangle((0.0, -_HALF), (8.0, _HALF), -step),
            make_wall((8.0, -_HALF), (8.0, _HALF), -step, 3.0),
        ]
    ), []


def _hall(random: np.random.Generator) -> tuple[TriangleMesh, list[list[list[float]]]]:
    """A hall with boxes, a table and a wall."""
    parts = [
        make_rectangle((_BACK, -_HALF), (_BEYOND, _HALF), 0.0),
        make_wall((_BEYOND, -_HALF), (_BEYOND, _HALF), 0.0, 2.5),
        make_wall((_BACK, _HALF), (_BEYOND, _HALF), 0.0, 2.5),
        make_wall((_BACK, -_HALF), (_BEYOND, -_HALF), 0.0, 2.5),
    ]
    for _ in range(5):
        x, y = float(random.uniform(-1.5, 4.0)), float(random.choice([-1.0, 1.0]) * random.uniform(0.8, 2.5))
        size = random.uniform(0.2, 0.8, 3)
        parts.append(make_block((x, y, 0.0), (x + size[0], y + size[1], size[2])))
    parts.append(make_block((1.0, -0.6, 0.70), (2.2, 0.6, 0.74)))
    return joined(parts), []
