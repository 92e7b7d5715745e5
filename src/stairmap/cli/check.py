"""``stairmap check``: which robots can climb the stairways of a run, which building codes they keep."""

from __future__ import annotations

import json

import typer

from stairmap.cli.plain_table import format_columns
from stairmap.cli.requests import CheckRequest
from stairmap.export.loading import ResultsError, load_stairways
from stairmap.export.results import null_for_nan
from stairmap.export.verdicts import CODE_COLUMNS, VERDICT_COLUMNS, code_cells, verdict_cells
from stairmap.navigation.codes import CodeCheck, check_code, code_ids, load_code
from stairmap.navigation.robot_profile import load_robot, robot_names
from stairmap.navigation.traversability import Assessment, assess
from stairmap.output_files import check_new_file, write_whole
from stairmap.visualization.plots import png_from_figure
from stairmap.visualization.verdicts import draw_verdicts


def check_stairways(request: CheckRequest) -> int:
    """Print the verdicts for all stairways of a run; return the exit code.

    Raises
    ------
    StairmapError
        If the run, a profile or a code cannot be read, or the run holds no stairway.
    """
    if request.picture is not None:
        check_new_file(request.picture, option="--picture")
    robots = [load_robot(name) for name in request.robots or _default_robots(request)]
    codes = [load_code(code_id) for code_id in request.codes]
    stairways = load_stairways(request.stairways).stairways
    if not stairways:
        raise ResultsError(f"{request.stairways} holds no stairway, so there is nothing to check")
    assessments = [assess(stairway, robot) for stairway in stairways for robot in robots]
    code_checks = [check_code(stairway, code) for stairway in stairways for code in codes]
    if request.as_json:
        values = {
            "assessments": [assessment.to_dict() for assessment in assessments],
            "codes": [check.to_dict() for check in code_checks],
        }
        typer.echo(json.dumps(null_for_nan(values), indent=1, allow_nan=False))
    else:
        typer.echo(_format_text(assessments, code_checks))
    if request.picture is not None:
        write_whole(request.picture, png_from_figure(draw_verdicts(stairways, assessments, code_checks)))
    return 0


def describe_choices() -> str:
    """Return the names that ``--robot`` and ``--code`` know."""
    return f"robots: {' '.join(robot_names())}\ncodes: {' '.join(code_ids())}"


def _default_robots(request: CheckRequest) -> tuple[str, ...]:
    return () if request.codes else robot_names()


def _format_text(assessments: list[Assessment], code_checks: list[CodeCheck]) -> str:
    parts = []
    if assessments:
        rows = [verdict_cells(assessment) for assessment in assessments]
        parts.append(format_columns(VERDICT_COLUMNS, rows, left_aligned=VERDICT_COLUMNS))
    if code_checks:
        rows = [row for check in code_checks for row in code_cells(check)]
        parts.append(format_columns(CODE_COLUMNS, rows, left_aligned=CODE_COLUMNS))
        unchecked = {check.code_id: "; ".join(check.unchecked) for check in code_checks}
        parts.append("\n".join(f"not checked of {code_id}: {what}" for code_id, what in unchecked.items()))
    parts.append(
        "± is one standard deviation: the model's, and 2.5 mm (widths: 50 mm) for what it does not cover; "
        "passable and impassable are said from a probability of 97.7 % on"
    )
    return "\n\n".join(parts)
