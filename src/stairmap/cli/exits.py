"""How a command ends: exit codes, one line for an error, no traceback without ``--debug``."""

from __future__ import annotations

import os
import traceback
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from stairmap.errors import StairmapError

EXIT_ERROR = 1
EXIT_INTERRUPTED = 130

_DEBUG_KEY = "stairmap.debug"


def warn(sentence: str) -> None:
    """Tell on stderr of something that does not stop the command."""
    typer.echo(f"warning: {' '.join(sentence.split())}", err=True)


# What typer answers itself: wrong usage and the ends of commands.
_USAGE_ERRORS: tuple[type[Exception], ...] = tuple(
    kind
    for kind in typer.BadParameter.__mro__
    if issubclass(kind, Exception) and kind.__name__ == "ClickException"
)
_OWN_ERRORS: tuple[type[Exception], ...] = (typer.Exit, typer.Abort, *_USAGE_ERRORS)


def _without_flag_types(parameters: list[Any]) -> list[Any]:
    """Take the type out of the help of options that take no value."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
    return parameters


class Command(TyperCommand):
    """A command whose help shows no type for options without a value; it knows beginnings of options."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its parameters."""
        return _without_flag_types(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse arguments; an option that is not known names those that begin or look like it."""
        try:
            return super().parse_args(ctx, args)
        except _USAGE_ERRORS as error:
            name = getattr(error, "option_name", None)
            if name is not None and hasattr(error, "possibilities"):
                known = [text for parameter in self.get_params(ctx) for text in parameter.opts]
                begun = [text for text in known if text.startswith(name) and len(name) > 2]
                error.possibilities = sorted({*begun, *(error.possibilities or ())})
            raise


class CommandGroup(TyperGroup):
    """Commands whose ``StairmapError`` becomes one line on stderr and exit code 1."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return its parameters."""
        return _without_flag_types(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that was typed; one that is not known names those that begin like it."""
        try:
            return super().resolve_command(ctx, args)
        except _USAGE_ERRORS as error:
            begun = [name for name in self.commands if args and name.startswith(args[0])]
            message = str(getattr(error, "message", ""))
            if begun and "Did you mean" not in message and hasattr(error, "message"):
                names = ", ".join(repr(name) for name in begun)
                error.message = f"{message.rstrip('.')}. Did you mean {names}?"
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was typed."""
        try:
            return super().invoke(ctx)
        except _OWN_ERRORS:
            raise
        except KeyboardInterrupt as error:
            typer.echo("interrupted", err=True)
            raise typer.Exit(EXIT_INTERRUPTED) from error
        except Exception as error:
            if ctx.meta.get(_DEBUG_KEY):
                typer.echo(traceback.format_exc(), err=True, nl=False)
            else:
                typer.echo(f"error: {_describe(error)}", err=True)
            raise typer.Exit(EXIT_ERROR) from error


def _describe(error: Exception) -> str:
    """Return a line for an error."""
    if isinstance(error, StairmapError):
        # A name in it may hold what moves the cursor, or is no text at all.
        return " ".join(shown_line(str(error)).split())
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; leave frames out, or close other programs"
    place = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(shown_line(str(error)).split())
    return (
        f"{FAULT} ({type(error).__name__} in {os.path.basename(place.filename)}:{place.lineno}: {text}); "  # noqa: PTH119
        "please report it with what --debug prints"
    )


FAULT = "a fault of stairmap itself"
"""How the line begins for an error that nobody expected."""


def shown_line(text: str) -> str:
    """Return a text without characters that control a terminal; line ends stay."""
    return "".join(
        character
        if character.isprintable() or character in "\n\t" or "\udc80" <= character <= "\udcff"
        else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def remember_debug(ctx: typer.Context, value: bool) -> bool:
    """Note for ``CommandGroup`` whether ``--debug`` was given."""
    ctx.meta[_DEBUG_KEY] = value
    return value
