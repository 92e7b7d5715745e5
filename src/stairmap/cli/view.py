"""``stairmap view``: a run in the rerun viewer, or as a file that others can open."""

from __future__ import annotations

import time
from pathlib import Path

import typer

from stairmap.cli.interrupts import noted_interrupts
from stairmap.cli.progress import FrameProgress
from stairmap.cli.requests import ViewRequest
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
    names = {"name": replay.name, "frame_id": replay.frame_id}
    if request.page is not None:
        views.append(PageFile(request.page, positions=replay.positions, **names))
    if request.rrd is not None:
        viewer = open_viewer(replay)
        viewer.save(request.rrd)
        views.append(viewer)
    if request.mcap is not None:
        views.append(FoxgloveFile(request.mcap, positions=replay.positions, **names))
    return views, [str(path) for path in (request.page, request.rrd, request.mcap) if path is not None]


def _show(replay: RunReplay, views: list[RunView], every: int) -> None:
    with FrameProgress(-(-replay.num_frames // every)) as progress:
        show_run(replay, views, every=every, advance=progress.advance)
