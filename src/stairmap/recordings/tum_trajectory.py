"""Trajectories as TUM text files: ``stamp_s tx ty tz qx qy qz qw``, one pose a line.

A pose is ``map_from_camera`` of the optical coordinate frame (x right, y down,
z forward): translation in metres, unit quaternion with the scalar last.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.errors import TrajectoryError
from stairmap.input_files import quoted, read_lines, shown
from stairmap.output_files import write_whole_text
from stairmap.recordings.stamped_table import (
    StampedRow,
    load_stamped_table,
    parse_stamped_table,
    text_from_stamp_ns,
)
from stairmap.trajectory import Trajectory
from stairmap.transforms import MAX_COORDINATE, quat_from_rotation, rotation_from_quat

TUM_COLUMNS = "stamp_s tx ty tz qx qy qz qw"
"""The columns of a line."""

TUM_HEADER = f"# {TUM_COLUMNS} (map_from_camera, optical frame, m)\n"
"""First line of the files written here."""

QUAT_NORM_TOLERANCE = 1e-2
"""How far a quaternion's length may be from one: files with three decimals pass, other columns do not."""


def load_tum_trajectory(path: Path) -> Trajectory:
    """Read a trajectory in the TUM format.

    Lines are ``stamp_s tx ty tz qx qy qz qw``: seconds, metres, unit quaternion with the scalar last. They
    are poses of the camera's optical coordinate frame in the map. ``#`` starts a comment.

    Raises
    ------
    TrajectoryError
        If the file cannot be read, holds no pose, or a line has another number of columns, a value that is
        not a finite number, a quaternion that is not of unit length, a coordinate beyond 10,000 km, or a
        stamp that is not after the one before. The message names file and line.
    """
    return _trajectory_from_rows(load_stamped_table(path, TUM_COLUMNS, error_type=TrajectoryError), path)


def load_unfinished_trajectory(path: Path) -> Trajectory | None:
    """Read a trajectory that grows line by line, without a last line that was cut off; ``None`` for no pose.

    Raises
    ------
    TrajectoryError
        See ``load_tum_trajectory``.
    """
    text = "".join(f"{line}\n" for line, is_whole in read_lines(path, error_type=TrajectoryError) if is_whole)
    rows = parse_stamped_table(text, TUM_COLUMNS, place=str(path), error_type=TrajectoryError)
    return _trajectory_from_rows(rows, path) if rows else None


def _trajectory_from_rows(rows: tuple[StampedRow, ...], path: Path) -> Trajectory:
    if not rows:
        raise TrajectoryError(f"expected poses '{TUM_COLUMNS}' in {shown(path)}, but it has none")
    values = np.array([_numbers(row) for row in rows])
    positions, quats = values[:, :3], values[:, 3:]
    _check_positions(positions, rows)
    _check_quats(quats, rows)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3] = rotation_from_quat(quats)
    poses[:, :3, 3] = positions
    return Trajectory(stamps_ns=np.array([row.stamp_ns for row in rows]), map_from_camera=poses)


def dump_tum_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write a trajectory; stamps are exact, positions to a nanometre.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_whole_text(path, tum_text(trajectory))


def tum_text(trajectory: Trajectory) -> str:
    """Return the text of a trajectory's file."""
    lines = [
        tum_line(int(stamp_ns), pose)
        for stamp_ns, pose in zip(trajectory.stamps_ns, trajectory.map_from_camera, strict=True)
    ]
    return TUM_HEADER + "".join(lines)


def tum_line(stamp_ns: int, map_from_camera: Transform) -> str:
    """Return the line of one (4, 4) pose."""
    position = " ".join(f"{value:.9f}" for value in map_from_camera[:3, 3])
    quat = " ".join(f"{value:.12f}" for value in quat_from_rotation(map_from_camera[:3, :3]))
    return f"{text_from_stamp_ns(stamp_ns)} {position} {quat}\n"


def _numbers(row: StampedRow) -> list[float]:
    numbers = []
    for cell in row.cells:
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise TrajectoryError(f"{row.place}: expected finite numbers '{TUM_COLUMNS}', got {quoted(cell)}")
        numbers.append(number)
    return numbers


def _check_positions(positions: Float64Array, rows: tuple[StampedRow, ...]) -> None:
    far = np.flatnonzero(np.abs(positions).max(axis=1) > MAX_COORDINATE)
    if len(far):
        raise TrajectoryError(
            f"{rows[far[0]].place}: expected a position in metres within {MAX_COORDINATE:g} m of the map's "
            f"origin, got {np.abs(positions[far[0]]).max():g} m"
        )


def _check_quats(quats: Float64Array, rows: tuple[StampedRow, ...]) -> None:
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(quats, axis=1)
    wrong = np.flatnonzero(~(np.abs(lengths - 1) <= QUAT_NORM_TOLERANCE))
    if len(wrong):
        raise TrajectoryError(
            f"{rows[wrong[0]].place}: expected a unit quaternion qx qy qz qw, got one of length "
            f"{lengths[wrong[0]]:.3g}; check the order of the columns"
        )
