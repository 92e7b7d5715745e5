"""Every simulated scene by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stairmap.simulation.scene import Scene, make_approach_route
from stairmap.simulation.stairs import FlightShape, Side, StairwayShape, build_stairway
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block, make_rectangle, make_wall

SceneMaker = Callable[[str, np.random.Generator], Scene]

TABLE_1 = {
    "b1_front": (0.196, 0.254, 0.965),
    "b1_rear": (0.196, 0.254, 0.965),
    "b3": (0.192, 0.263, 1.015),
    "davis_front": (0.181, 0.305, 1.226),
    "davis_rear": (0.165, 0.292, 1.175),
}
"""Ground truth of the report's Table 1: rise, run, width in m."""


def make_straight_scene(
    name: str, shape: StairwayShape, random: np.random.Generator, *, room: bool = True
) -> Scene:
    """Return a hall with one stairway that leads up from it, heading +x from the origin."""
    built = build_stairway(shape, base=np.zeros(3), heading=0.0, stairway_id=1, random=random)
    flight = built.stairway.flights[0]
    parts = [built.mesh, make_rectangle((-7, -4), (1, 4), 0.0)]
    parts.append(
        _upper_floor(built.stairway.flights[-1].steps[-1].nosing.mean(axis=0), shape.flights[-1].width)
    )
    if room:
        parts += _hall(shape.flights[0].width, built.top_z)
    return Scene(
        name=name, mesh=joined(parts), stairways=(built.stairway,), route=make_approach_route(flight)
    )


def _upper_floor(top: np.ndarray, width: float) -> TriangleMesh:
    x, _, z = top
    return make_block([x + 0.001, -width / 2, z - 0.2], [x + 2.5, width / 2, z])


def _hall(width: float, top_z: float) -> list[TriangleMesh]:
    """Walls and ceiling of a hall 8 m wide whose end wall has an opening for the stairs."""
    half, height = width / 2, 2.8
    parts = [make_wall((-7, -4), (-7, 4), 0, height), make_rectangle((-7, -4), (-0.3, 4), height)]
    for sign in (1.0, -1.0):
        parts.append(make_wall((-7, sign * 4), (1, sign * 4), 0, height))
        parts.append(make_wall((-0.3, sign * half), (-0.3, sign * 4), 0, height))
    parts.append(make_wall((6 + top_z, -half), (6 + top_z, half), 0, top_z + 2.5))
    return parts


def _table_1(name: str, random: np.random.Generator) -> Scene:
    rise, run, width = TABLE_1[name]
    sides: tuple[Side, Side] = ("wall", "wall")
    flight = FlightShape(
        rise=rise, run=run, width=width, num_risers=10, left=sides[0], right=sides[1], irregularity=0.003
    )
    return make_straight_scene(name, StairwayShape(flights=(flight,)), random)


SCENES: dict[str, SceneMaker] = dict.fromkeys(TABLE_1, _table_1)
"""Scene makers by the name that ``stairmap simulate`` takes."""


def make_scene(name: str, seed: int) -> Scene:
    """Return a scene; the same name and seed give the same scene, bit for bit.

    Raises
    ------
    ValueError
        If there is no such scene.
    """
    if name not in SCENES:
        raise ValueError(f"unknown scene {name!r}; choose one of: {', '.join(sorted(SCENES))}")
    return SCENES[name](name, np.random.default_rng([seed, 1]))
