"""Options of ``stairmap check``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import OUTPUT, DebugOption, JsonOption, check_ending
from stairmap.cli.requests import CheckRequest


def check(
    *,
    stairways: Annotated[
        Path | None,
        typer.Argument(help="Run folder, or its stairways.json.", show_default=False),
    ] = None,
    robots: Annotated[
        list[str] | None,
        typer.Option(
            "--robot",
            metavar="NAME|FILE",
            help="Robot profile by name, or a YAML file; may be repeated. Default: all that are known.",
            show_default=False,
        ),
    ] = None,
    codes: Annotated[
        list[str] | None,
        typer.Option(
            "--code",
            metavar="NAME",
            help="Building code to hold the stairways against; may be repeated.",
            show_default=False,
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture",
            metavar="FILE",
            help="PNG with the verdicts.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    list_all: Annotated[bool, typer.Option("--list", help="Print the names of robots and codes.")] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Check which robots can climb the stairways of a run, and which building codes these comply with.

    \b
    Examples:
      stairmap check results/hall_1 --robot spot
      stairmap check results/hall_1/stairways.json --robot my_robot.yaml --json
      stairmap check results/hall_1 --code ibc --code osha
    """
    from stairmap.cli.check import check_stairways, describe_choices  # noqa: PLC0415

    if list_all:
        typer.echo(describe_choices())
        return
    if stairways is None:
        raise typer.BadParameter("expected a run folder or stairways.json; --list prints robots and codes")
    check_ending(picture, ".png", option="--picture")
    request = CheckRequest(
        stairways=stairways,
        robots=tuple(robots or ()),
        codes=tuple(codes or ()),
        picture=picture,
        as_json=as_json,
    )
    raise typer.Exit(check_stairways(request))
