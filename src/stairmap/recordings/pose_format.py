"""How poses are written, where it is not ``map_from_camera`` of the optical frame, x y z w, in metres."""

from __future__ import annotations

import numpy as np

from stairmap.errors import RecordingError, TrajectoryError
from stairmap.input_files import quoted
from stairmap.trajectory import Trajectory
from stairmap.transforms import (
    invert_transforms,
    quat_from_rotation,
    rotation_from_quat,
    transform_from_parts,
)

WXYZ, MILLIMETRES, INVERSE, BODY = "wxyz", "mm", "inverse", "body"

POSE_FORMATS = {
    WXYZ: "the quaternion is qw qx qy qz",
    MILLIMETRES: "positions are in millimetres",
    INVERSE: "a pose takes points of the map into the camera",
    BODY: "the camera's frame is x forward, y left, z up",
}
"""What ``--pose-format`` may name, in the order in which it is undone, and what it means."""

BODY_FROM_OPTICAL = transform_from_parts(
    np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.zeros(3)
)
"""(4, 4) turn of x right, y down, z forward into x forward, y left, z up (REP 103)."""


def check_pose_format(text: str) -> tuple[str, ...]:
    """Return the names in a text such as ``wxyz,mm``, in the order in which they are undone.

    Raises
    ------
    RecordingError
        If one is not known.
    """
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in POSE_FORMATS:
            raise RecordingError(
                f"expected --pose-format to be of {', '.join(POSE_FORMATS)}, several joined by commas, got "
                f"{quoted(text)}"
            )
    return tuple(name for name in POSE_FORMATS if name in names)


def trajectory_from_format(trajectory: Trajectory, pose_format: str | None) -> Trajectory:
    """Return poses that were read as usual but are written in another way, as they are meant.

    Parameters
    ----------
    trajectory
        As read.
    pose_format
        Names of ``POSE_FORMATS`` joined by commas; ``None`` for the usual one.

    Raises
    ------
    RecordingError
        If a name is not known.
    """
    if pose_format is None:
        return trajectory
    poses = trajectory.map_from_camera
    for name in check_pose_format(pose_format):
        poses = poses_from_format(poses, name)
    return Trajectory(stamps_ns=trajectory.stamps_ns, map_from_camera=poses)


def poses_from_format(poses: np.ndarray, name: str) -> np.ndarray:
    """Return (N, 4, 4) poses that are written in the way of this name as they are meant."""
    meant = poses.copy()
    if name == WXYZ:
        quats = np.array([quat_from_rotation(pose[:3, :3]) for pose in poses]).reshape(-1, 4)
        meant[:, :3, :3] = rotation_from_quat(quats[:, [1, 2, 3, 0]])
    elif name == MILLIMETRES:
        meant[:, :3, 3] *= 1e-3
    elif name == INVERSE:
        meant = invert_transforms(poses)
    elif name == BODY:
        meant = poses @ BODY_FROM_OPTICAL
    return meant


def check_has_poses(trajectory: Trajectory | None, pose_format: str | None) -> None:
    """Refuse a format of poses where there are none.

    Raises
    ------
    TrajectoryError
        If it is so.
    """
    if trajectory is None and pose_format is not None:
        raise TrajectoryError(
            f"--pose-format {pose_format} says how poses are written, but there are none; "
            "pass --trajectory FILE"
        )
