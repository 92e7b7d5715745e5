"""Exact depth images of triangle meshes, by ray casting with embree.

Embree works in float32. It only says which triangle a ray meets first; the depth
is then computed in float64 from that triangle's plane, so that an ideal sensor
agrees with the exact plane wherever the scene lies.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform, Vector
from stairmap.camera import PinholeCamera
from stairmap.errors import MissingPackageError
from stairmap.simulation.triangle_mesh import TriangleMesh
from stairmap.transforms import transform_points

_TOUCHING = 2e-3
"""Relative distance in front of a point that does not count as hiding it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendering:
    """What a perfect camera would see.

    Attributes
    ----------
    camera
        The camera that looked.
    map_from_camera
        (4, 4) its pose.
    depth
        (height, width) float64 m along the optical axis, NaN where no surface is.
    normals
        (height, width, 3) unit normals in the camera frame, towards the camera, NaN without a surface.
    incidence
        (height, width) angle between ray and normal, 0 to pi/2 rad, NaN without a surface.
    triangle_ids
        (height, width) int64 index of the triangle seen, -1 without a surface.
    caster
        The scene, for second rays.
    """

    camera: PinholeCamera
    map_from_camera: Transform
    depth: Float64Array
    normals: Points
    incidence: Float64Array
    triangle_ids: IntArray
    caster: RayCaster

    def is_lit(self, lamp: Vector) -> Mask:
        """Tell which pixels see a surface that a (3,) lamp in the camera frame, m, also sees."""
        points = self.camera.unproject(self.depth.astype(np.float32)).reshape(-1, 3)
        seen = np.isfinite(points[:, 2])
        lit = np.zeros(len(points), dtype=bool)
        lit[seen] = self.caster.is_visible(
            transform_points(self.map_from_camera, lamp),
            transform_points(self.map_from_camera, points[seen]),
        )
        return lit.reshape(self.depth.shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class RayHits:
    """What rays meet first.

    Attributes
    ----------
    distance
        (N,) along the ray, m, NaN where nothing is.
    incidence
        (N,) angle between ray and normal, 0 to pi/2 rad, NaN without a surface.
    triangle_ids
        (N,) int64 index of the triangle, -1 without a surface.
    """

    distance: Float64Array
    incidence: Float64Array
    triangle_ids: IntArray


def check_ray_caster() -> None:
    """Miss the package for ray casting before the work begins.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """
    _make_embree_scene(np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]))


