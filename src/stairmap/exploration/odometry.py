"""What the simulated robot believes of its own motion, one small move after the other.

The error model is that of ``stairmap.simulation.odometry``, which works on whole drives; here the drive is
not known beforehand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.simulation.odometry import PERFECT_ODOMETRY, OdometryModel

NOISE_STEP = 0.1
"""Length of the step that the model's alphas are given for, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Planar:
    """A place on the ground and a heading: x, y, height of the ground (m) and heading (rad)."""

    x: float
    y: float
    z: float
    heading: float

    @property
    def place(self) -> Float64Array:
        """(3,) the place, m."""
        return np.array([self.x, self.y, self.z])

    @property
    def forward(self) -> Float64Array:
        """(3,) level unit vector ahead."""
        return np.array([math.cos(self.heading), math.sin(self.heading), 0.0])

    def to_row(self) -> Float64Array:
        """(4,) x, y, z, heading."""
        return np.array([self.x, self.y, self.z, self.heading])


class RunningOdometry:
    """Integrates moves with error.

    Parameters
    ----------
    start
        Where the robot begins; odometry begins there too.
    model
        Its errors; ``PERFECT_ODOMETRY`` has none.
    random
        Draws them.
    """

    def __init__(self, start: Planar, model: OdometryModel, random: np.random.Generator) -> None:
        self.pose, self._model, self._random = start, model, random
        self._scale = 1 + model.scale_bias * random.standard_normal()
        self._drift = model.heading_bias * random.standard_normal()
        self._tilt_error = np.zeros(2)

    @property
    def is_perfect(self) -> bool:
        """Whether it makes no error."""
        return self._model == PERFECT_ODOMETRY

    def move(self, forward: float, left: float, turn: float, z: float) -> None:
        """Take in a true move: m ahead and to the left, then a turn, rad, to ground at height z, m."""
        a1, a2, a3, a4 = self._model.alphas
        trans = math.hypot(forward, left)
        rot1 = math.atan2(left, forward) if trans > 1e-6 else 0.0
        # Backwards is a negative way, not a turn about.
        if abs(rot1) > math.pi / 2:
            rot1, trans = rot1 - math.copysign(math.pi, rot1), -trans
        rot2 = turn - rot1
        noise = self._random.standard_normal(3)
        square = abs(trans) * NOISE_STEP
        rot1 += math.sqrt(a1 * rot1**2 + a2 * square) * noise[0] + self._drift * abs(trans) / 2
        rot2 += math.sqrt(a1 * rot2**2 + a2 * square) * noise[1] + self._drift * abs(trans) / 2
        trans = trans * self._scale + math.sqrt(a3 * square + a4 * (rot1**2 + rot2**2)) * noise[2]
        heading = self.pose.heading + rot1
        self.pose = Planar(
            x=self.pose.x + trans * math.cos(heading),
            y=self.pose.y + trans * math.sin(heading),
            z=z,
            heading=heading + rot2,
        )

    def attitude(self, true: Float64Array, seconds: float) -> Float64Array:
        """Return the (3,) roll, pitch and bounce that an IMU gives, so many s after it was last asked."""
        keep = math.exp(-seconds / self._model.tilt_memory)
        step = self._model.tilt_std * math.sqrt(max(1 - keep**2, 0.0))
        self._tilt_error = keep * self._tilt_error + step * self._random.standard_normal(2)
        believed = true.copy()
        believed[:2] += self._tilt_error
        return believed
