"""Clouds for tests: points drawn evenly from the surfaces of simulated scenes, with noise."""

from __future__ import annotations

import functools

import numpy as np

from stairmap.arrays import Points
from stairmap.simulation.scenes import make_scene
from stairmap.simulation.triangle_mesh import TriangleMesh
from stairmap.stairway import Flight

REACH = 4.0
"""Points farther from a scene's flight than this are left out, m: tests need no whole hall."""


def sample_mesh(mesh: TriangleMesh, *, density: float, noise: float, seed: int = 0) -> Points:
    """Draw (N, 3) points from a mesh, ``density`` per square metre, each moved by noise, m."""
    random = np.random.default_rng(seed)
    corners = mesh.vertices[mesh.triangles]
    sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * np.linalg.norm(np.cross(*sides), axis=1)
    num = int(areas.sum() * density)
    chosen = random.choice(len(areas), num, p=areas / areas.sum())
    share = random.random((num, 2))
    outside = share.sum(axis=1) > 1
    share[outside] = 1 - share[outside]
    points = corners[chosen, 0] + share[:, :1] * sides[0][chosen] + share[:, 1:] * sides[1][chosen]
    return np.asarray(points + random.normal(0, noise, points.shape))


@functools.lru_cache(maxsize=4)
def sampled_scene(
    name: str, *, seed: int = 1, density: float = 2000.0, noise: float = 0.003
) -> tuple[Points, list[Flight]]:
    """Return a cloud of a simulated scene, and its flights."""
    scene = make_scene(name, seed)
    flights = [flight for stairway in scene.stairways for flight in stairway.flights]
    points = sample_mesh(scene.mesh, density=density, noise=noise, seed=seed)
    for flight in flights[:1]:
        points = points[np.hypot(*(points[:, :2] - flight.base[:2]).T) < REACH]
    return points, flights
