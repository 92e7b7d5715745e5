"""``stairmap finish``: complete the folder of a run that was killed."""

from __future__ import annotations

from pathlib import Path

import typer

from stairmap.export.finishing import finish_run_folder
from stairmap.export.summary import counted, format_table


def finish_run(run: Path) -> int:
    """Write what is missing in a run folder, print the table; return the exit code.

    Raises
    ------
    StairmapError
        If it is no run folder, its logs cannot be read, or a file cannot be written.
    """
    finished = finish_run_folder(run)
    if not finished.written:
        typer.echo("nothing is missing", err=True)
    else:
        typer.echo(f"written: {', '.join(finished.written)}", err=True)
    results = finished.results
    typer.echo(f"{counted(results.num_frames, 'frame')}\n\n{format_table(results.stairways)}\n{run}")
    return 0
