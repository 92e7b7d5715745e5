"""Scenes with several flights, several stairways, or stairs that lead down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.simulation.flight_scenes import SceneMaker
from stairmap.simulation.rooms import Opening, make_railing, make_room, make_upper_floor
from stairmap.simulation.scene import Route, Scene, make_approach_route, make_descent_route
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import build_stairway
from stairmap.simulation.triangle_mesh import joined, make_rectangle, make_wall

_FLIGHT = FlightShape(rise=0.17, run=0.28, width=1.1, num_risers=9)
_UPPER = replace(_FLIGHT, soffit=True)

STAIRWAYS: dict[str, StairwayShape] = {
    "half_turn": StairwayShape(flights=(_FLIGHT, _UPPER), turns=(180,)),
    "quarter_turn": StairwayShape(flights=(replace(_FLIGHT, num_risers=7), _UPPER), turns=(-90,)),
    "two_flights": StairwayShape(flights=(replace(_FLIGHT, num_risers=7), replace(_FLIGHT, num_risers=7)),
                                 turns=(0,)),
    "three_quarter_turns": StairwayShape(
        flights=(replace(_FLIGHT, num_risers=6), *2 * (replace(_UPPER, num_risers=6),)),
        turns=(90, 90),
    ),
}  # fmt: skip
"""Stairways of several flights: the robot stays on the lower floor."""


def make_turning_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a stairway of ``STAIRWAYS`` in the corner of a high hall."""
    built = build_stairway(STAIRWAYS[name], base=np.zeros(3), heading=0.0, stairway_id=1, random=random)
    first, last = built.stairway.flights[0], built.stairway.flights[-1]
    hall = make_room((-7, -6), (6.5, 6), height=built.top_z + 2.6)
    return Scene(
        name=name,
        mesh=joined([built.mesh, hall, make_upper_floor(last, 1.5)]),
        stairways=(built.stairway,),
        route=make_approach_route(first, lateral=-0.7, first_turn=-0.5),
    )


def make_two_stairways_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a hall with two different stairways at opposite ends; the robot visits both."""
    first = build_stairway(
        StairwayShape(flights=(replace(_FLIGHT, rise=0.165, run=0.30, width=1.3),)),
        base=np.zeros(3), heading=0.0, stairway_id=1, random=random,
    )  # fmt: skip
    second = build_stairway(
        StairwayShape(flights=(replace(_FLIGHT, rise=0.19, run=0.25, width=0.95),)),
        base=np.array([-6.0, 1.5, 0.0]), heading=np.pi, stairway_id=2, random=random,
    )  # fmt: skip
    hall = make_room((-10.5, -4), (5, 4), height=4.6)
    floors = [make_upper_floor(built.stairway.flights[0], 1.2) for built in (first, second)]
    out = make_approach_route(first.stairway.flights[0], distance=3.5, first_turn=0.5)
    back = make_approach_route(second.stairway.flights[0], distance=3.5, lateral=0.0)
    route = Route(
        waypoints=np.concatenate([out.waypoints, back.waypoints]),
        first_heading=out.first_heading,
        last_heading=back.last_heading,
    )
    return Scene(
        name=name,
        mesh=joined([first.mesh, second.mesh, hall, *floors]),
        stairways=(first.stairway, second.stairway),
        route=route,
    )


def make_side_by_side_scene(name: str, random: np.random.Generator) -> Scene:
    """Return two equal flights side by side, 0.6 m apart, with a wall between them."""
    builts = [
        build_stairway(
            StairwayShape(flights=(_FLIGHT,)), base=np.array([0.0, y, 0.0]), heading=0.0,
            stairway_id=stairway_id, random=random,
        )
        for stairway_id, y in ((1, 0.85), (2, -0.85))
    ]  # fmt: skip
    hall = make_room((-7, -4), (6, 4), height=4.6)
    parts = [built.mesh for built in builts]
    parts += [make_upper_floor(built.stairway.flights[0], 1.5) for built in builts]
    for y in (0.3, -0.3):
        parts.append(make_wall((-0.1, y), (4.0, y), 0.0, 2.6))
    parts.append(make_wall((-0.1, -0.3), (-0.1, 0.3), 0.0, 2.6))
    route = Route(waypoints=np.array([[-4.5, 0.5, 0], [-2.2, 0.1, 0], [-0.9, 0, 0]]), last_heading=0.0)
    return Scene(
        name=name,
        mesh=joined([*parts, hall]),
        stairways=tuple(built.stairway for built in builts),
        route=route,
    )


def make_corridor_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a flight that leads off a corridor to the left; the robot drives past, then turns to it."""
    shape = replace(_FLIGHT, left="wall", right="wall", num_risers=12)
    built = build_stairway(
        StairwayShape(flights=(shape,)), base=np.array([0.0, 1.2, 0.0]), heading=np.pi / 2, stairway_id=1,
        random=random,
    )  # fmt: skip
    half = shape.width / 2
    corridor = make_room(
        (-7, -1.1), (4, 0.9), height=2.6, openings=[Opening(side="+y", start=-half, end=half)]
    )
    flight = built.stairway.flights[0]
    parts = [built.mesh, corridor, make_upper_floor(flight, 2.0)]
    parts.append(make_rectangle((-half, 0.9), (half, 1.3), 0.0))
    parts.append(make_wall((-half, 6.5), (half, 6.5), 0.0, 4.8))
    route = Route(
        waypoints=np.array([[-5.0, -0.2, 0], [-0.8, -0.3, 0], [0.0, -0.3, 0], [0, 0.3, 0]]),
        last_heading=np.pi / 2,
    )
    return Scene(name=name, mesh=joined(parts), stairways=(built.stairway,), route=route)


