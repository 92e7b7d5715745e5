"""What the simulated robot believes of its own motion, one small move after the other.

The error model is that of ``stairmap.simulation.odometry``, which works on whole drives; here the drive is
not known beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.exploration.state_file import State
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

    @classmethod
    def from_row(cls, row: Sequence[float] | Float64Array) -> Planar:
        """Return the pose of (4,) x, y, z, heading.

        Raises
        ------
        ValueError
            If these are not four finite numbers.
        """
        x, y, z, heading = (float(value) for value in row)
        if not all(math.isfinite(value) for value in (x, y, z, heading)):
            raise ValueError(f"a pose is {x}, {y}, {z}, {heading}")
        return cls(x=x, y=y, z=z, heading=heading)


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
        square = trans * NOISE_STEP
        noise = self._random.standard_normal(3)
        # A step aside or backwards is no turn: only turns of the body disturb the heading.
        drift = self._drift * trans / 2
        rot1 = math.sqrt(a2 * square) * noise[0] + drift
        rot2 = turn + math.sqrt(a1 * turn**2 + a2 * square) * noise[1] + drift
        trans = trans * self._scale + math.sqrt(a3 * square + a4 * turn**2) * noise[2]
        direction = math.atan2(left, forward)
        heading = self.pose.heading + rot1
        self.pose = Planar(
            x=self.pose.x + trans * math.cos(heading + direction),
            y=self.pose.y + trans * math.sin(heading + direction),
            z=z,
            heading=heading + rot2,
        )

    def state(self) -> State:
        """Return the pose, this drive's own errors and where the draws are, to go on from."""
        return {
            "pose": self.pose.to_row(),
            "scale": self._scale,
            "drift": self._drift,
            "tilt_error": self._tilt_error.copy(),
            "random": self._random.bit_generator.state,
        }

    def restore(self, state: State) -> None:
        """Go on from a state.

        Raises
        ------
        ValueError, TypeError
            If it is none.
        """
        self.pose = Planar.from_row(state["pose"])
        self._scale, self._drift = float(state["scale"]), float(state["drift"])
        self._tilt_error = np.array(state["tilt_error"], dtype=np.float64).reshape(2)
        self._random.bit_generator.state = state["random"]

    def attitude(self, true: Float64Array, seconds: float) -> Float64Array:
        """Return the (3,) roll, pitch and bounce that an IMU gives, so many s after it was last asked."""
        keep = math.exp(-seconds / self._model.tilt_memory)
        step = self._model.tilt_std * math.sqrt(max(1 - keep**2, 0.0))
        self._tilt_error = keep * self._tilt_error + step * self._random.standard_normal(2)
        believed = true.copy()
        believed[:2] += self._tilt_error
        return believed
