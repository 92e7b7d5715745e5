"""``stairmap run`` on the sweeps of a LiDAR."""

from __future__ import annotations

import json
from collections.abc import Sequence

import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import noted_interrupts
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import FrameProgress, OpeningProgress
from stairmap.cli.report_facts import report_facts
from stairmap.cli.requests import RunRequest
from stairmap.config import load_config
from stairmap.errors import RecordingError
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted, format_table
from stairmap.export.verdicts import VERDICT_COLUMNS, verdict_cells
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.traversability import Assessment, assess
from stairmap.pipeline import DEFAULT_METHOD
from stairmap.recording_run import RunOutcome
from stairmap.recordings.bags.elevation import ElevationRecording
from stairmap.recordings.bags.sweeps import SweepRecording
from stairmap.recordings.open import open_sweeps
from stairmap.sweep_run import SweepRun


def run_sweeps(request: RunRequest) -> int:
    """Find the stairways in a bag's sweeps, write the run folder, print a table; return the exit code.

    Raises
    ------
    StairmapError
        If the bag, its poses or the output folder cannot be used, or an option needs depth images.
    """
    given = request.input
    _check_options(request)
    config = load_config(given.config_file, given.overrides)
    robots = [load_robot(name) for name in request.robots]
    with OpeningProgress(given.recording.name) as opening:
        recording = open_sweeps(
            given.recording,
            trajectory=given.trajectory,
            up=given.up,
            pose_format=given.pose_format,
            bag=given.bag,
            watch=opening.update,
        )
    run = SweepRun(recording, config=config)
    with create_run_folder(request.output, recording.name) as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        folder.log(
            f"stairmap {stairmap.__version__} run {given.recording}, sweeps of {recording.contents.topic}"
        )
        with FrameProgress(recording.num_sweeps) as progress:
            run.process_sweeps(
                folder,
                should_stop=lambda: bool(interrupt),
                on_sweep=lambda num_stairways: progress.advance(counted(num_stairways, "stairway")),
            )
        if interrupt:
            typer.echo("interrupted: writing what there is so far; once more to stop at once", err=True)
        outcome = run.outcome()
        assessments = [assess(stairway, robot) for stairway in outcome.stairways for robot in robots]
        run.write_results(folder, outcome)
        notes = list(outcome.problems)
        if request.with_report:
            missing = run.write_report(folder, outcome, facts=report_facts(given.recording))
            notes += [missing] if missing else []
        for line in notes:
            folder.log(line)
            typer.echo(line, err=True)
        if request.as_json:
            typer.echo(_format_json(run, recording, folder, outcome, assessments))
        else:
            typer.echo(_format_text(run, recording, folder, outcome, assessments))
        if run.failure is not None:
            raise run.failure
        return interrupt.exit_code


def _check_options(request: RunRequest) -> None:
    bag, given = request.input.bag, request.input
    asked = {
        "--odometry": request.with_odometry,
        "--view": request.with_view,
        f"--method {given.method}": given.method != DEFAULT_METHOD,
        "--depth-topic": bag.depth_topic is not None,
        "--camera-info-topic": bag.camera_info_topic is not None,
        "--camera": bag.camera_file is not None,
    }
    option = next((name for name, is_given in asked.items() if is_given), None)
    if option is not None:
        raise RecordingError(
            f"{option} needs depth images, but {given.recording} is read as sweeps; leave it out"
        )


def _format_text(
    run: SweepRun,
    recording: SweepRecording | ElevationRecording,
    folder: RunFolder,
    outcome: RunOutcome,
    assessments: Sequence[Assessment],
) -> str:
    kind = "sweep" if isinstance(recording, SweepRecording) else "elevation map"
    lines = [
        f"{counted(run.session.num_sweeps, kind)} of {recording.contents.topic} in "
        f"{counted(outcome.num_frames, 'window')}, stair edges seen in {outcome.num_detections}",
        "",
        format_table(outcome.stairways).rstrip("\n"),
        "",
    ]
    if not outcome.stairways and outcome.reasons:
        lines += ["why windows gave no stairway:", *(f"  {reason}" for reason in outcome.reasons), ""]
    if assessments:
        rows = [verdict_cells(assessment) for assessment in assessments]
        lines += [format_columns(VERDICT_COLUMNS, rows, left_aligned=VERDICT_COLUMNS), ""]
    return "\n".join([*lines, str(folder.path)])


def _format_json(
    run: SweepRun,
    recording: SweepRecording | ElevationRecording,
    folder: RunFolder,
    outcome: RunOutcome,
    assessments: Sequence[Assessment],
) -> str:
    values = {
        "output": str(folder.path),
        "interrupted": outcome.was_stopped,
        "cloud_topic": recording.contents.topic,
        "num_sweeps": run.session.num_sweeps,
        "num_frames": outcome.num_frames,
        "num_detections": outcome.num_detections,
        "num_frames_without_pose": outcome.num_without_pose,
        "map_from_recorded": recording.map_from_recorded.tolist(),
        "stairways": [stairway.to_dict() for stairway in outcome.stairways],
        "assessments": [assessment.to_dict() for assessment in assessments],
        "reasons": list(outcome.reasons),
        "problems": list(outcome.problems),
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
