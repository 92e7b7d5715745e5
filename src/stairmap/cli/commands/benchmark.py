"""Options of ``stairmap benchmark``."""

from __future__ import annotations

from typing import Annotated

import typer

from stairmap.cli.options import DebugOption, JsonOption
from stairmap.cli.requests import BenchmarkRequest

_TASKS = "Tasks"
_PROGRAMS = "Programs"


def benchmark(
    *,
    programs: Annotated[
        list[str] | None,
        typer.Option(
            "--program",
            metavar="NAME=COMMAND",
            help="A detector to enter; may be repeated. It answers a line for each line (docs/benchmark.md).",
            rich_help_panel=_PROGRAMS,
            show_default=False,
        ),
    ] = None,
    no_own: Annotated[
        bool,
        typer.Option("--no-own", help="Leave our own two methods out.", rich_help_panel=_PROGRAMS),
    ] = False,
    timeout: Annotated[
        float,
        typer.Option(
            "--timeout", min=0.1, max=86400, metavar="S", help="Time for an answer, s.",
            rich_help_panel=_PROGRAMS,
        ),
    ] = 120.0,
    frames: Annotated[
        int,
        typer.Option("--frames", min=0, metavar="N", help="Single frames.", rich_help_panel=_TASKS),
    ] = 60,
    drives: Annotated[
        int,
        typer.Option("--drives", min=0, metavar="N", help="Drives with poses.", rich_help_panel=_TASKS),
    ] = 6,
    clouds: Annotated[
        int,
        typer.Option("--clouds", min=0, metavar="N", help="Finished maps of points.", rich_help_panel=_TASKS),
    ] = 6,
    seed: Annotated[
        int,
        typer.Option(
            "--seed", min=0, metavar="N", help="Same seed, same tasks. Tell it with every result.",
            rich_help_panel=_TASKS,
        ),
    ] = 0,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:  # fmt: skip
    """Score any stair detector on generated frames, drives and maps whose truth is known.

    \b
    Examples:
      stairmap benchmark
      stairmap benchmark --program mine='python my_detector.py' --seed 3
      stairmap benchmark --program mine=./detector --no-own --frames 500 --drives 0 --clouds 0 --json
    """
    from stairmap.cli.benchmark import score_programs  # noqa: PLC0415

    pairs = []
    for text in programs or ():
        name, separator, command = text.partition("=")
        if not separator or not name.strip() or not command.strip():
            raise typer.BadParameter(f"--program: expected NAME=COMMAND, got {text!r}")
        pairs.append((name.strip(), command))
    request = BenchmarkRequest(
        programs=tuple(pairs),
        with_own=not no_own,
        timeout=timeout,
        num_frames=frames,
        num_drives=drives,
        num_clouds=clouds,
        seed=seed,
        as_json=as_json,
    )
    raise typer.Exit(score_programs(request))
