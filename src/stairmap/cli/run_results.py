"""What a run folder tells of a building: its stairways, the robot's way, its floors."""

from __future__ import annotations

from pathlib import Path

from stairmap.export.loading import RunResults
from stairmap.navigation.floors import FloorStack, find_floors
from stairmap.recordings.tum_trajectory import load_tum_trajectory
from stairmap.trajectory import Trajectory


def load_run_trajectory(run: Path) -> Trajectory | None:
    """Return the way that a run folder keeps beside its stairways; ``None`` where there is none.

    Raises
    ------
    TrajectoryError
        If it cannot be read.
    """
    path = (run if run.is_dir() else run.parent) / "trajectory.tum"
    return load_tum_trajectory(path) if path.is_file() else None


def load_run_floors(run: Path, results: RunResults, *, camera_height: float | None = None) -> FloorStack:
    """Return the floors of a run.

    Raises
    ------
    StairmapError
        If the trajectory cannot be read, or nothing tells of a floor.
    """
    return find_floors(results.stairways, load_run_trajectory(run), camera_height=camera_height)
