"""Files that a disk, a cable or an editor has spoilt: never a traceback, never more than a line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from command_line import Outcome, stairmap
from corruptible_files import KINDS, Kind, write_corruptible_files
from corruptions import NUM_NIGHTLY, NUM_QUICK, check_corruptions
from stairmap.cli.exits import FAULT
from stairmap.errors import StairmapError
from test_bad_inputs import limits

NO_WAY = 3
"""Exit code of ``plan``."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corrupt")
    write_corruptible_files(folder)
    return folder


def call(kind: Kind, folder: Path) -> Outcome:
    """Let what reads a kind of file read it."""
    try:
        with limits():
            if kind.reads is None:
                return stairmap(*kind.arguments)
            kind.reads(folder / kind.path)
            return Outcome(code=0, stdout="", stderr="")
    except StairmapError as error:
        return Outcome(code=1, stdout="", stderr=f"error: {error}\n")
    finally:
        made = folder / kind.made
        if made.is_dir():
            shutil.rmtree(made)
        else:
            made.unlink(missing_ok=True)


def check_corrupted(kind: Kind, folder: Path, corrupt: Callable[[bytes], bytes]) -> None:
    path = folder / kind.path
    original = path.read_bytes()
    try:
        path.write_bytes(corrupt(original))
        outcome = call(kind, folder)
    finally:
        path.write_bytes(original)
    text = outcome.stdout + outcome.stderr
    assert FAULT not in text and "Traceback" not in text and "not enough memory" not in text, text
    # No way is an answer of plan: a map may have become one without a way.
    assert outcome.code in (0, 1) or (outcome.code, kind.arguments[0]) == (NO_WAY, "plan")
    if outcome.code == 1:
        errors = [line for line in outcome.stderr.splitlines() if line.startswith("error: ")]
        assert len(errors) == 1 and outcome.stderr.endswith(f"{errors[0]}\n"), outcome.stderr


def check_often(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.chdir(folder)
    whole = call(KINDS[name], folder)
    assert whole.code == 0, whole.stderr  # what is refused anyway would test nothing
    check_corruptions(lambda corrupt: check_corrupted(KINDS[name], folder, corrupt), number)


@pytest.mark.parametrize("name", KINDS)
def test_corrupt_file_is_told_or_read(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_often(name, folder, monkeypatch, NUM_QUICK)


@pytest.mark.nightly
@pytest.mark.parametrize("name", KINDS)
def test_corrupt_file_is_told_or_read_two_thousand_times(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_often(name, folder, monkeypatch, NUM_NIGHTLY)
