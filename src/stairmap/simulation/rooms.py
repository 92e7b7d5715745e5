"""Rooms and what stands about in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.simulation.scene import Route
from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_cylinder,
    make_rectangle,
    make_turned_block,
    make_wall,
)
from stairmap.stairway import Flight


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """Gap in a room's wall, over its whole height.

    Attributes
    ----------
    side
        ``"+x"``, ``"-x"``, ``"+y"`` or ``"-y"``: which wall.
    start, end
        Its ends along the wall, in the map's x or y, m.
    """

    side: str
    start: float
    end: float


def make_room(
    lower: tuple[float, float],
    upper: tuple[float, float],
    *,
    floor: float = 0.0,
    height: float = 2.8,
    openings: Sequence[Opening] = (),
    has_floor: bool = True,
) -> TriangleMesh:
    """Return floor, walls and ceiling of a rectangular room between two corners of the plan, m."""
    (x0, y0), (x1, y1) = lower, upper
    top = floor + height
    parts = [make_rectangle(lower, upper, top)]
    if has_floor:
        parts.append(make_rectangle(lower, upper, floor))
    corners = {
        "-x": ((x0, y0), (x0, y1)),
        "+x": ((x1, y0), (x1, y1)),
        "-y": ((x0, y0), (x1, y0)),
        "+y": ((x0, y1), (x1, y1)),
    }
    for side, (first, last) in corners.items():
        axis = 1 if side.endswith("x") else 0
        gaps = sorted((gap.start, gap.end) for gap in openings if gap.side == side)
        marks = [first[axis], *(mark for gap in gaps for mark in gap), last[axis]]
        for start, end in zip(marks[::2], marks[1::2], strict=True):
            if end - start > 1e-6:
                a, b = list(first), list(last)
                a[axis], b[axis] = start, end
                parts.append(make_wall(a, b, floor, top))
    return joined(parts)


def make_clutter(
    lower: tuple[float, float],
    upper: tuple[float, float],
    num_objects: int,
    random: np.random.Generator,
    *,
    keep_clear: Route,
    clearance: float = 0.6,
) -> TriangleMesh:
    """Return boxes and cylinders on the floor between two corners of the plan, off a route.

    Parameters
    ----------
    lower, upper
        Corners, m.
    num_objects
        How many are tried; one that stands within ``clearance`` m of the route is left out.
    random
        Draws places and sizes.
    keep_clear
        The robot's route.
    clearance
        Distance of an object's middle from the route, beyond its own half size, m.
    """
    parts = []
    for _ in range(num_objects):
        place = random.uniform(lower, upper)
        size = random.uniform((0.2, 0.2, 0.2), (0.8, 0.6, 1.2))
        yaw, is_round = random.uniform(0, np.pi), random.random() < 0.3
        if _distance_to_route(place, keep_clear) < clearance + float(np.hypot(size[0], size[1])) / 2:
            continue
        x, y = place
        if is_round:
            parts.append(make_cylinder([x, y, 0.001], [x, y, size[2]], size[0] / 2))
        else:
            parts.append(make_turned_block([x, y, size[2] / 2 + 0.001], size, yaw))
    return joined(parts)


def make_person(x: float, y: float, floor: float = 0.0) -> TriangleMesh:
    """Return a standing person: two legs, a trunk and a head, 1.75 m tall."""
    return joined(
        [
            make_cylinder([x, y - 0.1, floor], [x, y - 0.1, floor + 0.85], 0.075),
            make_cylinder([x, y + 0.1, floor], [x, y + 0.1, floor + 0.85], 0.075),
            make_cylinder([x, y, floor + 0.8], [x, y, floor + 1.45], 0.19),
            make_cylinder([x, y, floor + 1.45], [x, y, floor + 1.75], 0.1),
        ]
    )


def make_objects_on_steps(flight: Flight, random: np.random.Generator, num_objects: int = 4) -> TriangleMesh:
    """Return bags and shoes on the treads of a flight whose ``steps`` are known."""
    parts = []
    for _ in range(num_objects):
        step = flight.steps[int(random.integers(0, len(flight.steps) - 1))]
        share = random.uniform(0.15, 0.85)
        nosing = step.nosing[0] * (1 - share) + step.nosing[1] * share
        is_bag = random.random() < 0.5
        size = np.array([0.20, 0.35, 0.30]) if is_bag else np.array([0.26, 0.10, 0.11])
        size = np.minimum(size, [flight.run - 0.02, np.inf, np.inf])
        center = nosing + flight.forward * (0.01 + size[0] / 2) + [0.0, 0.0, size[2] / 2]
        parts.append(make_turned_block(center, size, flight.heading))
    return joined(parts)


def make_railing(
    start: tuple[float, float], end: tuple[float, float], floor: float, *, num_rails: int = 1
) -> TriangleMesh:
    """Return a level railing of 0.95 m between two points of the plan, with posts and rails."""
    first, last = np.array([*start, floor]), np.array([*end, floor])
    length = float(np.linalg.norm(last - first))
    parts = []
    for share in np.linspace(0, 1, max(int(length / 0.15), 1) + 1):
        x, y, z = first * (1 - share) + last * share
        parts.append(make_cylinder([x, y, z], [x, y, z + 0.95], 0.010, 6))
    for height in np.linspace(0.95, 0.15, num_rails + 1)[:num_rails]:
        rise = [0.0, 0.0, height]
        parts.append(make_cylinder(first + rise, last + rise, 0.022, 8))
    return joined(parts)


def make_upper_floor(
    flight: Flight, length: float, *, left: float = 0.0, right: float = 0.0, setback: float = 0.0
) -> TriangleMesh:
    """Return a slab behind a flight's top nosing, ``left`` and ``right`` m wider than the flight.

    A ``setback``, m, of the overhang keeps the slab's front from filling what the top nosing overhangs.
    """
    half = flight.width / 2
    top = (flight.steps[-1].nosing.mean(axis=0) - flight.base) @ flight.map_from_flight[:3, :3]
    # 1 mm behind the nosing, so that its front does not lie in the plane of the last riser.
    front = top[0] + setback + 0.001
    slab = make_block([front, -half - right, top[2] - 0.25], [top[0] + length, half + left, top[2]])
    return slab.transformed(flight.map_from_flight)


def _distance_to_route(place: Float64Array, route: Route) -> float:
    points = route.waypoints[:, :2]
    best = np.inf
    for start, end in pairwise(points):
        leg = end - start
        share = float(np.clip((place - start) @ leg / max(float(leg @ leg), 1e-12), 0, 1))
        best = min(best, float(np.linalg.norm(place - start - share * leg)))
    return best
