"""``stairmap scan``: the stairways of a finished map."""

from __future__ import annotations

import json
from collections.abc import Sequence

import typer

import stairmap
from stairmap.cli.exits import warn
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.plain_table import format_columns
from stairmap.cli.progress import PointProgress
from stairmap.cli.report_facts import report_facts
from stairmap.cli.requests import ScanRequest
from stairmap.clouds.units import UNITS
from stairmap.config import load_config
from stairmap.errors import RecordingError
from stairmap.export.results import RunFolder, create_run_folder, null_for_nan
from stairmap.export.summary import counted, format_table
from stairmap.export.verdicts import VERDICT_COLUMNS, verdict_cells
from stairmap.map_scan import MapScan, ScanResult
from stairmap.navigation.robot_profile import load_robot
from stairmap.navigation.traversability import Assessment, assess
from stairmap.recordings.clouds.open import open_cloud
from stairmap.recordings.map_up import check_up
from stairmap.scan_run import describe_reasons, write_scan_report, write_scan_results


def scan_map(request: ScanRequest) -> int:
    """Find the stairways of a map, write the run folder, print a table; return the exit code.

    Raises
    ------
    StairmapError
        If a file cannot be read, or the output folder cannot be used.
    """
    config = load_config(request.config_file, request.overrides)
    robots = [load_robot(name) for name in request.robots]
    up = check_scan_up(request.up)
    if request.unit is not None and request.unit not in UNITS:
        raise RecordingError(f"expected --unit to be one of {', '.join(UNITS)}, got {request.unit!r}")
    clouds = [open_cloud(path) for path in request.files]
    scan = MapScan(clouds, up=up, unit=request.unit, config=config)
    name = request.files[0].stem if len(request.files) == 1 else request.files[0].resolve().parent.name
    with create_run_folder(request.output, name or "map") as folder, noted_interrupts() as interrupt:
        folder.on_failure = warn
        folder.log(f"stairmap {stairmap.__version__} scan {' '.join(str(path) for path in request.files)}")
        folder.write_config(config)
        with PointProgress(scan.num_points) as progress:
            scan.read(on_points=progress.advance, should_stop=lambda: bool(interrupt))
        result = scan.find_stairways()
        write_scan_results(folder, result, clouds)
        notes = list(result.notes)
        if request.with_report:
            missing = write_scan_report(
                folder, result, scan, config=config, facts=report_facts(request.files[0])
            )
            notes += [missing] if missing else []
        for line in notes:
            folder.log(line)
            typer.echo(line, err=True)
        assessments = [assess(stairway, robot) for stairway in result.stairways for robot in robots]
        if request.as_json:
            typer.echo(_format_json(folder, result, interrupt, assessments))
        else:
            typer.echo(_format_text(folder, result, assessments))
        return interrupt.exit_code


def check_scan_up(up: str | None) -> str | None:
    """Return the axis that was asked for; one without a sign is the positive one."""
    if up is None:
        return None
    return check_up(f"+{up}" if up in ("x", "y", "z") else up)


def _format_text(folder: RunFolder, result: ScanResult, assessments: Sequence[Assessment]) -> str:
    lines = [
        f"{result.num_points:,} points, {counted(len(result.observations), 'flight')} found",
        "",
        format_table(result.stairways).rstrip("\n"),
        "",
    ]
    if not result.stairways:
        lines += [*(f"  {reason}" for reason in describe_reasons(result)), ""]
    if assessments:
        rows = [verdict_cells(assessment) for assessment in assessments]
        lines += [format_columns(VERDICT_COLUMNS, rows, left_aligned=VERDICT_COLUMNS), ""]
    return "\n".join([*lines, str(folder.path)])


def _format_json(
    folder: RunFolder, result: ScanResult, interrupt: Interrupt, assessments: Sequence[Assessment]
) -> str:
    values = {
        "output": str(folder.path),
        "interrupted": bool(interrupt),
        "num_points": result.num_points,
        "num_invalid": result.num_invalid,
        "unit": result.unit,
        "map_from_file": result.map_from_file.tolist(),
        "up": result.up.tolist(),
        "stairways": [stairway.to_dict() for stairway in result.stairways],
        "assessments": [assessment.to_dict() for assessment in assessments],
        "reasons": [] if result.stairways else describe_reasons(result),
        "problems": list(result.notes),
    }
    return json.dumps(null_for_nan(values), indent=1, allow_nan=False)
