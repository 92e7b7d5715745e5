"""How a command ends: exit codes, one line for an error, no traceback without ``--debug``."""

from __future__ import annotations

import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from stairmap.errors import StairmapError

EXIT_ERROR = 1
EXIT_INTERRUPTED = 130

_DEBUG_KEY = "stairmap.debug"


def warn(sentence: str) -> None:
    """Tell on stderr of something that does not stop the command."""
    typer.echo(f"warning: {' '.join(sentence.split())}", err=True)


class CommandGroup(TyperGroup):
    """Commands whose ``StairmapError`` becomes one line on stderr and exit code 1."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was typed."""
        try:
            return super().invoke(ctx)
        except StairmapError as error:
            if ctx.meta.get(_DEBUG_KEY):
                typer.echo(traceback.format_exc(), err=True, nl=False)
            else:
                typer.echo(f"error: {' '.join(str(error).split())}", err=True)
            raise typer.Exit(EXIT_ERROR) from error
        except KeyboardInterrupt as error:
            typer.echo("interrupted", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from error


def remember_debug(ctx: typer.Context, value: bool) -> bool:
    """Note for ``CommandGroup`` whether ``--debug`` was given."""
    ctx.meta[_DEBUG_KEY] = value
    return value
