"""Options of ``stairmap finish``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import DebugOption


def finish(
    *,
    run: Annotated[Path, typer.Argument(help="Folder of the run that was killed.", show_default=False)],
    debug: DebugOption = False,
) -> None:
    """Complete the folder of a run that was killed, from what it had written by then.

    \b
    Examples:
      stairmap finish results/hall_1
      stairmap finish results/hall_1 && stairmap export results/hall_1 -f ply

    The recording is not needed. To look at the frames that the run did not come to, run it again.
    """
    from stairmap.cli.finish import finish_run  # noqa: PLC0415

    raise typer.Exit(finish_run(run))
