"""Which way is up, as an accelerometer says."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, Vector
from stairmap.geometry import normalized

GRAVITY = 9.81
"""m/s²."""

MAX_ACCELERATION = 1.0
"""A reading farther from gravity than this, m/s², is motion and tells nothing of up."""

MEMORY = 0.9
"""Share of the mean of earlier readings that a new one leaves."""


class UpFilter:
    """Up from an accelerometer: at rest it measures what holds the camera, which points up.

    Parameters
    ----------
    camera_from_sensor
        (3, 3) turn of readings into the camera's optical coordinate frame; identity without it.
    """

    def __init__(self, camera_from_sensor: Float64Array | None = None) -> None:
        self._camera_from_sensor = np.eye(3) if camera_from_sensor is None else camera_from_sensor
        self._mean: Float64Array | None = None

    @property
    def value(self) -> Vector | None:
        """(3,) unit vector, camera frame; ``None`` before the first useful reading."""
        return None if self._mean is None else normalized(self._mean)

    def add(self, reading: Float64Array) -> None:
        """Take in one (3,) reading, m/s²."""
        if abs(float(np.linalg.norm(reading)) - GRAVITY) > MAX_ACCELERATION:
            return
        turned = self._camera_from_sensor @ reading
        keep = MEMORY
        self._mean = turned if self._mean is None else keep * self._mean + (1 - keep) * turned
