"""Options of ``stairmap clean``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import DebugOption
from stairmap.cli.requests import CleanRequest


def clean(
    *,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Points: .pcd .ply .las .laz .e57 .xyz; several are one map.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FILE", help="New .ply or .pcd file.", show_default=False),
    ],
    run: Annotated[
        Path | None,
        typer.Option(
            "--run",
            metavar="DIR",
            help="Run folder of 'stairmap scan' on these files. Default: scan them now.",
            show_default=False,
        ),
    ] = None,
    up: Annotated[
        str | None,
        typer.Option(
            "--up", metavar="AXIS", help="As for 'stairmap scan', without --run.", show_default=False
        ),
    ] = None,
    debug: DebugOption = False,
) -> None:
    """Replace the blurred steps of a map by exact ones, for planners with a step limit.

    \b
    Examples:
      stairmap clean slam_map.pcd -o slam_map_clean.pcd
      stairmap clean building.laz --run results/building_1 -o building_clean.ply

    Points of the steps are taken away, exact treads, risers and landings put there; all others stay.
    """
    from stairmap.cli.clean import clean_map  # noqa: PLC0415

    raise typer.Exit(clean_map(CleanRequest(files=tuple(files), output=output, run=run, up=up)))
