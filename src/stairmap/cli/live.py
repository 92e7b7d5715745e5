"""``stairmap live``: stairs in front of a depth camera, now; with odometry a map at the end."""

from __future__ import annotations

import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.live_session import LiveSession
from stairmap.cli.live_table import COLUMNS, LiveTable, observation_rows
from stairmap.cli.plain_table import format_columns
from stairmap.cli.report_facts import report_facts
from stairmap.cli.requests import LiveRequest
from stairmap.config import dump_config, load_config
from stairmap.errors import MissingPackageError, OutputError, RecordingError, TrajectoryError
from stairmap.export.results import RunFolder, create_run_folder
from stairmap.export.summary import counted, format_summary, format_table
from stairmap.odometry_session import OdometryMap
from stairmap.recordings.image_folder_writer import ImageFolderWriter
from stairmap.recordings.realsense import LiveFrame, RealSenseCamera, open_realsense
from stairmap.visualization.report import render_report, report_data


def run_live(request: LiveRequest) -> int:
    """Look at a live camera until Ctrl-C, write what was found, print it; return the exit code.

    Ctrl-C is how it ends, so that the exit code is 0 then.

    Raises
    ------
    StairmapError
        If there is no camera, or a folder cannot be written.
    """
    config = load_config(request.config_file, request.overrides)
    session = LiveSession(config, method=request.method, with_odometry=request.with_odometry)
    camera = open_realsense(serial=request.serial, playback=request.playback)
    writer = None
    if request.record is not None:
        writer = ImageFolderWriter(request.record, camera.camera, depth_scale=round(1 / camera.depth_unit))
    with create_run_folder(request.output, "live") as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        folder.log(f"stairmap {stairmap.__version__} live --realsense: {camera.name}")
        folder.write_config(config)
        problem = _look(camera, session, folder, interrupt, writer, request)
        text = _write_results(session, folder, camera.name, problem, with_odometry=request.with_odometry)
        typer.echo(f"{text}\n{folder.path}")
        return 1 if problem and not session.collector.num_frames else 0


def _look(
    camera: RealSenseCamera,
    session: LiveSession,
    folder: RunFolder,
    interrupt: Interrupt,
    writer: ImageFolderWriter | None,
    request: LiveRequest,
) -> str | None:
    """Take frames until they end; return why, if it is a problem."""
    with LiveTable(camera) as table:
        try:
            for live in camera.frames(should_stop=lambda: bool(interrupt)):
                detection = session.process(live)
                folder.append_detection(detection)
                if writer is not None:
                    writer = _record(writer, live)
                table.show(session, detection)
                if session.collector.num_frames == request.num_frames:
                    break
        except RecordingError as error:
            # A cable that was pulled must not cost what was found before.
            return str(error)
    return None


def _record(writer: ImageFolderWriter, live: LiveFrame) -> ImageFolderWriter | None:
    """Write a frame of the recording; without room for it the session goes on without."""
    try:
        writer.write(live.frame)
    except OutputError as error:
        warn(f"{error}; the recording ends here, the session goes on")
        return None
    return writer


def _write_results(
    session: LiveSession, folder: RunFolder, name: str, problem: str | None, *, with_odometry: bool
) -> str:
    """Write what was found; return it as text."""
    folder.release_reserve()
    collector = session.collector
    reasons = [str(rule) for rule in collector.rule_statistics()]
    problems = [problem] if problem else []
    looked_at = f"{counted(collector.num_frames, 'frame')}, stair edges seen in {collector.num_detections}"
    lines = [f"{looked_at}; {session.num_skipped} more were skipped to keep up with the camera", ""]
    live_map = None
    if with_odometry:
        try:
            live_map = session.find_map()
        except TrajectoryError as error:
            problems.append(f"no map: {error}")
    stairways = () if live_map is None else live_map.stairways
    if live_map is not None:
        problems += live_map.notes
        problems += _write_map(session, live_map, folder, name, problems)
        lines += [format_table(stairways).rstrip("\n"), ""]
    elif session.last_seen is not None:
        rows = observation_rows(session.last_seen)
        lines += ["the last frame with stairs:", format_columns(COLUMNS, rows, left_aligned=("view",)), ""]
    if reasons and not stairways:
        lines += ["why frames had no stair edges:", *(f"  {reason}" for reason in reasons), ""]
    folder.write_summary(
        format_summary(
            stairways,
            num_frames=collector.num_frames,
            num_detections=collector.num_detections,
            reasons=reasons,
            problems=problems,
        )
    )
    for line in problems:
        folder.log(line)
        typer.echo(line, err=True)
    return "\n".join(lines)


def _write_map(
    session: LiveSession, live_map: OdometryMap, folder: RunFolder, name: str, problems: list[str]
) -> list[str]:
    """Write the files of a map; return what could not be written, a sentence each."""
    folder.write_stairways(
        live_map.stairways,
        num_frames=session.collector.num_frames,
        drops=live_map.drops,
        camera_height=live_map.camera_height,
    )
    folder.write_trajectory(live_map.trajectory)
    folder.write_mesh(live_map.stairways)
    folder.write_config(live_map.config)
    data = report_data(
        session.collector,
        recording_name=name,
        method=session.method,
        stairways=live_map.stairways,
        trajectory=live_map.trajectory,
        config_yaml=dump_config(live_map.config),
        problems=problems,
        detector=session.detector,
        facts=report_facts(name),
    )
    try:
        folder.write_report(render_report(data))
    except MissingPackageError as error:
        return [f"report.html was left out: {error}"]
    return []
