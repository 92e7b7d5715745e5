"""The ``stairmap`` command: its subcommands and what is common to all of them."""

from __future__ import annotations

from typing import Annotated

import typer

import stairmap
from stairmap.cli.commands.batch import batch
from stairmap.cli.commands.benchmark import benchmark
from stairmap.cli.commands.check import check
from stairmap.cli.commands.clean import clean
from stairmap.cli.commands.config import config
from stairmap.cli.commands.demo import demo
from stairmap.cli.commands.detect import detect
from stairmap.cli.commands.evaluate import evaluate
from stairmap.cli.commands.explore import explore
from stairmap.cli.commands.export import export
from stairmap.cli.commands.finish import finish
from stairmap.cli.commands.inspect import inspect
from stairmap.cli.commands.live import live
from stairmap.cli.commands.merge import merge
from stairmap.cli.commands.plan import plan
from stairmap.cli.commands.run import run
from stairmap.cli.commands.scan import scan
from stairmap.cli.commands.simulate import simulate
from stairmap.cli.commands.view import view
from stairmap.cli.exits import Command, CommandGroup

app = typer.Typer(
    cls=CommandGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""Find stairways in depth recordings and model each one as a whole.

\b
Examples:
  stairmap demo                   a simulated robot at a known stairway
  stairmap run my_recording       the stairways in the map, with a report
  stairmap scan building.laz      the stairways of a finished map
  stairmap detect my_recording    each frame by itself, no poses needed
""",
    epilog="Exit code: 0 ran (also without a stairway), 1 error, 2 wrong usage, 130, 143 or 129 interrupted.",
)
for command in (
    run,
    scan,
    batch,
    merge,
    detect,
    live,
    view,
    inspect,
    check,
    export,
    clean,
    plan,
    explore,
    finish,
    demo,
    simulate,
    evaluate,
    benchmark,
    config,
):
    app.command(cls=Command)(command)


def _print_version(is_asked: bool) -> None:
    if is_asked:
        from stairmap.kernels.choice import describe_kernels  # noqa: PLC0415

        typer.echo(f"stairmap {stairmap.__version__}\nkernels: {describe_kernels()}")
        raise typer.Exit


@app.callback()
def _stairmap(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            "-V",
            help="Print the version, and which kernels are used.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    pass
