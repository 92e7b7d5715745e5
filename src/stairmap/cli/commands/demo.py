"""Options of ``stairmap demo``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import OUTPUT, DebugOption, JsonOption


def demo(
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="New or empty folder for the results. Default: results/demo_<n>, the next free n.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Simulate a robot that drives up to a known stairway; compare estimated and true dimensions.

    \b
    Examples:
      stairmap demo
      stairmap demo -o results/first
    """
    from stairmap.cli.demo import run_demo  # noqa: PLC0415

    raise typer.Exit(run_demo(output=output, as_json=as_json))
