"""Where a camera stands and which way it looks, as poses in the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Transform
from stairmap.simulation.robots import OPTICAL_FROM_BODY_AXES
from stairmap.transforms import rotation_from_vector, transform_from_parts


def look_along(eye: ArrayLike, direction: ArrayLike, *, roll: float = 0.0) -> Transform:
    """Return the (4, 4) ``map_from_camera`` of a camera that looks along a direction.

    Parameters
    ----------
    eye
        (3,) place, m.
    direction
        (3,) direction of the optical axis, of any length, not straight up or down.
    roll
        Angle about the optical axis, clockwise as seen by the camera, rad; zero keeps the image's
        rows level.
    """
    x, y, z = np.asarray(direction, dtype=np.float64)
    heading, pitch = np.arctan2(y, x), np.arctan2(-z, np.hypot(x, y))
    rotation = (
        rotation_from_vector([0, 0, heading])
        @ rotation_from_vector([0, pitch, 0])
        @ rotation_from_vector([roll, 0, 0])
        @ OPTICAL_FROM_BODY_AXES
    )
    return transform_from_parts(rotation, eye)


def look_at(eye: ArrayLike, aim: ArrayLike, *, roll: float = 0.0) -> Transform:
    """Return the (4, 4) pose of a camera at (3,) ``eye`` that looks at (3,) ``aim``; see ``look_along``."""
    return look_along(eye, np.asarray(aim, np.float64) - np.asarray(eye, np.float64), roll=roll)
