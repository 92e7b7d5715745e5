"""Look at a finished map as ``stairmap scan`` does, and at sweeps of a LiDAR as ``stairmap run`` does."""

from __future__ import annotations

from pathlib import Path

from stairmap.batch.job import BatchSettings
from stairmap.batch.look import Look, finish_look, without_steps
from stairmap.config import Config
from stairmap.errors import RecordingError
from stairmap.export.results import create_run_folder
from stairmap.map_scan import MapScan
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.map_up import check_up
from stairmap.recordings.open import open_sweeps
from stairmap.scan_run import write_scan_report, write_scan_results
from stairmap.sweep_run import SweepRun


def look_at_cloud(path: Path, settings: BatchSettings, config: Config, output: Path) -> Look:
    """Look at a cloud of points and write its run folder.

    Raises
    ------
    StairmapError
        If it cannot be read, or the folder not be written.
    """
    cloud = open_cloud(path)
    scan = MapScan(
        [cloud], up=None if settings.up is None else check_up(settings.up), unit=None, config=config
    )
    with create_run_folder(output, path.stem) as folder:
        folder.log(f"stairmap {settings.version} batch, a cloud")
        folder.write_config(config)
        scan.read()
        result = scan.find_stairways()
        write_scan_results(folder, result, [cloud])
        if settings.with_reports:
            write_scan_report(folder, result, scan, config=config, facts={})
        for line in result.notes:
            folder.log(line)
    return Look(
        num_frames=1,
        num_detections=int(bool(result.observations)),
        stairways=without_steps(result.stairways),
    )


def look_at_sweeps(path: Path, settings: BatchSettings, config: Config, output: Path) -> Look:
    """Look at the sweeps of a bag and write its run folder.

    Raises
    ------
    StairmapError
        If they cannot be used, or the folder not be written.
    """
    if settings.with_odometry or settings.method != DEFAULT_METHOD:
        raise RecordingError(
            f"{path.name} has sweeps and no depth images: --odometry and --method are for depth images"
        )
    recording = open_sweeps(path, up=settings.up, pose_format=settings.pose_format, bag=settings.bag)
    run = SweepRun(recording, config=config)
    with create_run_folder(output, recording.name) as folder:
        folder.log(f"stairmap {settings.version} batch, sweeps of {recording.contents.topic}")
        run.process_sweeps(folder)
        return finish_look(run, folder, with_report=settings.with_reports)
