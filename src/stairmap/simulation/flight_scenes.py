"""Scenes with one straight flight up from the floor that the robot drives on.

The flight ascends along +x from the map's origin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from stairmap.simulation.rooms import (
    Opening,
    make_clutter,
    make_objects_on_steps,
    make_person,
    make_room,
    make_upper_floor,
)
from stairmap.simulation.scene import Route, Scene, make_approach_route
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import BuiltStairway, build_stairway
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_rectangle, make_wall

Setting = Literal["free", "one_wall", "walls"]
"""Free in a hall, along the hall's left wall, or in a stairwell behind the hall's end wall."""

SceneMaker = Callable[[str, np.random.Generator], Scene]
"""Makes the scene of a name."""

TABLE_1 = {
    "b1_front": (0.196, 0.254, 0.965),
    "b1_rear": (0.196, 0.254, 0.965),
    "b3": (0.192, 0.263, 1.015),
    "davis_front": (0.181, 0.305, 1.226),
    "davis_rear": (0.165, 0.292, 1.175),
}
"""Ground truth of the report's Table 1: rise, run, width in m."""

USUAL_HALL = (7.0, 5.0)
"""Length before the flight and half the width of a hall, m."""

_USUAL = FlightShape(rise=0.17, run=0.28, width=1.2, num_risers=12)

FLIGHTS: dict[str, tuple[FlightShape, Setting]] = {
    "free_standing": (replace(_USUAL, num_risers=8), "free"),
    "one_wall": (replace(_USUAL, right="railing"), "one_wall"),
    "railings": (replace(_USUAL, left="railing", right="railing"), "free"),
    "open_risers": (replace(_USUAL, rise=0.19, run=0.26, open_risers=True), "free"),
    "overhang": (replace(_USUAL, rise=0.178, run=0.27, overhang=0.025), "walls"),
    "irregular": (replace(_USUAL, irregularity=0.010), "walls"),
    "steep": (replace(_USUAL, rise=0.215, run=0.22, width=0.85), "walls"),
    "shallow": (replace(_USUAL, rise=0.12, run=0.40, width=1.6, num_risers=9), "walls"),
    "wide": (replace(_USUAL, rise=0.15, run=0.35, width=3.6, num_risers=7), "free"),
    "narrow": (replace(_USUAL, rise=0.20, run=0.23, width=0.60), "walls"),
    "short": (replace(_USUAL, rise=0.16, run=0.30, num_risers=3), "walls"),
    "long": (replace(_USUAL, num_risers=22), "walls"),
    "ship": (replace(_USUAL, rise=0.24, run=0.20, width=0.75, left="railing", right="railing"), "free"),
}
"""Dimensions and setting of scenes that show one feature each."""


def make_flight_scene(
    name: str,
    shape: FlightShape,
    setting: Setting,
    random: np.random.Generator,
    *,
    distance: float = 4.5,
    lateral: float = 0.7,
    first_turn: float = 0.6,
    hall: tuple[float, float] = USUAL_HALL,
) -> Scene:
    """Return a scene with one flight.

    Parameters
    ----------
    name
        Its name.
    shape
        The flight.
    setting
        What is around it.
    random
        Draws irregularities.
    distance, lateral, first_turn
        See ``make_approach_route``.
    hall
        Of the setting ``free``: length before the flight and half its width, m.
    """
    if setting == "walls":
        shape = replace(shape, left="wall", right="wall")
    built = build_stairway(
        StairwayShape(flights=(shape,)), base=np.zeros(3), heading=0.0, stairway_id=1, random=random
    )
    route = make_approach_route(
        built.stairway.flights[0], distance=distance, lateral=lateral, first_turn=first_turn
    )
    surroundings = _SURROUNDINGS[setting](built, hall)
    return Scene(
        name=name, mesh=joined([built.mesh, *surroundings]), stairways=(built.stairway,), route=route
    )


def make_table_1_scene(name: str, random: np.random.Generator) -> Scene:
    """Return one of the report's five stairs: ten risers between walls, each step off by 3 mm."""
    rise, run, width = TABLE_1[name]
    shape = FlightShape(rise=rise, run=run, width=width, num_risers=10, irregularity=0.003)
    return make_flight_scene(name, shape, "walls", random)


def make_feature_scene(
    name: str, random: np.random.Generator, *, hall: tuple[float, float] = USUAL_HALL
) -> Scene:
    """Return a scene of ``FLIGHTS``; see ``make_flight_scene``."""
    shape, setting = FLIGHTS[name]
    # Along the left wall there is room to the right only.
    lateral = -0.7 if setting == "one_wall" else 0.7
    return make_flight_scene(name, shape, setting, random, lateral=lateral, hall=hall)


