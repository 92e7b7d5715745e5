"""``stairmap view``: a run in the rerun viewer, or as a file that others can open."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import typer

from stairmap.cli.interrupts import noted_interrupts
from stairmap.cli.progress import FrameProgress, PointProgress
from stairmap.cli.requests import ViewRequest
from stairmap.errors import ResultsError
from stairmap.export.loading import load_stairways
from stairmap.export.scan_reference import ScanReference, load_scan_reference, read_scanned_map
from stairmap.input_files import shown
from stairmap.output_files import check_new_file, discard_partial
from stairmap.trajectory import Trajectory
from stairmap.visualization.foxglove_file import FoxgloveFile
from stairmap.visualization.page import PageFile
from stairmap.visualization.rerun_process import RerunProcess
from stairmap.visualization.rerun_viewer import RerunViewer, import_rerun
from stairmap.visualization.run_replay import RunReplay, RunView, load_run, show_run
from stairmap.visualization.stairway_labels import find_viewpoint


def view_run(request: ViewRequest) -> int:
    """Show a run folder as it was asked for; return the exit code.

    Raises
    ------
    StairmapError
        If it is no run folder, a package or display is missing, or a file cannot be written.
    """
    for option, file in (("--page", request.page), ("--save", request.rrd), ("--foxglove", request.mcap)):
        if file is not None:
            # Bags have the same ending as Foxglove's files: walk.mcap may well be the recording itself.
            check_new_file(file, option=option)
    scan = load_scan_reference(request.run if request.run.is_dir() else request.run.parent)
    if scan is not None:
        return _view_scan(request, scan)
    replay = load_run(request.run, recording=request.recording)
    for note in replay.notes:
        typer.echo(note, err=True)
    views, paths = _open_files(request, replay)
    wants_window = not paths and request.web_port is None
    if not wants_window and request.web_port is None:
        try:
            _show(replay, views, request.every)
        except BaseException:
            for path in paths:
                discard_partial(Path(path))
            raise
        typer.echo("\n".join(paths))
        return 0
    import_rerun()  # before a process is started in vain
    process = RerunProcess(web_port=request.web_port)
    try:
        viewer = open_viewer(replay)
        viewer.connect(process.port)
        if request.web_port is not None:
            typer.echo(f"{process.url}  (Ctrl-C ends it)", err=True)
        _show(replay, [*views, viewer], request.every)
        if paths:
            typer.echo("\n".join(paths))
        if request.web_port is not None:
            _serve_until_interrupted(process)
    except BaseException:
        process.stop()
        raise
    return 0


def _view_scan(request: ViewRequest, scan: ScanReference) -> int:
    """Write the page of a scan: its map and its stairways."""
    if request.page is None or request.rrd is not None or request.mcap is not None:
        raise ResultsError(f"{shown(request.run)} is a scan, which is shown as a page: pass --page FILE.html")
    folder = request.run if request.run.is_dir() else request.run.parent
    results = load_stairways(folder)
    page = PageFile(
        request.page,
        name=shown(folder.resolve().name),
        frame_id=shown(results.frame_id),
        positions=np.zeros((0, 3)),
        is_scan=True,
    )
    with PointProgress(scan.num_points) as progress:
        cloud = read_scanned_map(scan, on_points=progress.advance)
    page.show_points(cloud.points().astype(np.float64) + cloud.origin, num_points=cloud.num_added)
    page.show_stairways(results.stairways, 0, 0)
    page.close()
    typer.echo(str(request.page))
    return 0


def open_live_view(name: str, trajectory: Trajectory) -> RunView:
    """Open a window of the rerun viewer for a run that is about to begin.

    Raises
    ------
    StairmapError
        If rerun or a display is missing.
    """
    import_rerun()
    positions = trajectory.map_from_camera[:, :3, 3]
    viewer = RerunViewer(
        name,
        viewpoint=find_viewpoint((), positions),
        positions=positions,
        is_map=True,
        opens_log=True,
        follows=True,
    )
    viewer.connect(RerunProcess().port)
    return viewer


def open_viewer(replay: RunReplay) -> RerunViewer:
    """Return a rerun viewer for a run; it shows nothing before it is connected or saved."""
    return RerunViewer(
        replay.name,
        viewpoint=find_viewpoint(replay.stairways, replay.positions),
        positions=replay.positions,
        is_map=replay.trajectory is not None,
        opens_log=not replay.stairways,
    )


def _serve_until_interrupted(process: RerunProcess) -> None:
    with noted_interrupts() as interrupt:
        while process.is_running and not interrupt:
            time.sleep(0.1)
    process.stop()


def _open_files(request: ViewRequest, replay: RunReplay) -> tuple[list[RunView], list[str]]:
    """Open the files that were asked for; nothing is written before all of them can be opened."""
    views: list[RunView] = []
    if request.page is not None:
        views.append(
            PageFile(request.page, name=replay.name, frame_id=replay.frame_id, positions=replay.positions)
        )
    if request.rrd is not None:
        viewer = open_viewer(replay)
        viewer.save(request.rrd)
        views.append(viewer)
    if request.mcap is not None:
        views.append(
            FoxgloveFile(request.mcap, name=replay.name, frame_id=replay.frame_id, positions=replay.positions)
        )
    return views, [str(path) for path in (request.page, request.rrd, request.mcap) if path is not None]


def _show(replay: RunReplay, views: list[RunView], every: int) -> None:
    with FrameProgress(-(-replay.num_frames // every)) as progress:
        show_run(replay, views, every=every, advance=progress.advance)
