"""Runs the command line inside the test's process."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from stairmap.cli.app import app

COMMANDS = typer.main.get_command(app)
"""All commands, built once: it takes ten times as long as most refusals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a command left behind: exit code and both streams."""

    code: int
    stdout: str
    stderr: str

    @property
    def last_line(self) -> str:
        return self.stdout.rstrip("\n").rpartition("\n")[2]


def stairmap(*arguments: str | Path) -> Outcome:
    """Run ``stairmap ARGUMENTS``."""
    stdout, stderr = io.StringIO(), io.StringIO()
    with redirect_stdout(stdout), redirect_stderr(stderr), pytest.raises(SystemExit) as ending:
        COMMANDS([str(argument) for argument in arguments], prog_name="stairmap")
    return Outcome(code=int(ending.value.code or 0), stdout=stdout.getvalue(), stderr=stderr.getvalue())


def check_refused(outcome: Outcome, *words: str) -> None:
    """Check for exit code 1, one line on stderr that holds all words, and nothing on stdout."""
    assert outcome.code == 1
    assert outcome.stdout == ""
    assert outcome.stderr.count("\n") == 1
    assert outcome.stderr.startswith("error: ")
    for word in words:
        assert word in outcome.stderr
