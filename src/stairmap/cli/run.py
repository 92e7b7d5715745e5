"""``stairmap run``: the stairways of a recording."""

from __future__ import annotations

import json
from collections.abc import Sequence

import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.opening import open_requested, open_with_odometry
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import FrameProgress
from stairmap.cli.report_facts import report_facts
from stairmap.cli.requests import RunRequest
from stairmap.cli.run_sweeps import run_sweeps
from stairmap.cli.view import open_live_view
from stairmap.config import Config, load_config
from stairmap.export.recording_reference import RECORDING_FILE, RecordingReference
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted, format_table
from stairmap.export.verdicts import VERDICT_COLUMNS, verdict_cells
from stairmap.map_levelling import LevelMap, find_level_map
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.traversability import Assessment, assess
from stairmap.recording_run import RecordingRun, RunOutcome
from stairmap.recordings.base import Recording
from stairmap.recordings.identity import identify_recording
from stairmap.recordings.odometry import config_with_drift
from stairmap.recordings.open import has_only_sweeps


def run_recording(request: RunRequest) -> int:
    """Find the stairways of a recording, write the run folder, print a table; return the exit code.

    Raises
    ------
    StairmapError
        If the recording, its poses or the output folder cannot be used.
    """
    given = request.input
    if given.bag.cloud_topic is not None or (
        given.bag.depth_topic is None and has_only_sweeps(given.recording)
    ):
        return run_sweeps(request)
    config = load_config(given.config_file, given.overrides)
    robots = [load_robot(name) for name in request.robots]
    recording, up, config = _open(request, config)
    level_map = find_level_map(recording, up, max_depth=config.detection.max_depth)
    run = RecordingRun(recording, level_map, config=config, method=given.method)
    view = open_live_view(recording.name, level_map.trajectory) if request.with_view else None
    with create_run_folder(request.output, recording.name) as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        folder.log(f"stairmap {stairmap.__version__} run {given.recording} --method {given.method}")
        reference = RecordingReference.from_arguments(
            given.recording,
            trajectory=given.trajectory,
            up=given.up,
            pose_format=given.pose_format,
            bag=given.bag,
            identity=identify_recording(recording),
            with_odometry=request.with_odometry,
        )
        folder.write_text(RECORDING_FILE, reference.to_json())
        with FrameProgress(recording.num_frames) as progress:
            run.process_frames(
                folder,
                should_stop=lambda: bool(interrupt),
                on_frame=lambda num_stairways: progress.advance(counted(num_stairways, "stairway")),
                view=view,
            )
        if interrupt:
            typer.echo("interrupted: writing what there is so far; once more to stop at once", err=True)
        outcome = run.outcome()
        assessments = [assess(stairway, robot) for stairway in outcome.stairways for robot in robots]
        run.write_results(folder, outcome)
        if view is not None:
            run.show_outcome(view, outcome)
        notes = list(outcome.problems)
        if request.with_report:
            missing = run.write_report(folder, outcome, facts=report_facts(given.recording))
            notes += [missing] if missing else []
        for line in notes:
            folder.log(line)
            typer.echo(line, err=True)
        if request.as_json:
            typer.echo(_format_json(folder, outcome, level_map, interrupt, assessments))
        else:
            typer.echo(_format_text(folder, outcome, assessments))
        if run.failure is not None:
            raise run.failure
        return interrupt.exit_code


def _open(request: RunRequest, config: Config) -> tuple[Recording, str | None, Config]:
    """The recording with its poses, what levels its map, and the configuration for these poses."""
    given = request.input
    if request.with_odometry:
        recording = open_with_odometry(given)
        return recording, recording.up, config_with_drift(config, recording.odometry)
    opened = open_requested(given)
    return opened, given.up, config


def _format_text(folder: RunFolder, outcome: RunOutcome, assessments: Sequence[Assessment]) -> str:
    lines = [
        f"{counted(outcome.num_frames, 'frame')}, stair edges seen in {outcome.num_detections}",
        "",
        format_table(outcome.stairways).rstrip("\n"),
        "",
    ]
    if not outcome.stairways and outcome.reasons:
        lines += ["why frames gave no stairway:", *(f"  {reason}" for reason in outcome.reasons), ""]
    if assessments:
        rows = [verdict_cells(assessment) for assessment in assessments]
        lines += [format_columns(VERDICT_COLUMNS, rows, left_aligned=VERDICT_COLUMNS), ""]
    return "\n".join([*lines, str(folder.path)])


def _format_json(
    folder: RunFolder,
    outcome: RunOutcome,
    level_map: LevelMap,
    interrupt: Interrupt,
    assessments: Sequence[Assessment],
) -> str:
    values = {
        "output": str(folder.path),
        "interrupted": bool(interrupt),
        "num_frames": outcome.num_frames,
        "num_detections": outcome.num_detections,
        "num_frames_without_pose": outcome.num_without_pose,
        "map_from_recorded": level_map.map_from_recorded.tolist(),
        "stairways": [stairway.to_dict() for stairway in outcome.stairways],
        "assessments": [assessment.to_dict() for assessment in assessments],
        "reasons": list(outcome.reasons),
        "problems": list(outcome.problems),
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