def make_oblique_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a free flight that is approached from 50 deg aside."""
    scene = make_flight_scene(name, replace(_USUAL, num_risers=8), "free", random)
    toward = np.array([-np.cos(np.radians(50)), np.sin(np.radians(50)), 0.0])
    route = Route(waypoints=np.array([4.6 * toward, 2.2 * toward, 1.1 * toward]), last_heading=0.0)
    return replace(scene, route=route)


def make_random_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a flight whose dimensions, features and setting are drawn, pitch 24 to 42 deg."""
    while True:
        rise, run = random.uniform(0.13, 0.22), random.uniform(0.22, 0.36)
        if 24 <= np.degrees(np.arctan2(rise, run)) <= 42:
            break
    setting: Setting = ("free", "one_wall", "walls")[int(random.integers(3))]
    shape = FlightShape(
        rise=rise,
        run=run,
        width=random.uniform(0.8, 2.0),
        num_risers=int(random.integers(4, 16)),
        overhang=random.choice([0.0, 0.0, 0.02, 0.03]),
        irregularity=random.uniform(0.0, 0.008),
        left="railing" if setting == "free" and random.random() < 0.5 else "open",
        right="railing" if setting != "walls" and random.random() < 0.5 else "open",
    )
    lateral = random.uniform(-1.2, 0.2 if setting == "one_wall" else 1.2)
    return make_flight_scene(
        name, shape, setting, random, lateral=lateral, first_turn=random.uniform(-0.8, 0.8)
    )


def make_cluttered_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a hall with boxes, cylinders, two people, and bags and shoes on the steps."""
    scene = make_flight_scene(name, replace(_USUAL, width=1.4), "walls", random)
    flight = scene.stairways[0].flights[0]
    clutter = make_clutter((-6.5, -3.5), (-0.9, 3.5), 14, random, keep_clear=scene.route)
    people = [make_person(-2.0, -1.0), make_person(-3.4, 1.6)]
    mesh = joined([scene.mesh, clutter, *people, make_objects_on_steps(flight, random)])
    return replace(scene, mesh=mesh)


def _surround_walls(built: BuiltStairway, _hall: tuple[float, float]) -> list[TriangleMesh]:
    flight = built.stairway.flights[0]
    half, height = flight.width / 2, 2.8
    end = flight.num_risers * flight.run + 2.5
    gap = Opening(side="+x", start=-half, end=half)
    return [
        make_room((-7, -4), (-0.3, 4), openings=[gap], height=height),
        make_rectangle((-0.3, -half), (0.2, half), 0.0),
        make_wall((-0.3, -half), (-0.3, half), height, built.top_z + 2.5),
        make_upper_floor(flight, 2.5),
        make_wall((end, -half), (end, half), 0, built.top_z + 2.5),
        make_wall((0, -half), (end, -half), 0, built.top_z + 2.5),
        make_wall((0, half), (end, half), 0, built.top_z + 2.5),
    ]


def _surround_free(built: BuiltStairway, hall: tuple[float, float]) -> list[TriangleMesh]:
    length, half_width = hall
    flight = built.stairway.flights[0]
    end = flight.num_risers * flight.run + 3.0
    return [
        make_room((-length, -half_width), (end, half_width), height=built.top_z + 2.6),
        make_upper_floor(flight, 2.0, left=1.0, right=1.0),
    ]


def _surround_one_wall(built: BuiltStairway, _hall: tuple[float, float]) -> list[TriangleMesh]:
    flight = built.stairway.flights[0]
    end = flight.num_risers * flight.run + 3.0
    return [
        make_room((-7, -5), (end, flight.width / 2), height=built.top_z + 2.6),
        make_upper_floor(flight, 2.0, right=1.0),
    ]


_SURROUNDINGS: dict[Setting, Callable[[BuiltStairway, tuple[float, float]], list[TriangleMesh]]] = {
    "walls": _surround_walls,
    "free": _surround_free,
    "one_wall": _surround_one_wall,
}

FLIGHT_SCENES: dict[str, SceneMaker] = {
    **dict.fromkeys(TABLE_1, make_table_1_scene),
    **dict.fromkeys(FLIGHTS, make_feature_scene),
    "oblique": make_oblique_scene,
    "cluttered": make_cluttered_scene,
    "random": make_random_scene,
}
"""Scene makers of this module by name."""
