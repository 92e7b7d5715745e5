"""What a user expects of a command: completion, abbreviations, progress in a log, nothing overwritten."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from command_line import COMMANDS, check_refused, stairmap
from small_recordings import write_recording
from stairmap.cli import progress
from stairmap.cli.progress import FrameProgress, TrialProgress
from stairmap.evaluation.running import TrialSettings
from stairmap.evaluation.trials import TrialResult, TrialSpec
from stairmap.visualization.overlay import NUMBER_HEIGHT, NUMBER_SPACING, _free_place

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS.commands)])
def test_help_shows_no_type_for_options_without_a_value(command: tuple[str, ...]) -> None:
    text = stairmap(*command, "--help").stdout
    assert "<bool>" not in text and "BOOL" not in text
    assert "--help" in text


def test_completion_can_be_shown_and_installed() -> None:
    assert "--install-completion" in stairmap("--help").stdout
    result = subprocess.run(
        [sys.executable, "-m", "stairmap", "--show-completion", "bash"],
        capture_output=True, text=True, check=False,
        # Tests may run without a shell above them.
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"},
    )  # fmt: skip
    assert "stairmap" in result.stdout + result.stderr


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (("sim",), "'simulate'"),
        (("eval",), "'evaluate'"),
        (("insp",), "'inspect'"),
        (("deteckt",), "'detect'"),
    ],
)
def test_abbreviated_command_names_what_was_meant(typed: tuple[str, ...], meant: str) -> None:
    outcome = stairmap(*typed)
    assert outcome.code == 2
    assert "Did you mean" in outcome.stderr and meant in outcome.stderr


@pytest.mark.parametrize(
    ("typed", "meant"), [("--traj", "--trajectory"), ("--out", "--output"), ("--no-r", "--no-report")]
)
def test_abbreviated_option_names_what_was_meant(typed: str, meant: str) -> None:
    outcome = stairmap("run", "hall", typed)
    assert outcome.code == 2
    assert meant in outcome.stderr


def test_progress_in_a_log_is_a_line_a_period_with_an_end_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [1000.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress.time, "time", lambda: 0.0)
    monkeypatch.setattr(progress.time, "localtime", progress.time.gmtime)
    with FrameProgress(400) as bar:
        for _ in range(130):
            now[0] += 1.0
            bar.advance("2 stairways")
    lines = capsys.readouterr().err.splitlines()
    # 60 frames in 60 s of 400: 340 s more; 120 in 120 s: 280 s more.
    assert lines == [
        "frame 60/400 · 1 fps · 2 stairways · ends 00:05:40",
        "frame 120/400 · 1 fps · 2 stairways · ends 00:04:40",
    ]
    with TrialProgress(2) as bar:
        now[0] += 61.0
        bar.advance("b3")
    assert capsys.readouterr().err == "trial 1/2 · b3 · ends 00:01:01\n"
    with TrialProgress(1000, unit="recording", num_known=900) as bar:
        now[0] += 61.0
        bar.advance("1 stairway")
        now[0] += 61.0
        bar.advance("2 stairways")
    # Two of the hundred in 122 s: 98 more take 98 minutes and 98 s. Of one alone, nobody knows.
    assert capsys.readouterr().err.splitlines() == [
        "recording 901/1000 · 1 stairway",
        "recording 902/1000 · 2 stairways · ends 01:39:38",
    ]


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_bar_on_a_terminal_shows_an_end_time(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr(progress, "_PERIOD", 0.0)
    with FrameProgress(20) as bar:
        for _ in range(10):
            bar.advance("2 stairways")
        bar._bar._progress.refresh()
    assert re.search(r"frame 10/20 · \d+ fps · 2 stairways · ends \d\d:\d\d:\d\d", terminal.getvalue())


def test_short_work_says_nothing_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with FrameProgress(10) as bar:
        for _ in range(10):
            bar.advance()
    assert capsys.readouterr().err == ""


def test_no_output_is_ever_overwritten(run_folder: Path, tmp_path: Path) -> None:
    recording = run_folder.parent / "stairs"
    mine = {
        name: tmp_path / name for name in ("v.png", "p.html", "f.mcap", "s.rrd", "frame.png", "clean.ply")
    }
    for path in mine.values():
        path.write_text("mine")
    folder = tmp_path / "full"
    folder.mkdir()
    (folder / "stairways.ply").write_text("mine")
    points, other = tmp_path / "map.xyz", shutil.copytree(run_folder, tmp_path / "other")
    points.write_text("".join(f"{x / 9} {y / 9} 0\n" for x in range(20) for y in range(20)))
    for arguments in (
        ("check", run_folder, "--picture", mine["v.png"]),
        ("view", run_folder, "--page", mine["p.html"]),
        ("view", run_folder, "--foxglove", mine["f.mcap"]),
        ("view", run_folder, "--save", mine["s.rrd"]),
        ("inspect", recording, "--frame", "0", "-o", mine["frame.png"]),
        ("export", run_folder, "-f", "ply", "-o", folder),
        ("run", recording, "-o", folder),
        ("detect", recording, "-o", folder),
        ("plan", run_folder, "-o", folder),
        ("simulate", "b3", "-o", folder),
        ("demo", "-o", folder),
        ("evaluate", "table1", "--quick", "-o", folder),
        ("scan", points, "-o", folder),
        ("clean", points, "-o", mine["clean.ply"]),
        ("explore", "two_floors", "-o", folder),
        ("batch", recording, "-o", folder, "--workers", "0"),
        ("merge", run_folder, other, "-o", folder),
    ):
        outcome = stairmap(*arguments)
        assert outcome.code == 1, arguments
        assert re.search("overwritten|holds files|is not empty and no batch", outcome.stderr), outcome.stderr
    assert all(path.read_text() == "mine" for path in (*mine.values(), folder / "stairways.ply"))
    assert [path.name for path in folder.iterdir()] == ["stairways.ply"]


def test_second_export_goes_beside_the_first(run_folder: Path, tmp_path: Path) -> None:
    run = shutil.copytree(run_folder, tmp_path / "run")
    assert stairmap("export", run, "-f", "obj").last_line == str(run / "export" / "stairways.obj")
    assert stairmap("export", run, "-f", "obj").last_line == str(run / "export_2" / "stairways.obj")


def test_simulate_has_a_default_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("embreex", reason="needs the extra sim")
    monkeypatch.chdir(tmp_path)
    arguments = ("simulate", "b3", "--factor", "0.1", "--frames", "2")
    assert stairmap(*arguments).last_line == "recordings/b3_1"
    assert stairmap(*arguments).last_line == "recordings/b3_2"
    assert (tmp_path / "recordings" / "b3_2" / "truth.json").exists()


def test_plan_and_view_find_the_recording_and_refuse_another(run_folder: Path, tmp_path: Path) -> None:
    assert stairmap("plan", run_folder).code == 0
    run = shutil.copytree(run_folder, tmp_path / "run")
    recording = shutil.copytree(run_folder.parent / "stairs", tmp_path / "stairs")
    values = json.loads((run / "recording.json").read_text())
    assert values["identity"]["num_frames"] == 8
    assert set(values["identity"]) == {
        "num_frames",
        "first_stamp_ns",
        "last_stamp_ns",
        "camera",
        "stamps_sha256",
    }
    values["path"] = str(recording)
    (run / "recording.json").write_text(json.dumps(values))
    assert stairmap("plan", run).code == 0
    camera = json.loads((recording / "camera.json").read_text())
    for change, word in (
        (
            lambda: shutil.rmtree(recording) or write_recording(recording, num_frames=5),
            "frames 5 instead of 8",
        ),
        (lambda: shutil.rmtree(recording) or write_recording(recording), None),
        (
            lambda: (recording / "camera.json").write_text(json.dumps({**camera, "fx": 300})),
            "camera 320x240, fx 300.0",
        ),
        (lambda: (recording / "camera.json").write_text(json.dumps(camera)), None),
        (lambda: replace(recording / "depth.txt", "0.300000000", "0.310000000"), "list of stamps"),
    ):
        change()
        plan, view = stairmap("plan", run), stairmap("view", run, "--page", tmp_path / "page.html")
        (tmp_path / "page.html").unlink(missing_ok=True)
        if word is None:
            assert (plan.code, view.code, view.stderr) == (0, 0, "")
        else:
            check_refused(plan, "expected the recording of this run", word)
            # The viewer shows what there is without depth, and says why.
            assert view.code == 0 and word in view.stderr


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_report_says_where_it_comes_from(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("jinja2", reason="needs the extra report")
    # A name that is no UTF-8 is written as its escapes.
    recording = tmp_path / os.fsdecode(b"st\xffairs")
    shutil.copytree(run_folder.parent / "stairs", recording)
    monkeypatch.setattr(sys, "argv", ["stairmap", "run", "stairs"])
    assert stairmap("run", recording, "-o", tmp_path / "run").code == 0
    page = (tmp_path / "run" / "report.html").read_text()
    assert re.search(r"<br>date: \d{4}-\d\d-\d\d \d\d:\d\d", page)
    assert f"<br>recording: {tmp_path.resolve()}/st\\udcffairs" in page
    assert "<br>command: stairmap run stairs" in page
    assert "stairmap 0." in page


SPEC = TrialSpec(
    suite="table1", scene="b3", sensor="kinect_v1", robot="spot", seed=0, width=320, num_frames=2
)


def crash(specs: tuple[TrialSpec, ...], settings: TrialSettings, **_: object) -> tuple[TrialResult, ...]:
    return tuple(
        TrialResult(spec=spec, method=method, crash="ZeroDivisionError: no steps (fit.py:3)")
        for spec in specs
        for method in settings.methods
    )


def test_evaluation_with_a_crash_prints_its_table_and_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("embreex", reason="needs the extra sim")
    monkeypatch.setattr("stairmap.cli.evaluate.run_trials", crash)
    outcome = stairmap("evaluate", "table1", "--quick", "--only", "b3", "--method", "stairmap")
    assert outcome.code == 1
    assert "crashed: ZeroDivisionError" in outcome.stdout
    assert "error: 1 of 1 trials crashed; the first: b3" in outcome.stderr


def test_missing_extra_is_told_before_the_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    monkeypatch.setattr("stairmap.cli.evaluate.run_trials", lambda *_, **__: pytest.fail("began"))
    check_refused(stairmap("evaluate", "table1", "--quick"), "pip install 'stairmap[sim]'")


@pytest.mark.parametrize("example", ["01_one_image.py", "02_recording.py", "04_can_my_robot_climb_it.py"])
def test_example_without_arguments_says_its_usage(example: str) -> None:
    result = subprocess.run(
        [sys.executable, ROOT / "examples" / example], capture_output=True, text=True, check=False
    )
    assert result.returncode == 1
    assert result.stderr.startswith("usage:\n") and f"python examples/{example}" in result.stderr


def test_only_the_writers_write() -> None:
    """Every file goes through stairmap.output_files, which leaves no half of one.

    What is too large for the memory is written in pieces under the partial name of output_files. A lock and
    the scratch copy of a journal are no results.
    """
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for folder in ("src", "ros/stairmap_ros/stairmap_ros")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path.name not in ("output_files.py", "parameter_files.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\.write_(text|bytes)\(|\.open\(\"[wax]", line)
        and not re.search(r"folder\.write_(text|bytes)\(", line)
        and "self.write_" not in line
    ]
    assert found == [
        'src/stairmap/batch/batch_folder.py: self._lock = path.open("a+", encoding="utf-8")',
        'src/stairmap/batch/batch_folder.py: with (self.local_folder / JOURNAL_FILE).open("wb") as file:',
        "src/stairmap/batch/table_files.py: "
        'partials[0].open("w", encoding="utf-8", errors="backslashreplace", newline="") as file,',
        'src/stairmap/export/cloud_cleaning.py: with path.open("wb") as file:',
        "src/stairmap/visualization/error_keeping_file.py: "
        'self._file = self._written.open("wb", buffering=0)',
        'ros/stairmap_ros/stairmap_ros/map_file_lock.py: self._file = lock.open("a+", encoding="utf-8")',
    ]


def test_only_the_loader_reads_texts() -> None:
    """JSON, YAML, text and arrays of others go through input_files and array_files, which have limits."""
    own = (
        *("input_files.py", "array_files.py", "codes.py", "robot_profile.py", "view_running.py"),
        *("page.py", "report.py", "scan_report.py"),
        "task_process.py",  # /proc
        "parameter_files.py",  # pages of ours
    )
    found = [
        f"{path.name}: {line.strip()}"
        for folder in ("src", "ros/stairmap_ros/stairmap_ros")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path.name not in own
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"\.read_text\(|json\.loads?\(|yaml\.(safe_)?load\(|np\.load\(", line)
    ]
    assert found == []


def test_step_numbers_are_complete_and_lie_apart() -> None:
    taken: list[np.ndarray] = []
    for step in range(12):  # far steps: 3 px apart
        ends = np.array([[300.0, 200.0 - 3 * step], [420.0, 200.0 - 3 * step]])
        place = _free_place(ends, taken, 640)
        for other in taken:
            assert abs(place[0] - other[0]) >= NUMBER_SPACING or abs(place[1] - other[1]) >= NUMBER_HEIGHT
        taken.append(place)
