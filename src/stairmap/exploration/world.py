"""The world that a simulated robot stands in: ground below its feet, walls beside its body.

Everything is asked of the mesh by rays, so doors, wells and furniture are what the mesh makes them.
"""

from __future__ import annotations

import math

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points, Vector
from stairmap.exploration.body import BODY_BOTTOM, Body
from stairmap.simulation.render import RayCaster
from stairmap.simulation.triangle_mesh import TriangleMesh

STEP_OVER = 0.12
"""Sills and kerbs up to this height are walked over, m; lower than any step of a stairway that counts."""

REACH_DOWN = 0.12
"""Ground that lies deeper than this is none to stand on, m."""

MIN_SUPPORT = 0.5
"""Share of the footprint that must have ground below it; with less the robot falls."""

_DIRECTIONS = 20
_HEIGHTS = 5
_RINGS = (0.45, 0.9)
"""Rings of the footprint where the ground is felt, in radii."""

_FOOT = 0.015 * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
"""Where the ground is felt under one foot, m."""

DOWN = np.array([0.0, 0.0, -1.0])


class World:
    """A mesh that a robot can stand on and run into.

    Parameters
    ----------
    mesh
        All surfaces, map coordinates, z up.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self.caster = RayCaster(mesh)
        self.low, self.high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)

    def ground(self, points: Points, *, up: float = STEP_OVER, down: float = REACH_DOWN) -> Float64Array:
        """Return the height of the ground at (N, 3) points, m; NaN where none is near.

        Parameters
        ----------
        points
            Places and about the height of the ground there, map, m.
        up, down
            How far above and below that the ground may lie, m.
        """
        starts = np.asarray(points, dtype=np.float64) - up * DOWN
        distances = self.caster.distances(starts, DOWN, up + down)
        return np.where(np.isfinite(distances), starts[:, 2] - distances, np.nan)

    def foot(self, place: Vector, *, reach: float) -> float:
        """Return the height of the ground under a foot at a (3,) place, m; NaN for none within reach.

        A foot is wider than the cracks between a mesh's parts.
        """
        heights = self.ground(place + _FOOT, up=reach, down=reach)
        return float(np.nanmedian(heights)) if np.isfinite(heights).any() else math.nan

    def support(self, place: Vector, radius: float) -> tuple[float, float]:
        """Return which share of a footprint about a (3,) place has ground, and its height (m, or NaN)."""
        points = np.concatenate([[place], place + _ring_points(radius)])
        heights = self.ground(points)
        found = np.isfinite(heights)
        height = float(np.median(heights[found])) if found.any() else math.nan
        return float(found.mean()), height

    def is_blocked(self, place: Vector, body: Body) -> bool:
        """Tell whether a surface reaches into the body of a robot at a (3,) place on the ground."""
        return bool(self._hits(place[None], body)[0])

    def are_blocked(self, places: Points, body: Body) -> Mask:
        """Tell it for (N, 3) places at once."""
        return self._hits(places, body)

    def can_pass(self, start: Vector, end: Vector, body: Body) -> bool:
        """Tell whether no surface stands between two places nearer than a body's radius."""
        way = end - start
        length = float(np.linalg.norm(way))
        if length < 1e-9:
            return True
        forward = way / length
        left = np.array([-forward[1], forward[0], 0.0])
        shifts = np.array([-0.9, -0.5, 0.0, 0.5, 0.9])[:, None] * left * body.radius
        heights = np.linspace(BODY_BOTTOM, body.top, _HEIGHTS)
        starts = (start + shifts)[:, None] + heights[:, None] * [0.0, 0.0, 1.0]
        return not np.isfinite(self.caster.distances(starts.reshape(-1, 3), forward, length)).any()

    def _hits(self, places: Points, body: Body) -> Mask:
        angles = np.arange(_DIRECTIONS) * 2 * math.pi / _DIRECTIONS
        rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
        heights = np.linspace(BODY_BOTTOM, body.top, _HEIGHTS)
        starts = places[:, None, None] + heights[None, :, None, None] * np.array([0.0, 0.0, 1.0])
        starts = np.broadcast_to(starts, (len(places), _HEIGHTS, _DIRECTIONS, 3)).reshape(-1, 3)
        directions = np.broadcast_to(rays, (len(places), _HEIGHTS, _DIRECTIONS, 3)).reshape(-1, 3)
        distances = self.caster.distances(starts, directions, body.radius)
        return np.asarray(np.isfinite(distances).reshape(len(places), -1).any(axis=1))


def _ring_points(radius: float) -> Points:
    angles = np.arange(8) * math.pi / 4
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(8)], axis=1)
    return np.concatenate([share * radius * ring for share in _RINGS])
