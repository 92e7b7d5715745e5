"""Single rays through a scene, for tests of its geometry."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Vector
from stairmap.camera import PinholeCamera
from stairmap.simulation.render import RayCaster
from stairmap.transforms import rotation_between, transform_from_parts

ONE_PIXEL = PinholeCamera(width=1, height=1, fx=1.0, fy=1.0, cx=0.0, cy=0.0)


def cast_ray(caster: RayCaster, start: ArrayLike, direction: ArrayLike) -> Vector:
    """Return the (3,) first point of a scene along a ray, NaN where it meets nothing."""
    along = np.asarray(direction, np.float64)
    along = along / np.linalg.norm(along)
    pose = transform_from_parts(rotation_between(np.array([0.0, 0.0, 1.0]), along), start)
    depth = float(caster.render(ONE_PIXEL, pose).depth[0, 0])
    return np.asarray(np.asarray(start, np.float64) + depth * along)


def height_below(caster: RayCaster, x: float, y: float, z: float) -> float:
    """Return the height of the first surface below a point, m."""
    return float(cast_ray(caster, [x, y, z], [0.0, 0.0, -1.0])[2])
