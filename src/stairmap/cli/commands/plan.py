"""Options of ``stairmap plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import INPUT, OUTPUT, DebugOption, JsonOption, check_finite, parse_map
from stairmap.cli.requests import PlanRequest

_WAY = "Way"

_MAX_PLACE = 1e6
"""Farthest place from the map's origin, m."""


def plan(
    *,
    run: Annotated[Path, typer.Argument(help="Run folder.", show_default=False)],
    recording: Annotated[
        Path | None,
        typer.Option(
            "--recording",
            metavar="DIR",
            help="Recording of the run: its floors are mapped from the depth images.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    maps: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="LEVEL=FILE",
            help="Nav2 map (YAML) of a floor, such as 0=ground.yaml; may be repeated.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    camera_height: Annotated[
        float | None,
        typer.Option(
            "--camera-height",
            min=0.01,
            max=100.0,
            callback=check_finite,
            metavar="M",
            help="Height of the camera above the floor, m. Default: as the run measured it.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    robot: Annotated[
        str,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="Robot that drives; 'stairmap check --list' names them.",
            rich_help_panel=_WAY,
        ),
    ] = "spot",
    start: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="X,Y[,LEVEL]",
            help="Start, m, and floor (default 0). Default: where the run ended.",
            rich_help_panel=_WAY,
            show_default=False,
        ),
    ] = None,
    goal: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="X,Y[,LEVEL]",
            help="Goal, m, and floor (default 0). Default: list places to explore.",
            rich_help_panel=_WAY,
            show_default=False,
        ),
    ] = None,
    allow_unknown: Annotated[
        bool,
        typer.Option(
            "--allow-unknown", help="Also use stairs with the verdict 'unknown'.", rich_help_panel=_WAY
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="New or empty folder for plan.json, plan.png and the maps. Default: nothing is written.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Plan a route over the floors of a run, or list the places to explore next. Costs are in seconds.

    Exit code 3: there is no way, or nothing is left to explore.

    \b
    Examples:
      stairmap plan results/hall_1 --recording hall --robot spot -o hall_plan
      stairmap plan results/hall_1 --map 0=ground.yaml --map 1=first.yaml --from 1,2,0 --to 5,7,1
    """
    from stairmap.cli.plan import plan_way  # noqa: PLC0415

    request = PlanRequest(
        run=run,
        maps=tuple(parse_map(text) for text in maps or ()),
        recording=recording,
        robot=robot,
        start=None if start is None else _parse_place("--from", start),
        goal=None if goal is None else _parse_place("--to", goal),
        allow_unknown=allow_unknown,
        camera_height=camera_height,
        output=output,
        as_json=as_json,
    )
    raise typer.Exit(plan_way(request))


def _parse_place(option: str, text: str) -> tuple[float, float, int]:
    parts = text.split(",")
    try:
        place = float(parts[0]), float(parts[1]), int(parts[2]) if len(parts) > 2 else 0
    except (ValueError, IndexError) as error:
        raise typer.BadParameter(f"{option}: expected X,Y or X,Y,LEVEL, got {text!r}") from error
    if len(parts) > 3 or not all(abs(value) <= _MAX_PLACE for value in place[:2]):
        raise typer.BadParameter(f"{option}: expected X,Y or X,Y,LEVEL, got {text!r}")
    return place
