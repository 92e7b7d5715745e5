"""Options of ``stairmap live``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.options import (
    INPUT,
    METHOD,
    OUTPUT,
    ConfigOption,
    DebugOption,
    Method,
    MethodOption,
    OutputOption,
    SetOption,
)
from stairmap.cli.requests import LiveRequest


def live(
    *,
    realsense: Annotated[
        bool,
        typer.Option("--realsense", help="A RealSense camera (extra realsense).", rich_help_panel=INPUT),
    ] = False,
    serial: Annotated[
        str | None,
        typer.Option(
            "--serial",
            metavar="NUMBER",
            help="Which camera, where there are several.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    playback: Annotated[
        Path | None,
        typer.Option(
            "--playback",
            metavar="FILE",
            help="A file of the RealSense recorder instead of a camera, at its own speed.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    num_frames: Annotated[
        int | None,
        typer.Option(
            "--frames",
            min=1,
            metavar="N",
            help="End after N frames. Default: at Ctrl-C.",
            rich_help_panel=INPUT,
            show_default=False,
        ),
    ] = None,
    odometry: Annotated[
        bool,
        typer.Option(
            "--odometry",
            help="Also make a map: poses from the depth itself (extra odometry).",
            rich_help_panel=METHOD,
        ),
    ] = False,
    method: MethodOption = Method.stairmap,
    config: ConfigOption = None,
    overrides: SetOption = None,
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="DIR",
            help="Also write the frames looked at as a recording; new or empty folder.",
            rich_help_panel=OUTPUT,
            show_default=False,
        ),
    ] = None,
    output: OutputOption = None,
    debug: DebugOption = False,
) -> None:
    """Look for stairs with a live camera until Ctrl-C. A slow computer skips frames and does not lag behind.

    \b
    Examples:
      stairmap live --realsense
      stairmap live --realsense --odometry --record hall -o results/hall
      stairmap live --realsense --playback recorded.db3
    """
    if not realsense:
        raise typer.BadParameter("expected --realsense: no other cameras are known")
    from stairmap.cli.live import run_live  # noqa: PLC0415

    request = LiveRequest(
        serial=serial,
        playback=playback,
        num_frames=num_frames,
        with_odometry=odometry,
        method=method.value,
        config_file=config,
        overrides=tuple(overrides or ()),
        record=record,
        output=output,
    )
    raise typer.Exit(run_live(request))
