"""Which kernels are used, and what is said of it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from pytest import MonkeyPatch

from stairmap.kernels import choice


def describe_with(**environment: str) -> str:
    """What a new interpreter says."""
    code = "from stairmap.kernels import describe_kernels; print(describe_kernels())"
    outcome = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return outcome.stdout.strip()


def test_numpy_can_be_asked_for() -> None:
    assert describe_with(STAIRMAP_KERNELS="numpy") == (
        "NumPy, several times slower: STAIRMAP_KERNELS=numpy asks for them"
    )


def test_what_was_not_built_is_said_with_what_to_install(monkeypatch: MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.delenv(choice.VARIABLE, raising=False)
    monkeypatch.delenv(choice.COMPILED_FILE, raising=False)
    monkeypatch.setattr(choice.importlib, "import_module", missing)
    module, reason = choice._find_module()
    assert module is None
    assert "apt install g++ python3-dev" in reason
    assert reason.endswith("run: make kernels")
    monkeypatch.setattr(choice, "_SOURCES", Path("/nowhere"))
    assert choice._find_module()[1].endswith("reinstall stairmap")


def test_a_module_of_other_sources_is_not_used(monkeypatch: MonkeyPatch, tmp_path: Path) -> None:
    class Stale:
        SOURCE_SUM = "of yesterday"

    (tmp_path / "kernel.cpp").write_text("int today;\n")
    monkeypatch.delenv(choice.VARIABLE, raising=False)
    monkeypatch.delenv(choice.COMPILED_FILE, raising=False)
    monkeypatch.setattr(choice, "_SOURCES", tmp_path)
    monkeypatch.setattr(choice.importlib, "import_module", lambda name: Stale)
    assert choice._find_module() == (None, "the compiled ones are of other sources; run: make kernels")


def test_a_module_that_does_not_load_says_why(monkeypatch: MonkeyPatch) -> None:
    def broken(name: str) -> None:
        raise ImportError("undefined symbol")

    monkeypatch.delenv(choice.VARIABLE, raising=False)
    monkeypatch.delenv(choice.COMPILED_FILE, raising=False)
    monkeypatch.setattr(choice.importlib, "import_module", broken)
    module, reason = choice._find_module()
    assert module is None
    assert "undefined symbol" in reason
