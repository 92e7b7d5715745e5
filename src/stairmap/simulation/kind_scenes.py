"""Scenes of the kinds of stairs that single frames are judged on; each builder says what is special in it.

Stairs that are looked up at ascend along +x from the map's origin. Stairs that are looked down at have
their top nosing at the origin and descend along +x.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stairmap.arrays import Points
from stairmap.simulation.rooms import make_room, make_upper_floor
from stairmap.simulation.scene import Scene, make_approach_route, make_descent_route
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import BuiltStairway, build_stairway, true_std
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_prism,
    make_rectangle,
    make_wall,
)
from stairmap.stairway import Flight, Stairway, Step

_FAR_AWAY = 14.0
"""Distance of walls that no sensor reaches (the ideal one measures 10 m) from where cameras stand, m."""

_LANDING = 2.0
"""Depth of the floor behind a top nosing, m."""

_ABOVE = 2.6
"""Height of ceilings and walls above an upper floor, m."""

_LEVEL_STEPS = 2
"""Steps of an escalator that run level at either end."""

_RIB_HEIGHT, _RIB_WIDTH, _RIB_PITCH = 0.004, 0.006, 0.012
"""Ribs of an escalator's treads, m: real ones are 10 mm high every 9 mm, and a sensor sees their mean."""

_BALUSTRADE, _BALUSTRADE_HEIGHT = 0.06, 0.95
"""Thickness of an escalator's balustrade, and its height above the treads, m."""

_JOINT = 0.001
"""Gap between surfaces that would else lie in one plane, m."""


def make_ascending_scene(
    name: str, shape: FlightShape, random: np.random.Generator, *, is_walled: bool = True
) -> Scene:
    """Return a flight up in a hall; walled, a wall stands behind its landing and beside the flight.

    Without walls nothing but floor and stairs is within any sensor's range: the last nosing stands
    against nothing.
    """
    built = _build(shape, random)
    flight = built.stairway.flights[0]
    end = float(flight.steps[-1].nosing[0, 0]) + _LANDING
    parts = [built.mesh, make_upper_floor(flight, _LANDING, setback=shape.overhang)]
    if is_walled:
        side = max(shape.width / 2 + 2.0, 5.0)
        parts.append(make_room((-9.0, -side), (end, side), height=built.top_z + _ABOVE))
    else:
        parts.append(make_rectangle((-_FAR_AWAY, -_FAR_AWAY), (end, _FAR_AWAY), 0.0))
    return Scene(
        name=name, mesh=joined(parts), stairways=(built.stairway,), route=make_approach_route(flight)
    )


def make_descending_scene(
    name: str, shape: FlightShape, random: np.random.Generator, *, is_walled: bool = True
) -> Scene:
    """Return a flight down from a floor whose edge is the map's y axis.

    Walled, it is a stairwell between walls in that floor, with the wall of the storey below at its end.
    Else it leads from a terrace down to open ground.
    """
    depth, length = shape.num_risers * shape.rise, (shape.num_risers - 1) * shape.run
    built = _build(shape, random, base=np.array([length, 0.0, -depth]), heading=np.pi)
    flight = built.stairway.flights[0]
    # An irregular flight ends where its own steps end.
    shift = -flight.steps[-1].nosing.mean(axis=0)
    built = _moved(built, shift)
    flight = built.stairway.flights[0]
    low, half, end = float(flight.base[2]), shape.width / 2, float(flight.base[0]) + 1.6
    back = -_FAR_AWAY / 2
    # 1 mm apart from the top step's own slab.
    parts = [built.mesh, make_rectangle((back, -half), (-shape.run - _JOINT, half), 0.0)]
    if is_walled:
        parts += [make_rectangle((back, y0), (end, y1), 0.0) for y0, y1 in ((-4.0, -half), (half, 4.0))]
        parts += [make_wall((-shape.run, y), (end, y), low, 0.0) for y in (-half, half)]
        parts.append(make_wall((end, -half), (end, half), low, 0.0))
        parts.append(make_rectangle((0.0, -half), (end, half), low))
        parts.append(make_room((back, -4.0), (end, 4.0), height=_ABOVE, has_floor=False))
    else:
        for y0, y1 in ((-4.0, -half), (half, 4.0)):
            parts.append(make_rectangle((back, y0), (0.0, y1), 0.0))
            parts.append(make_wall((0.0, y0), (0.0, y1), low, 0.0))
        parts.append(make_rectangle((0.0, -_FAR_AWAY), (_FAR_AWAY, _FAR_AWAY), low))
    return Scene(name=name, mesh=joined(parts), stairways=(built.stairway,), route=make_descent_route(flight))


