"""Options of ``stairmap explore``."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import OUTPUT, DebugOption, JsonOption, OutputOption
from stairmap.cli.requests import ExploreRequest

_MISSION = "Mission"


class Strategy(str, Enum):
    """Names of the strategies; ``stairmap.exploration`` is too heavy to import for ``--help``."""

    gain = "gain"
    nearest = "nearest"
    stairs_free = "stairs-free"
    stairs_ignored = "stairs-ignored"


def explore(
    *,
    world: Annotated[
        str,
        typer.Argument(
            help="Name of a scene ('stairmap simulate --list'), or building:NAME with --buildings.",
            show_default=False,
        ),
    ],
    robot: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="Who explores: a profile of 'stairmap check --list', or a YAML file.",
            rich_help_panel=_MISSION,
        ),
    ] = "spot",
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,YAW]",
            help="Where it begins, m and deg. Default: a roomy place on the floor nearest to height 0.",
            rich_help_panel=_MISSION,
            show_default=False,
        ),
    ] = None,
    buildings: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder with a folder for each building, which holds its mesh.ply.",
            rich_help_panel=_MISSION,
            show_default=False,
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Same seed, same mission.", rich_help_panel=_MISSION)
    ] = 0,
    perfect_odometry: Annotated[
        bool, typer.Option("--perfect-odometry", help="Poses without error.", rich_help_panel=_MISSION)
    ] = False,
    strategy: Annotated[
        Strategy,
        typer.Option(
            metavar="NAME",
            help="gain, or to compare with: nearest, stairs-free, stairs-ignored.",
            rich_help_panel=_MISSION,
        ),
    ] = Strategy.gain,
    allow_unknown: Annotated[
        bool,
        typer.Option(
            "--allow-unknown",
            help="Also try stairs whose verdict is unknown.",
            rich_help_panel=_MISSION,
        ),
    ] = False,
    output: OutputOption = None,
    resume: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="Go on with the stopped mission of this folder; other options as it was begun with.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    no_report: Annotated[
        bool, typer.Option("--no-report", help="Write no report.html.", rich_help_panel=OUTPUT)
    ] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Let a simulated robot explore a building of several floors by itself.

    \b
    Examples:
      stairmap explore two_floors --robot spot
      stairmap explore building:house --buildings DIR --robot go2 --start 1,2,0,90
      stairmap explore two_floors --perfect-odometry --strategy nearest --json
      stairmap explore two_floors --robot spot --resume results/explore_two_floors_1

    Ctrl-C ends the mission and writes what was found so far; --resume goes on from there.
    """
    from stairmap.cli.explore import explore_world  # noqa: PLC0415

    for option, value in (("--start", start), ("--output", output)):
        if resume is not None and value is not None:
            raise typer.BadParameter(f"{option} and --resume exclude each other: the mission has its own")
    request = ExploreRequest(
        world=world,
        robot=robot,
        start=_parse_start(start),
        buildings=buildings,
        seed=seed,
        has_perfect_odometry=perfect_odometry,
        strategy=strategy.value,
        allow_unknown=allow_unknown,
        output=output,
        resume=resume,
        with_report=not no_report,
        as_json=as_json,
    )
    raise typer.Exit(explore_world(request))


def _parse_start(text: str | None) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in (3, 4):
        raise typer.BadParameter(f"--start: expected X,Y,Z or X,Y,Z,YAW (m, deg), got {text!r}")
    x, y, z = values[:3]
    return x, y, z, values[3] if len(values) == 4 else 0.0
