"""Poses in a map with z up, as ``--up`` asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Transform
from stairmap.map_levelling import find_map_levelling
from stairmap.recordings.base import Recording
from stairmap.recordings.map_up import UP_AUTO, turned_trajectory
from stairmap.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelMap:
    """Poses in a map with z up.

    Attributes
    ----------
    trajectory
        ``map_from_camera``.
    map_from_recorded
        (4, 4) turn of the coordinate frame of the poses as recorded.
    note
        A sentence about that turn; ``None`` without one.
    """

    trajectory: Trajectory
    map_from_recorded: Transform
    note: str | None


def find_level_map(recording: Recording, up: str | None, *, max_depth: float) -> LevelMap:
    """Return the poses of a recording in a map with z up.

    Parameters
    ----------
    recording
        Opened with ``up``.
    up
        What ``--up`` says.
    max_depth
        Farthest depth at which the floor is looked for, m.

    Raises
    ------
    TrajectoryError
        If there are no poses, or the floor is asked and does not tell.
    """
    trajectory = recording.check_poses()
    turn = recording.map_from_recorded
    if up == UP_AUTO:
        levelling = find_map_levelling(recording, trajectory, max_depth=max_depth)
        return LevelMap(
            trajectory=turned_trajectory(levelling.map_from_recorded, trajectory),
            map_from_recorded=levelling.map_from_recorded @ turn,
            note=str(levelling),
        )
    is_turned = not np.array_equal(turn, np.eye(4))
    note = f"the map was turned so that its {up} axis is z; all results are in the turned map"
    return LevelMap(trajectory=trajectory, map_from_recorded=turn, note=note if is_turned else None)
