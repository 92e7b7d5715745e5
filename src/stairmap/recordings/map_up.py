"""Which axis of a map points up, and how to turn poses so that z does."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Transform, Vector
from stairmap.errors import RecordingError
from stairmap.geometry import angle_between
from stairmap.trajectory import Trajectory
from stairmap.transforms import rotation_between, transform_from_parts

UP_AUTO = "auto"
"""The map is not level: up comes from the floor, frame by frame."""

UP_AXES = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
"""What ``--up`` may name, besides ``auto``: the axis of the poses' own coordinate frame that points up."""

MAX_UP_DISAGREEMENT_DEG = 20.0
"""IMUs are a few degrees off, deg; beyond this, the map's up or the camera's is wrong."""


def check_up(up: str) -> str:
    """Return ``up`` if it is an axis or ``auto``.

    Raises
    ------
    RecordingError
        If it is anything else.
    """
    if up != UP_AUTO and up not in UP_AXES:
        raise RecordingError(f"expected --up to be one of {', '.join(UP_AXES)}, {UP_AUTO}, got {up!r}")
    return up


def map_from_recorded_with_up(up: str) -> Transform:
    """Return the (4, 4) smallest turn that makes the named axis z; identity for ``auto``."""
    if up == UP_AUTO:
        return np.eye(4)
    rotation = rotation_between(np.array(UP_AXES[up]), np.array(UP_AXES["+z"]))
    # Quarter and half turns consist of whole numbers; without rounding errors coordinates stay readable.
    return transform_from_parts(np.rint(rotation) + 0.0, np.zeros(3))


def turned_trajectory(map_from_recorded: Transform, trajectory: Trajectory) -> Trajectory:
    """Return a trajectory seen from another coordinate frame."""
    return Trajectory(
        stamps_ns=trajectory.stamps_ns,
        map_from_camera=map_from_recorded @ trajectory.map_from_camera,
    )


def find_up_disagreement(up_from_pose: Vector, up_from_camera: Vector) -> str | None:
    """Compare (3,) directions of up in the camera frame; return a sentence if they differ too much."""
    angle_deg = float(np.degrees(angle_between(up_from_pose, up_from_camera)))
    if angle_deg <= MAX_UP_DISAGREEMENT_DEG:
        return None
    return (
        f"up of the camera file and up of the map differ by {angle_deg:.0f} degrees at the first pose, and "
        f"the map's is used; if another of its axes points up, pass --up ({', '.join(UP_AXES)}, {UP_AUTO})"
    )