def make_descending_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a stairwell in the floor, seen from above; the top nosing is at the map's origin."""
    return _descending(name, random, has_upward=False)


def make_up_and_down_scene(name: str, random: np.random.Generator) -> Scene:
    """Return a flight up beside a flight down, as in the middle storey of a house."""
    return _descending(name, random, has_upward=True)


def _descending(name: str, random: np.random.Generator, *, has_upward: bool) -> Scene:
    shape = replace(_FLIGHT, num_risers=14)
    depth, length = shape.num_risers * shape.rise, (shape.num_risers - 1) * shape.run
    half, y = shape.width / 2, (-0.8 if has_upward else 0.0)
    low = np.array([length, y, -depth])
    built = build_stairway(
        StairwayShape(flights=(shape,)), base=low, heading=np.pi, stairway_id=1, random=random
    )
    stairways, end = [built.stairway], length + 2.0
    parts = [
        built.mesh,
        # The upper floor around the well; 1 mm apart from the top step's own slab.
        make_rectangle((-6, -4), (-shape.run, 4), 0.0),
        make_rectangle((-shape.run, y + half), (end, 4), 0.0),
        make_rectangle((-shape.run, -4), (end, y - half), 0.0),
        make_room((-6, -4), (end, 4), height=4.8 if has_upward else 2.8, has_floor=False),
    ]
    parts.append(make_rectangle((0, y - 2), (end, y + 2), -depth))
    for side in (y - half, y + half):
        parts.append(make_wall((-shape.run, side), (end, side), -depth, 0.0))
        if not (has_upward and side > y):
            parts.append(make_railing((0.0, side), (length, side), 0.0, num_rails=1))
    parts.append(make_wall((end, y - half), (end, y + half), -depth, 0.0))
    route = make_descent_route(built.stairway.flights[0])
    if has_upward:
        upper = build_stairway(
            StairwayShape(flights=(replace(_FLIGHT, num_risers=13, left="wall", right="railing"),)),
            base=np.array([0.0, 0.8, 0.0]), heading=0.0, stairway_id=2, random=random,
        )  # fmt: skip
        stairways.append(upper.stairway)
        parts += [upper.mesh, make_upper_floor(upper.stairway.flights[0], 1.5)]
        route = Route(
            waypoints=np.array(
                [[-4.5, 0.6, 0], [-1.8, 0.6, 0], [-0.7, 0.8, 0], [-1.2, -0.6, 0], [-0.25, -0.8, 0]]
            ),
            last_heading=0.0,
            last_pause=2.0,
            min_camera_pitch=float(np.radians(25)),
        )
    return Scene(name=name, mesh=joined(parts), stairways=tuple(stairways), route=route)


STAIRWAY_SCENES: dict[str, SceneMaker] = {
    **dict.fromkeys(STAIRWAYS, make_turning_scene),
    "two_stairways": make_two_stairways_scene,
    "side_by_side": make_side_by_side_scene,
    "corridor_stairs": make_corridor_scene,
    "descending": make_descending_scene,
    "up_and_down": make_up_and_down_scene,
}
"""Scene makers of this module by name."""
