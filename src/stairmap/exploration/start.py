"""Where an exploring robot begins: the place a user names, checked, or one found in the world."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stairmap.arrays import Float64Array, Points
from stairmap.errors import ConfigError
from stairmap.exploration.body import Body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.world import DOWN, World

MIN_SUPPORT = 0.9
"""Share of the footprint that must stand on level ground at the start."""

REACH_UP, REACH_DOWN = 0.3, 1.0
"""A start may be named so far below or above its ground, m."""

SEARCH_RADIUS = 5.0
SEARCH_STEP = 0.25
"""Free places are looked for so far about a start that is none, and so near together, m."""

GRID_STEP = 1.0
"""Starts of a world are looked for on a grid of this step, m."""

MAX_FLOORS = 12
"""So many floors one above the other are looked through."""

CEILING = 8.0
"""What has nothing above it up to this height is outside, m."""

CLEAR_RADIUS = 0.9
"""A start that is found has so much room about it, m, if there is one: what stands nearer cannot be seen."""

VIEW = 10.0
"""How far the room about a start counts, m."""


def check_start(world: World, body: Body, start: Planar) -> Planar:
    """Return a start on the ground below (or just above) the place that was named.

    Raises
    ------
    ConfigError
        If the robot cannot stand there; the message names the nearest free place.
    """
    if not all(math.isfinite(value) for value in start.to_row()):
        raise ConfigError(f"expected a start of finite numbers, got {start.x}, {start.y}, {start.z}")
    height, flaw = _stand(world, body, start.place)
    if not flaw:
        return Planar(x=start.x, y=start.y, z=height, heading=start.heading)
    where = f"the start {start.x:g},{start.y:g},{start.z:g} {flaw}"
    nearest = _nearest_free(world, body, start.place)
    if nearest is None:
        raise ConfigError(
            f"{where}, and no place within {SEARCH_RADIUS:g} m is free; leave --start out to have one found"
        )
    x, y, z = nearest
    raise ConfigError(f"{where}; the nearest free place is --start {x:.2f},{y:.2f},{z:.2f}")


def find_start(world: World, body: Body) -> Planar:
    """Return a start with much room about it, on the floor nearest to height zero.

    Raises
    ------
    ConfigError
        If there is none.
    """
    places = _floor_places(world)
    order = np.lexsort((places[:, 1], places[:, 0], np.round(np.abs(places[:, 2]), 1)))
    places = places[order]
    best: tuple[float, Float64Array] | None = None
    level: float | None = None
    for place in places:
        if best is not None and level is not None and abs(abs(place[2]) - level) > 0.5:
            break
        height, flaw = _stand(world, body, place)
        if flaw:
            continue
        level = abs(float(place[2])) if level is None else level
        ground = np.array([place[0], place[1], height])
        room = _room(world, ground)
        if world.is_blocked(ground, replace(body, radius=CLEAR_RADIUS)):
            room -= VIEW
        if best is None or room > best[0]:
            best = (room, np.array([place[0], place[1], height]))
    if best is None:
        raise ConfigError(
            "expected a world with a floor, but nowhere in it can the robot stand; "
            "name a place with --start X,Y,Z, or another world"
        )
    x, y, z = (float(value) for value in best[1])
    return Planar(x=x, y=y, z=z, heading=0.0)


def _stand(world: World, body: Body, place: Float64Array, *, down: float = REACH_DOWN) -> tuple[float, str]:
    """Return the height of the ground so far below a place at most, and what speaks against it."""
    found = float(world.ground(place[None], up=REACH_UP, down=down)[0])
    if math.isnan(found):
        return math.nan, "has no ground below it"
    ground = np.array([place[0], place[1], found])
    share, height = world.support(ground, body.radius)
    if share < MIN_SUPPORT:
        return math.nan, "is on no level ground: stairs, or an edge"
    ground[2] = height
    if world.is_blocked(ground, body):
        return math.nan, "is in a wall or an obstacle"
    return height, ""


def _nearest_free(world: World, body: Body, place: Float64Array) -> tuple[float, float, float] | None:
    steps = np.arange(-SEARCH_RADIUS, SEARCH_RADIUS + 1e-9, SEARCH_STEP)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    for x, y in offsets[np.argsort(np.hypot(*offsets.T), kind="stable")]:
        candidate = place + np.array([x, y, 0.0])
        height, flaw = _stand(world, body, candidate, down=SEARCH_RADIUS)
        if not flaw:
            return float(candidate[0]), float(candidate[1]), height
    return None


def _floor_places(world: World) -> Points:
    """Return places on all surfaces that look up on a grid, with something above them where there is such."""
    margin = 0.3
    x = np.arange(world.low[0] + margin, world.high[0], GRID_STEP)
    y = np.arange(world.low[1] + margin, world.high[1], GRID_STEP)
    columns = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    starts = np.column_stack([columns, np.full(len(columns), world.high[2] + 1.0)])
    reach = float(world.high[2] - world.low[2]) + 2.0
    found = []
    for _ in range(MAX_FLOORS):
        distances = world.caster.distances(starts, DOWN, reach)
        met = np.isfinite(distances)
        if not met.any():
            break
        starts = starts[met] - np.array([0.0, 0.0, 1.0]) * distances[met][:, None]
        found.append(starts.copy())
        starts[:, 2] -= 0.05
    places = np.concatenate(found) if found else np.empty((0, 3))
    above = world.caster.distances(places - 0.2 * DOWN, -DOWN, CEILING) if len(places) else np.empty(0)
    inside = places[np.isfinite(above) & (above > 1.5)]
    return inside if len(inside) else places


def _room(world: World, place: Float64Array) -> float:
    """Return the mean distance that is free about a place, m."""
    angles = np.arange(16) * math.pi / 8
    rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(16)], axis=1)
    starts = np.broadcast_to(place - 0.5 * DOWN, rays.shape)
    return float(np.minimum(world.caster.distances(starts, rays, VIEW), VIEW).mean())
