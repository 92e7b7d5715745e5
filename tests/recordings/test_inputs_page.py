"""What docs/inputs.md shows can be copied and works."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from stairmap.recordings.open import open_recording

PAGE = Path(__file__).parents[2] / "docs" / "inputs.md"


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def test_the_python_example_writes_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = _blocks("python")
    exec(compile(code, str(PAGE), "exec"), {})
    recording = open_recording(Path("my_recording"))
    assert len(list(recording)) == 3
    assert len(recording.check_poses()) == 3
    assert not recording.problems


def test_the_camera_files_are_read(make_recording: Callable[..., Path]) -> None:
    folder = make_recording()
    blocks = _blocks("json")
    assert len(blocks) == 2
    for block in blocks:
        assert json.loads(block)["width"] == 640
        (folder / "camera.json").write_text(block.replace("640", "32").replace("480", "24"))
        assert len(list(open_recording(folder))) == 4