class RayCaster:
    """A scene prepared for ray casting.

    Parameters
    ----------
    mesh
        The scene in map coordinates.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        if len(mesh.triangles) == 0:
            raise ValueError("a scene needs at least one triangle, got none")
        # float32 resolves 4 um at 50 m: rays are cast about the middle of the scene.
        self._origin = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
        corners = (mesh.vertices - self._origin)[mesh.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1)
        kept = lengths > 1e-12
        self._triangle_ids = np.flatnonzero(kept)
        self._normals = normals[kept] / lengths[kept, None]
        self._offsets = np.einsum("ij,ij->i", self._normals, corners[kept].mean(axis=1))
        self._scene = _make_embree_scene(corners[kept])

    def render(self, camera: PinholeCamera, map_from_camera: Transform) -> Rendering:
        """Return what a camera at a (4, 4) pose sees."""
        rays = _flat_rays(camera)
        rotation = map_from_camera[:3, :3]
        position = map_from_camera[:3, 3] - self._origin
        directions = (rays @ rotation.T).astype(np.float32)
        origins = np.broadcast_to(position.astype(np.float32), directions.shape).copy()
        hits = np.asarray(self._scene.run(origins, directions))
        missed = hits < 0
        hits = np.where(missed, 0, hits)
        normals = (self._normals @ rotation)[hits]
        cosine = np.einsum("ij,ij->i", normals, rays)
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = (self._offsets - self._normals @ position)[hits] / cosine
        # A triangle seen edge on has a plane that the ray does not meet in front of the camera.
        missed |= ~(depth > 0) | ~np.isfinite(depth)
        depth[missed] = np.nan
        normals *= -np.sign(cosine)[:, None]
        normals[missed] = np.nan
        incidence = np.arccos(np.minimum(np.abs(cosine) / _flat_ray_lengths(camera), 1.0))
        incidence[missed] = np.nan
        shape = (camera.height, camera.width)
        return Rendering(
            camera=camera,
            map_from_camera=map_from_camera,
            depth=depth.reshape(shape),
            normals=normals.reshape(*shape, 3),
            incidence=incidence.reshape(shape),
            triangle_ids=np.where(missed, -1, self._triangle_ids[hits]).reshape(shape),
            caster=self,
        )

    def cast(self, origins: Points, directions: Points) -> RayHits:
        """Return what rays meet first.

        Parameters
        ----------
        origins
            (N, 3) where they begin, map, m.
        directions
            (N, 3) unit vectors, map.
        """
        start = origins - self._origin
        hits = np.asarray(self._scene.run(start.astype(np.float32), directions.astype(np.float32)))
        missed = hits < 0
        hits = np.where(missed, 0, hits)
        normals = self._normals[hits]
        cosine = np.einsum("ij,ij->i", normals, directions)
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (self._offsets[hits] - np.einsum("ij,ij->i", normals, start)) / cosine
        # As in ``render``: a triangle seen edge on has a plane that the ray does not meet.
        missed |= ~(distance > 0) | ~np.isfinite(distance)
        distance[missed] = np.nan
        incidence = np.arccos(np.minimum(np.abs(cosine), 1.0))
        incidence[missed] = np.nan
        triangle_ids = np.where(missed, -1, self._triangle_ids[hits])
        return RayHits(distance=distance, incidence=incidence, triangle_ids=triangle_ids)

    def distances(self, origins: Points, directions: Points, max_distance: float) -> Float64Array:
        """Return how far (N, 3) unit rays in the map go before they meet a surface, m.

        Infinite where nothing is met within ``max_distance``.
        """
        starts = np.ascontiguousarray(np.asarray(origins) - self._origin, dtype=np.float32)
        rays = np.ascontiguousarray(np.broadcast_to(directions, starts.shape), dtype=np.float32)
        limits = np.full(len(starts), max_distance, dtype=np.float32)
        found = np.asarray(self._scene.run(starts, rays, limits, query="DISTANCE"), dtype=np.float64)
        # Where nothing is met embree gives the limit back, in float32.
        return np.where((found >= 0) & (found < float(np.float32(max_distance))), found, np.inf)

    def is_visible(self, eye: Vector, points: Points) -> Mask:
        """Tell which of (N, 3) map points nothing hides from a (3,) eye in the map.

        What lies within 0.2 % of the distance in front of a point does not hide it.
        """
        origin = (np.asarray(eye) - self._origin).astype(np.float32)
        directions = np.ascontiguousarray(points - np.asarray(eye), dtype=np.float32)
        origins = np.broadcast_to(origin, directions.shape).copy()
        limits = np.full(len(directions), 1 - _TOUCHING, dtype=np.float32)
        hits: Mask = np.asarray(self._scene.run(origins, directions, limits, query="OCCLUDED")) < 0
        return hits


def _make_embree_scene(corners: Points) -> Any:
    try:
        from embreex.mesh_construction import TriangleMesh as EmbreeMesh  # noqa: PLC0415
        from embreex.rtcore_scene import EmbreeScene  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError(
            "embreex", "sim", "simulating a depth camera", no_wheel_on=("aarch64",)
        ) from error
    scene = EmbreeScene()
    EmbreeMesh(scene, np.ascontiguousarray(corners, dtype=np.float32))
    return scene


@functools.lru_cache(maxsize=8)
def _flat_rays(camera: PinholeCamera) -> Points:
    return camera.rays().reshape(-1, 3)


@functools.lru_cache(maxsize=8)
def _flat_ray_lengths(camera: PinholeCamera) -> Float64Array:
    return np.asarray(np.linalg.norm(_flat_rays(camera), axis=1))
