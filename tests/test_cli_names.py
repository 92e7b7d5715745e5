"""Names that are no UTF-8 or hold line ends: results are written, tables stay tables."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from command_line import stairmap
from small_recordings import write_recording
from stairmap.cli.plain_table import format_columns
from stairmap.export.loading import load_stairways
from test_bad_inputs import ROBOT

NAMES = {
    "no UTF-8": b"st\xffairs",
    "line end": b"st\nairs",
    "control characters": b"st\x07\x0b\tairs",
    "blanks and quotes": b" st'ai\"rs $x$ <b>&",
}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_recording(tmp_path_factory.mktemp("recordings") / "plain", num_frames=4)


@pytest.mark.parametrize("name", NAMES)
def test_folder_of_any_name_is_run_checked_exported_and_viewed(
    name: str, recording: Path, tmp_path: Path
) -> None:
    folder = tmp_path / os.fsdecode(NAMES[name])
    folder.mkdir()
    shutil.copytree(recording, folder / "recording")
    command = [sys.executable, "-m", "stairmap"]
    run = subprocess.run(
        [*command, "run", folder / "recording", "-o", folder / "run", "--robot", "spot", "--no-report"],
        capture_output=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == b""
    # The path as it is, for whatever reads it.
    assert run.stdout.endswith(os.fsencode(folder / "run") + b"\n")
    assert len(load_stairways(folder / "run").stairways) == 1
    assert (folder / "run" / "summary.txt").read_text(encoding="utf-8")
    assert json.loads((folder / "run" / "recording.json").read_text())["path"] == str(folder / "recording")
    for arguments in (
        ("check", folder / "run", "--robot", "spot", "--picture", folder / "verdicts.png"),
        ("export", folder / "run", "-f", "ply", "-f", "nav2-graph"),
        ("plan", folder / "run", "-o", folder / "plan"),
        ("view", folder / "run", "--page", folder / "page.html"),
        ("inspect", folder / "recording"),
        ("detect", folder / "recording", "-o", folder / "detected"),
    ):
        outcome = stairmap(*arguments)
        assert outcome.code == 0, (arguments[0], outcome.stderr)
    refused = stairmap("run", folder / "nowhere")
    assert refused.code == 1
    assert refused.stderr.count("\n") == 1
    assert "\x1b" not in refused.stderr


@pytest.mark.parametrize("name", ["bad\nbot", "bad\x1b[2Jbot", "bad\tbot $x^$", "b\u202eot"])
def test_robot_of_any_name_has_one_row_and_a_picture(name: str, run_folder: Path, tmp_path: Path) -> None:
    profile = tmp_path / "bot.yaml"
    profile.write_text(yaml.safe_dump({**ROBOT, "name": name}))
    outcome = stairmap("check", run_folder, "--robot", profile, "--picture", tmp_path / "verdicts.png")
    assert outcome.code == 0, outcome.stderr
    rows = outcome.stdout.split("\n\n")[0].splitlines()
    assert len(rows) == 3
    assert all(row.isprintable() for row in rows)
    assert (tmp_path / "verdicts.png").exists()
    values = json.loads(stairmap("check", run_folder, "--robot", profile, "--json").stdout)
    assert values["assessments"][0]["robot"] == name


def test_table_keeps_its_rows_and_columns() -> None:
    lines = format_columns(("what", "m"), [("a\nb", "1"), ("c\td", "2")], left_aligned=("what",)).splitlines()
    assert lines == ["what  m", "----  -", "a\\nb  1", "c\\td  2"]


def test_frame_of_any_name_is_shown_in_one_line(run_folder: Path, tmp_path: Path) -> None:
    run = shutil.copytree(run_folder, tmp_path / "run")
    values = json.loads((run / "stairways.json").read_text())
    values["frame_id"] = "map\n\x1b[31m</script>"
    (run / "stairways.json").write_text(json.dumps(values))
    assert stairmap("view", run, "--page", tmp_path / "page.html").code == 0
    page = (tmp_path / "page.html").read_text()
    assert "map\\n\\x1b[31m" in page and "\x1b" not in page
