"""One depth image with its stamp and its camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import DepthImage, Points, Vector, readonly
from stairmap.camera import PinholeCamera
from stairmap.geometry import normalized


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthFrame:
    """One depth image as a detector sees it.

    Attributes
    ----------
    stamp_ns
        When it was taken, in nanoseconds.
    depth
        (height, width) float32 metres along the optical axis, NaN where nothing was measured.
    camera
        The camera that took it; its size is the image's.
    up
        (3,) unit vector opposite to gravity, camera frame; ``None`` if it is not known.
    up_std
        Standard deviation of the direction of ``up``, rad; ``None``: as accurate as an IMU tells it.

    Raises
    ------
    ValueError
        If the image's size is not the camera's, or ``up`` is not three finite numbers, or all zero.
    """

    stamp_ns: int
    depth: DepthImage
    camera: PinholeCamera
    up: Vector | None = None
    up_std: float | None = None

    def __post_init__(self) -> None:
        depth = np.ascontiguousarray(self.depth, dtype=np.float32).view()
        depth.flags.writeable = False
        expected = (self.camera.height, self.camera.width)
        if depth.shape != expected:
            raise ValueError(f"depth image has shape {depth.shape}, its camera says {expected}")
        object.__setattr__(self, "depth", depth)
        if self.up is not None:
            if np.shape(self.up) != (3,):
                raise ValueError(f"expected up as three numbers (x, y, z), got shape {np.shape(self.up)}")
            object.__setattr__(self, "up", readonly(normalized(self.up)))

    def points(self) -> Points:
        """Return the (height, width, 3) points of the image in the camera frame, in metres."""
        return self.camera.unproject(self.depth)
