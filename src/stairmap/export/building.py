"""What a run folder tells of a building: its stairways, the robot's way, its floors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from stairmap.drop import Drop
from stairmap.export.loading import load_run_trajectory, load_stairways
from stairmap.navigation.floors import FloorStack, find_floors
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """What a run tells of a building.

    Attributes
    ----------
    stairways
        Each joins two floors.
    drops
        Where its floors end and go on lower.
    floors
        Its floors.
    trajectory
        The robot's way; ``None`` where the run folder has none.
    frame_id
        Coordinate frame of all positions.
    """

    stairways: tuple[Stairway, ...]
    drops: tuple[Drop, ...]
    floors: FloorStack
    trajectory: Trajectory | None
    frame_id: str


def load_building(run: Path, *, camera_height: float | None = None) -> Building:
    """Read a run folder, or its ``stairways.json`` and the trajectory beside it.

    Parameters
    ----------
    run
        The folder or file.
    camera_height
        Height of the camera above the floor, m; ``None``: as the run saw it.

    Raises
    ------
    StairmapError
        If a file cannot be read, or nothing tells of a floor.
    """
    results = load_stairways(run)
    trajectory = load_run_trajectory(run if run.is_dir() else run.parent)
    stairways = results.stairways
    height = results.camera_height if camera_height is None else camera_height
    return Building(
        stairways=stairways,
        drops=results.drops,
        floors=find_floors(stairways, trajectory, camera_height=height),
        trajectory=trajectory,
        frame_id=results.frame_id,
    )
