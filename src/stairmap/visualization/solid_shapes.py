"""Solid shapes of stairways for a page: triangles without indices, (N, 3, 3), map, m."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Float64Array, Points
from stairmap.stairway import Flight, Landing, Stairway
from stairmap.transforms import transform_from_parts, transform_points
from stairmap.visualization.stairway_labels import ascent_arrow

SLAB = 0.12
"""How far a flight or landing is drawn to reach below its surface, m; what is under it was not seen."""

# The faces of a prism with corners 0-3 on one end and 4-7, in the same order, on the other.
_PRISM_QUADS = np.array([(0, 1, 2, 3), (7, 6, 5, 4), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)])


def stairway_solid(stairway: Stairway) -> Float64Array:
    """Return the steps and landings of a stairway as solids."""
    parts = [_flight_solid(flight) for flight in stairway.flights]
    parts += [_landing_solid(landing) for landing in stairway.landings]
    return np.concatenate(parts)


def bars(segments: Points, *, thickness: float) -> Float64Array:
    """Return square bars along (N, 2, 3) segments."""
    parts = [_bar(start, end, thickness / 2, thickness / 2) for start, end in segments]
    return np.concatenate([np.empty((0, 3, 3)), *parts])


def ascent_arrows(stairways: Sequence[Stairway]) -> Float64Array:
    """Return an arrow up each flight."""
    parts = [np.empty((0, 3, 3))]
    for stairway in stairways:
        for flight in stairway.flights:
            start, end = ascent_arrow(flight)
            along = (end - start) / np.linalg.norm(end - start)
            neck = end - 0.2 * along
            parts += [_bar(start, neck, 0.012, 0.012), _bar(neck, end, 0.05, 0.001)]
    return np.concatenate(parts)


def _flight_solid(flight: Flight) -> Float64Array:
    """One prism a step, from its tread down to a soffit that follows the pitch."""
    prisms = []
    # The last riser leads to the upper level; half a step of that level shows that one can stand there.
    for index in range(flight.num_risers):
        start = index * flight.run
        length = flight.run if index < flight.num_risers - 1 else flight.run / 2
        top = (index + 1) * flight.rise
        low = [max((x / flight.run) * flight.rise - SLAB, 0.0) for x in (start, start + length)]
        profile = [(start, low[0]), (start, top), (start + length, top), (start + length, low[1])]
        corners = [
            (x, side * flight.width / 2, z) for side in (1.0, -1.0) for x, z in profile
        ]  # left end first
        prisms.append(_prism(np.array(corners)))
    triangles = np.concatenate(prisms)
    return transform_points(flight.map_from_flight, triangles)


def _landing_solid(landing: Landing) -> Float64Array:
    length, width = landing.size
    outline = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    corners = [(x * length / 2, y * width / 2, z) for z in (0.0, -SLAB) for x, y in outline]
    cosine, sine = np.cos(landing.heading), np.sin(landing.heading)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return transform_points(transform_from_parts(rotation, landing.center), _prism(np.array(corners)))


def _bar(start: Points, end: Points, start_half: float, end_half: float) -> Float64Array:
    """Return a square bar whose thickness may change from one end to the other."""
    along = end - start
    length = np.linalg.norm(along)
    if length == 0.0:
        return np.empty((0, 3, 3))
    along = along / length
    upright = np.array([0.0, 0.0, 1.0]) if abs(along[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side = np.cross(along, upright)
    side = side / np.linalg.norm(side)
    up = np.cross(side, along)
    square = np.array([-side - up, side - up, side + up, -side + up])
    return _prism(np.concatenate([start + start_half * square, end + end_half * square]))


def _prism(corners: Points) -> Float64Array:
    quads = corners[_PRISM_QUADS]
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
