"""Points of a cloud in the axes of a flight: s up the stairs and level, t to the left, z up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Points, Vector, readonly


@dataclass(frozen=True, slots=True, kw_only=True)
class StairAxes:
    """Axes of a flight in a cloud with z up.

    Attributes
    ----------
    origin
        (3,) where s = t = z = 0, m.
    heading
        Direction of s in the xy plane, rad.
    """

    origin: Vector
    heading: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "origin", readonly(self.origin))

    @property
    def forward(self) -> Vector:
        """(3,) unit vector of s."""
        return np.array([np.cos(self.heading), np.sin(self.heading), 0.0])

    @property
    def left(self) -> Vector:
        """(3,) unit vector of t."""
        return np.array([-np.sin(self.heading), np.cos(self.heading), 0.0])

    def from_cloud(self, points: Points) -> Float64Array:
        """Return (N, 3) s, t, z of points, m."""
        offset = np.asarray(points, dtype=np.float64) - self.origin
        return np.column_stack([offset @ self.forward, offset @ self.left, offset[:, 2]])

    def to_cloud(self, points: Points) -> Points:
        """Return (..., 3) points of the cloud, m."""
        return np.asarray(
            self.origin
            + points[..., :1] * self.forward
            + points[..., 1:2] * self.left
            + points[..., 2:] * [0, 0, 1.0]
        )
