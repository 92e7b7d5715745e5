"""Options of ``stairmap view``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import OUTPUT, DebugOption, check_ending
from stairmap.cli.requests import ViewRequest

DEFAULT_WEB_PORT = 9090


def view(
    *,
    run: Annotated[Path, typer.Argument(help="Folder of 'stairmap run' or 'detect'.", show_default=False)],
    recording: Annotated[
        Path | None,
        typer.Option(
            "--recording",
            metavar="PATH",
            help="Where the recording is now. Default: where it was.",
            show_default=False,
        ),
    ] = None,
    every: Annotated[int, typer.Option("--every", metavar="N", min=1, help="Show each N-th frame only.")] = 1,
    save: Annotated[
        Path | None,
        typer.Option(
            "--save",
            metavar="FILE.rrd",
            help="Write a file for the rerun viewer; needs no display.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    web: Annotated[
        bool,
        typer.Option(
            "--web", help="Serve the rerun viewer to browsers of this machine.", rich_help_panel=OUTPUT
        ),
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            metavar="N",
            min=1,
            max=65535,
            help=f"Port of --web on 127.0.0.1. Default: {DEFAULT_WEB_PORT}.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--page",
            metavar="FILE.html",
            help="Write the map as one page that any browser opens, offline too.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    foxglove: Annotated[
        Path | None,
        typer.Option(
            "--foxglove",
            metavar="FILE.mcap",
            help="Write a file for Foxglove.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    debug: DebugOption = False,
) -> None:
    """Look at a run: depth, cloud, stair edges, stairways, and how their dimensions changed over time.

    \b
    Examples:
      stairmap view results/hall_1                    the rerun viewer
      stairmap view results/hall_1 --page hall.html   one page to send around
      stairmap view results/hall_1 --save hall.rrd --foxglove hall.mcap

    Without --save, --web, --page and --foxglove a window opens.
    """
    from stairmap.cli.view import view_run  # noqa: PLC0415

    if port is not None and not web:
        raise typer.BadParameter("--port is the port of --web; add --web")
    for path, ending, option in (
        (save, ".rrd", "--save"),
        (page, ".html", "--page"),
        (foxglove, ".mcap", "--foxglove"),
    ):
        check_ending(path, ending, option=option)
    request = ViewRequest(
        run=run,
        recording=recording,
        every=every,
        rrd=save,
        web_port=(port or DEFAULT_WEB_PORT) if web else None,
        page=page,
        mcap=foxglove,
    )
    raise typer.Exit(view_run(request))
