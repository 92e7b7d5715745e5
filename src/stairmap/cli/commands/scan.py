"""Options of ``stairmap scan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import (
    INPUT,
    OUTPUT,
    ConfigOption,
    DebugOption,
    JsonOption,
    OutputOption,
    SetOption,
)
from stairmap.cli.requests import ScanRequest


def scan(
    *,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Points: .pcd .ply .las .laz .e57 .xyz; several are one map.",
            show_default=False,
        ),
    ],
    up: Annotated[
        str | None,
        typer.Option(
            "--up",
            metavar="AXIS",
            help="Axis of the files that points up: +x -x +y -y +z -z, or auto: from the floors. "
            "Default +z, unless the points clearly tell another.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="NAME",
            help="Unit of the files: m, cm, mm, ft or in. Default: by the height of the map.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    overrides: SetOption = None,
    robots: Annotated[
        list[str] | None,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="Also check if this robot can climb them; may be repeated. Names: 'stairmap check --list'.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    output: OutputOption = None,
    no_report: Annotated[
        bool, typer.Option("--no-report", help="Write no report.html.", rich_help_panel=OUTPUT)
    ] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Find the stairways of a finished map: a cloud of points from a scanner or from SLAM.

    \b
    Examples:
      stairmap scan building.laz --robot spot
      stairmap scan ground_floor.e57 first_floor.e57 -o results/house
      stairmap scan slam_map.pcd --up=auto --json

    Positions are in the file's own coordinates, m.
    """
    from stairmap.cli.scan import scan_map  # noqa: PLC0415

    request = ScanRequest(
        files=tuple(files),
        up=up,
        unit=unit,
        config_file=config,
        overrides=tuple(overrides or ()),
        output=output,
        with_report=not no_report,
        as_json=as_json,
        robots=tuple(robots or ()),
    )
    raise typer.Exit(scan_map(request))
