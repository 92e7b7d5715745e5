"""Triangle meshes, and the few solids that simulated scenes are made of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import IntArray, Points, Transform, readonly
from stairmap.transforms import transform_points


@dataclass(frozen=True, slots=True, kw_only=True)
class TriangleMesh:
    """Triangles over shared vertices.

    Attributes
    ----------
    vertices
        (V, 3) points, m.
    triangles
        (T, 3) int64 indices of vertices.
    """

    vertices: Points
    triangles: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", readonly(self.vertices).reshape(-1, 3))
        object.__setattr__(self, "triangles", readonly(self.triangles, np.int64).reshape(-1, 3))

    def transformed(self, destination_from_source: Transform) -> TriangleMesh:
        """Return the mesh in another coordinate frame."""
        vertices = transform_points(destination_from_source, self.vertices)
        return TriangleMesh(vertices=vertices, triangles=self.triangles)


def joined(meshes: Iterable[TriangleMesh]) -> TriangleMesh:
    """Return one mesh of all triangles, in the order given; empty for none."""
    vertices, triangles, count = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        triangles.append(mesh.triangles + count)
        count += len(mesh.vertices)
    return TriangleMesh(vertices=np.concatenate(vertices), triangles=np.concatenate(triangles))


def make_prism(profile: ArrayLike, y_min: float, y_max: float) -> TriangleMesh:
    """Extrude a convex polygon of the xz plane along y.

    Parameters
    ----------
    profile
        (N, 2) corners (x, z) in order, m.
    y_min, y_max
        Ends of the extrusion, m.
    """
    corners = np.asarray(profile, dtype=np.float64)
    num = len(corners)
    vertices = np.empty((2 * num, 3))
    vertices[:, 0], vertices[:, 2] = np.tile(corners[:, 0], 2), np.tile(corners[:, 1], 2)
    vertices[:num, 1], vertices[num:, 1] = y_min, y_max
    triangles = []
    for i in range(num):
        j = (i + 1) % num
        triangles += [(i, j, num + j), (i, num + j, num + i)]
    for i in range(1, num - 1):
        triangles += [(0, i, i + 1), (num, num + i, num + i + 1)]
    return TriangleMesh(vertices=vertices, triangles=np.array(triangles))


def make_block(lower: ArrayLike, upper: ArrayLike) -> TriangleMesh:
    """Return an axis-parallel box between two (3,) corners, m."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    return make_prism([(x0, z0), (x1, z0), (x1, z1), (x0, z1)], float(y0), float(y1))


def make_turned_block(center: ArrayLike, size: ArrayLike, yaw: float) -> TriangleMesh:
    """Return a box of (3,) size about a (3,) centre, turned by ``yaw`` rad about z."""
    half = np.asarray(size, dtype=np.float64) / 2
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.eye(4)
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    turn[:3, 3] = center
    return make_block(-half, half).transformed(turn)


def make_rectangle(lower: ArrayLike, upper: ArrayLike, z: float) -> TriangleMesh:
    """Return a level rectangle between two (2,) corners at height ``z``, m."""
    (x0, y0), (x1, y1) = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    vertices = np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])
    return TriangleMesh(vertices=vertices, triangles=np.array([(0, 1, 2), (0, 2, 3)]))


def make_wall(start: ArrayLike, end: ArrayLike, z_min: float, z_max: float) -> TriangleMesh:
    """Return an upright rectangle between two (2,) points of the plan, without thickness, m."""
    (x0, y0), (x1, y1) = np.asarray(start, np.float64), np.asarray(end, np.float64)
    vertices = np.array([(x0, y0, z_min), (x1, y1, z_min), (x1, y1, z_max), (x0, y0, z_max)])
    return TriangleMesh(vertices=vertices, triangles=np.array([(0, 1, 2), (0, 2, 3)]))


def make_cylinder(start: ArrayLike, end: ArrayLike, radius: float, num_sides: int = 16) -> TriangleMesh:
    """Return a capped cylinder between two (3,) points, m; also rods and rungs."""
    first, last = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = (last - first) / np.linalg.norm(last - first)
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
    angle = np.arange(num_sides) * 2 * np.pi / num_sides
    ring = radius * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(axis, side))
    triangles = []
    for i in range(num_sides):
        j = (i + 1) % num_sides
        triangles += [(i, j, num_sides + j), (i, num_sides + j, num_sides + i)]
    for i in range(1, num_sides - 1):
        triangles += [(0, i, i + 1), (num_sides, num_sides + i, num_sides + i + 1)]
    return TriangleMesh(vertices=np.concatenate([first + ring, last + ring]), triangles=np.array(triangles))
