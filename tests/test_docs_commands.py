"""Commands of README and docs are ones that there are, with options that there are."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer

from stairmap.cli.app import app

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
GROUP = typer.main.get_command(app)


def documented_commands() -> list[tuple[str, str]]:
    found = []
    for page in PAGES:
        is_code = False
        for line in page.read_text(encoding="utf-8").splitlines():
            if line.startswith("```"):
                is_code = not is_code
            elif is_code and re.match(r"(\$ )?stairmap [a-z]", line):
                found.append((page.name, line.removeprefix("$ ").split("  #")[0].split(" && ")[0]))
    return found


@pytest.mark.parametrize(("page", "line"), documented_commands())
def test_documented_command_can_be_parsed(page: str, line: str) -> None:
    _, name, *arguments = shlex.split(line)
    assert name in GROUP.commands, (page, line)  # type: ignore[attr-defined]
    command = GROUP.commands[name]  # type: ignore[attr-defined]
    known = {option for parameter in command.params for option in parameter.opts}
    for argument in arguments:
        if argument.startswith("--"):
            assert argument.partition("=")[0] in known, (page, line)


def test_readme_names_no_recording_that_it_does_not_make() -> None:
    lines = [line for page, line in documented_commands() if page == "README.md"]
    made = {"walk"} | {
        shlex.split(line)[shlex.split(line).index("-o") + 1] for line in lines if " -o " in line
    }
    for line in lines:
        words = shlex.split(line)
        if words[1] in ("run", "detect", "inspect"):
            assert words[2] in made, line
