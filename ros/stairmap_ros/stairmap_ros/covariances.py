"""Standard deviations of a flight as the covariance matrices that messages carry. No ROS in here."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.stairway import Flight


def measures_covariance(flight: Flight) -> Float64Array:
    """Return the (4, 4) covariance of (rise, run, width, pitch), m and rad.

    Rise, run and width are estimated apart from each other; pitch = atan2(rise, run) follows from the
    first two, to first order: d pitch = (run d rise - rise d run) / (rise² + run²).
    """
    jacobian = np.zeros((4, 3))
    jacobian[:3] = np.eye(3)
    length_squared = flight.rise**2 + flight.run**2
    jacobian[3] = flight.run / length_squared, -flight.rise / length_squared, 0.0
    variances = np.array([flight.std.rise, flight.std.run, flight.std.width]) ** 2
    return jacobian @ np.diag(variances) @ jacobian.T


def pose_covariance(flight: Flight) -> Float64Array:
    """Return the (6, 6) covariance of (x, y, z, rotation about x, y, z), m² and rad².

    A flight is level by definition: its rotations about x and y have no variance.
    """
    deviations = np.concatenate([flight.std.base, [0.0, 0.0, flight.std.heading]])
    return np.diag(deviations**2)
