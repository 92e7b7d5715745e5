"""Options of ``stairmap evaluate``."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from stairmap.cli.evaluate_request import EvaluateRequest
from stairmap.cli.options import METHOD, OUTPUT, ConfigOption, DebugOption, JsonOption, SetOption
from stairmap.evaluation.data_folder import DATA_FOLDER

_TRIALS = "Trials"

_SIMULATED = ("table1", "stairs", "buildings", "look-alikes", "kind-drives")
"""``stairmap.evaluation.suites`` is too heavy to import for ``--help``."""


class Suite(str, Enum):
    """Names of the suites; ``all`` is all but those of single frames and those without a camera."""

    table1 = "table1"
    stairs = "stairs"
    buildings = "buildings"
    look_alikes = "look-alikes"
    kind_drives = "kind-drives"
    real = "real"
    rates = "rates"
    kinds = "kinds"
    clouds = "clouds"
    sweeps = "sweeps"
    all = "all"


class Methods(str, Enum):
    """What ``--method`` takes here."""

    both = "both"
    stairmap = "stairmap"
    delmerico2013 = "delmerico2013"


def evaluate(
    *,
    suites: Annotated[
        list[Suite],
        typer.Argument(
            metavar="SUITE...",
            help="table1, stairs, buildings, look-alikes, kind-drives, real; all: all of these; "
            "single frames: rates, kinds; without a camera: clouds, sweeps.",
            show_default=False,
        ),
    ],
    method: Annotated[
        Methods,
        typer.Option(metavar="NAME", help="stairmap, delmerico2013 or both.", rich_help_panel=METHOD),
    ] = Methods.both,
    config: ConfigOption = None,
    overrides: SetOption = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SCENE",
            help="Only scenes whose name holds this; may be repeated.",
            rich_help_panel=_TRIALS,
        ),
    ] = None,
    sensor: Annotated[
        str | None, typer.Option(metavar="NAME", help="This sensor in all trials.", rich_help_panel=_TRIALS)
    ] = None,
    width: Annotated[
        int | None,
        typer.Option(min=64, metavar="PX", help="Image width in all trials, px.", rich_help_panel=_TRIALS),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="NAME", help="This robot in all trials.", rich_help_panel=_TRIALS)
    ] = None,
    seed: Annotated[
        int,
        typer.Option(min=0, metavar="N", help="Seed of each scene's first drive.", rich_help_panel=_TRIALS),
    ] = 0,
    drives: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Drives per scene.", rich_help_panel=_TRIALS, show_default=False
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="One drive per scene, few frames of 320 px.", rich_help_panel=_TRIALS),
    ] = False,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Only this kind of kinds; may be repeated.", rich_help_panel=_TRIALS
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder with the folders buildings and real, for these two suites (docs/evaluation.md).",
            show_default=False,
            rich_help_panel=_TRIALS,
        ),
    ] = None,
    cache: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Keep rendered frames here, for the next run (50 MB a trial).",
            show_default=False,
            rich_help_panel=_TRIALS,
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Processes. Default: one per core.",
            show_default=False,
            rich_help_panel=_TRIALS,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="New or empty folder for tables.md, results.json and pictures.",
            show_default=False,
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    convergence: Annotated[
        bool,
        typer.Option(
            "--convergence",
            help="Draw how each trial converges (report, figure 8); needs -o.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    as_json: JsonOption = False,
    debug: DebugOption = False,
) -> None:
    """Compare the results of methods with the known truth of many trials, and print tables.

    \b
    Examples:
      stairmap evaluate table1 --quick
      stairmap evaluate stairs --only half_turn --sensor d435 --method stairmap
      stairmap evaluate all --cache ~/frames -o results/evaluation
      stairmap evaluate rates -o results/rates
      stairmap evaluate kinds --kind descending --kind roll --method stairmap
      stairmap evaluate clouds sweeps --data ~/data -o results/points

    docs/evaluation.md says what is judged, and how.
    """
    from stairmap.cli.evaluate import evaluate_methods  # noqa: PLC0415

    names = [suite.value for suite in suites]
    if "all" in names:
        more = [name for name in names if name in ("rates", "kinds", "clouds", "sweeps")]
        names = [*_SIMULATED, "real", *more]
    if output is None and ("rates" in names or convergence):
        raise typer.BadParameter("pictures need --output DIR")
    request = EvaluateRequest(
        suites=tuple(dict.fromkeys(names)),
        methods=("stairmap", "delmerico2013") if method is Methods.both else (method.value,),
        only=tuple(only or ()),
        sensor=sensor,
        width=width,
        robot=robot,
        seed=seed,
        num_drives=drives,
        is_quick=quick,
        kinds=tuple(kind or ()),
        data=DATA_FOLDER if data is None else data,
        cache=cache,
        num_workers=jobs,
        config_file=config,
        overrides=tuple(overrides or ()),
        output=output,
        with_convergence=convergence,
        as_json=as_json,
    )
    raise typer.Exit(evaluate_methods(request))
