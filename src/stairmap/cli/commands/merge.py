"""Options of ``stairmap merge``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import INPUT, DebugOption, JsonOption, OutputOption
from stairmap.cli.requests import MergeRequest


def merge(
    *,
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run folders of one site; a merged map, named first, keeps its ids.",
            show_default=False,
        ),
    ],
    alignment: Annotated[
        str,
        typer.Option(
            "--alignment",
            metavar="FILE|auto",
            help="YAML with x, y, z (m), yaw_deg of each run. auto: from common stairs and floors.",
            rich_help_panel=INPUT,
        ),
    ] = "auto",
    output: OutputOption = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Join the runs of one site into one map: stairways that several robots saw become one.

    \b
    Examples:
      stairmap merge fleet/hall_1 fleet/hall_2 -o site
      stairmap merge site fleet/hall_3 --alignment places.yaml -o site_2

    All is placed in the map of the first run. The folder is a run folder: check, export and view take it.
    """
    from stairmap.cli.merge import merge_run_folders  # noqa: PLC0415

    request = MergeRequest(runs=tuple(runs), alignment=alignment, output=output, as_json=as_json)
    raise typer.Exit(merge_run_folders(request))