def make_sloping_scene(
    name: str, shape: FlightShape, random: np.random.Generator, *, along: float, across: float
) -> Scene:
    """Return a flight on sloping ground: floor, treads and top all slope alike, risers stay upright.

    Parameters
    ----------
    name, shape, random
        As everywhere; ``shape.rise`` is the vertical distance of two nosings.
    along, across
        Rise of all level surfaces along the stairs' way up and to their left, as ratios: with a
        positive ``along`` water runs off towards the front.
    """
    # What the ground rises over a run is no part of the riser.
    level = replace(shape, rise=shape.rise - along * shape.run)
    return shear_scene(make_ascending_scene(name, level, random), along, across)


def shear_scene(scene: Scene, along: float, across: float) -> Scene:
    """Return a scene whose surfaces rise by ``along * x + across * y``; upright ones stay upright."""
    slope = np.array([along, across])

    def lifted(points: Points) -> Points:
        moved = np.array(points)
        moved[..., 2] += moved[..., :2] @ slope
        return moved

    def sheared(flight: Flight) -> Flight:
        steps = tuple(replace(step, nosing=lifted(step.nosing)) for step in flight.steps)
        heights = np.array([step.nosing[:, 2].mean() for step in steps])
        rise = float(np.diff(heights).mean()) if len(heights) > 1 else flight.rise
        # Below the first nosing by one rise: where a lattice through all nosings begins.
        base = steps[0].nosing.mean(axis=0) - [0.0, 0.0, rise]
        return replace(flight, base=base, rise=rise, steps=steps)

    return replace(
        scene,
        mesh=TriangleMesh(vertices=lifted(scene.mesh.vertices), triangles=scene.mesh.triangles),
        stairways=tuple(
            replace(stairway, flights=tuple(sheared(flight) for flight in stairway.flights))
            for stairway in scene.stairways
        ),
        route=replace(scene.route, waypoints=lifted(scene.route.waypoints)),
    )


