"""Maps of the floors of a run: from files, from the depth images of its recording, or cut from its points."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stairmap.cli.progress import FrameProgress, PointProgress
from stairmap.errors import ConfigError
from stairmap.export.recording_reference import load_recording_reference
from stairmap.export.scan_reference import ScanReference, load_scan_reference, read_scanned_map
from stairmap.navigation.cloud_grids import grids_from_points
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.grid_building import GridBuilder
from stairmap.navigation.occupancy import OccupancyGrid, load_map
from stairmap.recordings.base import Recording
from stairmap.recordings.open import open_recording
from stairmap.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorMaps:
    """Where maps of a run's floors come from: files by level, and its recording if that is given."""

    run: Path
    recording: Path | None = None
    maps: tuple[tuple[int, Path], ...] = ()


def load_floor_grids(
    request: FloorMaps, floors: FloorStack, trajectory: Trajectory | None
) -> dict[int, OccupancyGrid]:
    """Return the maps of floors by level, from files and from the depth images of the run.

    Raises
    ------
    StairmapError
        If a map or the recording cannot be used, or there is none.
    """
    grids = {}
    for level, path in request.maps:
        if level in grids:
            raise ConfigError(f"floor {level} has two maps; pass --map once for each floor")
        floors.floor(level)
        grids[level] = load_map(path)
    # Where every floor that is asked for has a map, the recording is not needed.
    if request.recording is None and grids:
        return grids
    scan = load_scan_reference(request.run if request.run.is_dir() else request.run.parent)
    if scan is not None and request.recording is None:
        return {**_cut_map(scan, floors), **grids}
    recording = _open(request.run, request.recording)
    if trajectory is None:
        raise ConfigError(
            f"{request.run} has no trajectory.tum, so its recording cannot be placed; pass --map"
        )
    return {**_map_recording(recording, request.run, floors, trajectory), **grids}


def _cut_map(scan: ScanReference, floors: FloorStack) -> dict[int, OccupancyGrid]:
    """Cut the floors out of the map of points that was scanned."""
    with PointProgress(scan.num_points) as progress:
        cloud = read_scanned_map(scan, on_points=progress.advance)
    return grids_from_points(cloud.points().astype(np.float64) + cloud.origin, floors)


def _open(run: Path, path: Path | None) -> Recording:
    """Open the run's recording as the run did: where it was, or at the path given."""
    reference = load_recording_reference(run if run.is_dir() else run.parent)
    if path is not None:
        if reference is None:
            return open_recording(path)
        return replace(reference, path=path).open()
    if reference is None:
        raise ConfigError(
            f"there is no map to plan on: {run} does not say where its recording is; pass --recording PATH "
            "or --map LEVEL=FILE"
        )
    return reference.open()


def _map_recording(
    recording: Recording, run: Path, floors: FloorStack, trajectory: Trajectory
) -> dict[int, OccupancyGrid]:
    builder = GridBuilder(floors)
    num_placed = 0
    with FrameProgress(recording.num_frames) as progress:
        for frame in recording:
            if trajectory.has_pose(np.array([frame.stamp_ns]))[0]:
                builder.add(frame, trajectory.pose_at(frame.stamp_ns))
                num_placed += 1
            progress.advance()
    if num_placed == 0:
        first, last = (stamp_ns * 1e-9 for stamp_ns in recording.time_range_ns)
        run_first, run_last = trajectory.stamps_ns[[0, -1]] * 1e-9
        raise ConfigError(
            f"expected --recording to be that of {run}, whose poses run from {run_first:.3f} to "
            f"{run_last:.3f} s, but the images of {recording.name} run from {first:.3f} to {last:.3f} s; "
            "pass the recording of this run"
        )
    return builder.grids()
