"""Help, version, choices: quick to show and true."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import stairmap as package
from command_line import stairmap
from stairmap.cli.options import Method, Up
from stairmap.kernels import describe_kernels
from stairmap.pipeline import METHODS
from stairmap.recordings.map_up import UP_AUTO, UP_AXES

COMMANDS = (
    "run",
    "detect",
    "inspect",
    "view",
    "check",
    "export",
    "plan",
    "demo",
    "simulate",
    "config",
    "batch",
)

HEAVY = ("numpy", "scipy", "cv2", "pydantic", "yaml", "matplotlib", "embreex", "jinja2", "rerun", "foxglove")


def modules_loaded_by(code):
    script = f"import sys\n{code}\nprint(*sys.modules, file=sys.stderr)"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(result.stderr.split())


def test_help_imports_nothing_heavy():
    code = "from stairmap.__main__ import main\nsys.argv = ['stairmap', '--help']\n"
    code += "try: main()\nexcept SystemExit: pass"
    assert not modules_loaded_by(code) & set(HEAVY)


def test_importing_the_package_imports_nothing_heavy():
    assert not modules_loaded_by("import stairmap") & {*HEAVY, "typer", "rich"}


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS)])
def test_help_opens_with_examples(command):
    outcome = stairmap(*command, "--help")
    assert outcome.code == 0
    before_options = outcome.stdout.split("─")[0]
    assert "Examples:" in before_options
    assert before_options.count("\n   stairmap ") >= 2


def test_version_is_that_of_the_package_and_tells_which_kernels_are_used():
    version, used = stairmap("--version").stdout.splitlines()
    assert version == f"stairmap {package.__version__}"
    assert used == f"kernels: {describe_kernels()}"


def test_choices_are_those_of_the_code():
    assert {method.value for method in Method} == set(METHODS)
    assert {up.value for up in Up} == {*UP_AXES, UP_AUTO}


def test_terminal_that_cannot_spell_a_sign_gets_another():
    result = subprocess.run(
        [sys.executable, "-m", "stairmap", "config"],
        env={**os.environ, "PYTHONIOENCODING": "latin-1"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "(? 0, < 90)" in result.stdout