def make_escalator_scene(name: str, random: np.random.Generator) -> tuple[Scene, Points, Points]:
    """Return an escalator, and its steps that rise less than the others, below and above.

    At both ends steps run level, then rise by a quarter and by three quarters of a rise. Its truth is the
    flight between, of full rises. Treads have ribs, and a balustrade stands on either side.

    Returns
    -------
    The scene, and (2, 2, 3) nosings of the lesser steps below the flight and above it.
    """
    pitch, run = np.radians(30.0), 0.40
    rise, width, num_full = run * np.tan(pitch), float(random.choice([0.6, 0.8, 1.0])), 7
    shares = np.concatenate([[0.25, 0.75], np.ones(num_full), [0.75, 0.25]])
    heights = np.cumsum(shares * rise)
    half, parts = width / 2, []
    nosings = np.zeros((len(shares), 2, 3))
    nosings[..., 0] = (run * (np.arange(len(shares)) - 2))[:, None]
    nosings[..., 1] = np.array([half, -half])
    nosings[..., 2] = (heights - heights[1])[:, None]
    low, top = -float(heights[1]), float(nosings[-1, 0, 2])
    for nosing in nosings:
        parts += _ribbed_tread(float(nosing[0, 0]), run, half, low - 0.05, float(nosing[0, 2]))
    for number in range(1, _LEVEL_STEPS + 1):
        first, last = float(nosings[0, 0, 0]), float(nosings[-1, 0, 0])
        parts += _ribbed_tread(first - number * run, run, half, low - 0.05, low)
        parts += _ribbed_tread(last + number * run, run, half, low - 0.05, top)
    start = float(nosings[0, 0, 0]) - _LEVEL_STEPS * run
    end = float(nosings[-1, 0, 0]) + (_LEVEL_STEPS + 1) * run
    foot, head = float(nosings[0, 0, 0]), float(nosings[-1, 0, 0])
    for y0, y1 in ((-half - _BALUSTRADE, -half), (half, half + _BALUSTRADE)):
        for x0, x1, z0, z1 in ((start, foot, low, low), (foot, head, low, top), (head, end, top, top)):
            corners = [(x0, low), (x1, low), (x1, z1 + _BALUSTRADE_HEIGHT), (x0, z0 + _BALUSTRADE_HEIGHT)]
            parts.append(make_prism(corners, y0, y1))
    parts.append(make_rectangle((-9.0, -5.0), (start, 5.0), low))
    for y0, y1 in ((-5.0, -half - _BALUSTRADE), (half + _BALUSTRADE, 5.0)):
        parts.append(make_rectangle((start, y0), (end + 6.0, y1), low))
    parts.append(make_block([end, -5.0, top - 0.3], [end + 6.0, 5.0, top]))
    parts.append(
        make_room((-9.0, -5.0), (end + 6.0, 5.0), floor=low, height=top - low + _ABOVE, has_floor=False)
    )
    full = nosings[2:-2]
    flight = Flight(
        base=full[0].mean(axis=0) - [0.0, 0.0, rise], heading=0.0, rise=rise, run=run, width=width,
        num_risers=num_full, overhang=0.0, std=true_std(),
        steps=tuple(Step(nosing=nosing, num_observations=0, std=(0.0, 0.0)) for nosing in full),
    )  # fmt: skip
    stairway = Stairway(id=1, flights=(flight,), num_observations=0, first_seen_ns=0, last_seen_ns=0)
    route = make_approach_route(flight)
    return (
        Scene(name=name, mesh=joined(parts), stairways=(stairway,), route=route), nosings[:2], nosings[-2:]
    )  # fmt: skip


def _ribbed_tread(x: float, run: float, half: float, low: float, z: float) -> list[TriangleMesh]:
    """Return a step of an escalator: a block with ribs that stand up to ``z``."""
    parts = [make_block([x, -half, low], [x + run, half, z - _RIB_HEIGHT])]
    for y in np.arange(-half, half - _RIB_WIDTH, _RIB_PITCH):
        parts.append(make_block([x, y, z - _RIB_HEIGHT], [x + run, y + _RIB_WIDTH, z]))
    return parts


def _build(
    shape: FlightShape, random: np.random.Generator, *, base: Points | None = None, heading: float = 0.0
) -> BuiltStairway:
    return build_stairway(
        StairwayShape(flights=(shape,)), base=np.zeros(3) if base is None else base, heading=heading,
        stairway_id=1, random=random,
    )  # fmt: skip


def _moved(built: BuiltStairway, shift: Points) -> BuiltStairway:
    """Return a stairway of one flight moved by a (3,) vector, m."""
    (flight,) = built.stairway.flights
    steps = tuple(replace(step, nosing=step.nosing + shift) for step in flight.steps)
    moved = replace(flight, base=flight.base + shift, steps=steps)
    mesh = TriangleMesh(vertices=built.mesh.vertices + shift, triangles=built.mesh.triangles)
    return BuiltStairway(mesh=mesh, stairway=replace(built.stairway, flights=(moved,)))
