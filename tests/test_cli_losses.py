"""A full disk, a killed process, streams that nobody reads: results stay and the table is printed."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from command_line import stairmap
from full_disk import FullDisk
from small_recordings import repeat_frames, write_recording
from stairmap.export.loading import load_detections, load_run_trajectory, load_stairways
from stairmap.recordings.tum_trajectory import load_tum_trajectory

NUM_FRAMES = 70
LONG = 600
"""Frames of a run that is killed before it comes to its end."""

RESULT_ORDER = ("stairways.json", "trajectory.tum", "summary.txt", "stairways.ply", "report.html")
"""Most valuable first."""


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = write_recording(tmp_path_factory.mktemp("recordings") / "long")
    repeat_frames(folder, NUM_FRAMES)
    return folder


@pytest.fixture(scope="module")
def long_recording(tmp_path_factory):
    folder = write_recording(tmp_path_factory.mktemp("recordings") / "longer")
    repeat_frames(folder, LONG)
    return folder


@pytest.fixture(scope="module")
def short_recording(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("recordings") / "short")


def start(*arguments, **options):
    return subprocess.Popen(
        [sys.executable, "-m", "stairmap", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def has_whole_lines(path):
    return all(json.loads(line) for line in path.read_text().splitlines())


@pytest.mark.parametrize("size", [36_000, 60_000])
def test_run_on_a_disk_that_fills_up_keeps_the_result_and_prints_the_table(
    recording, tmp_path, monkeypatch, size
):
    FullDisk(monkeypatch, tmp_path, size)
    outcome = stairmap("run", recording, "-o", tmp_path / "run", "--no-report")
    assert outcome.code == 1
    assert f"{NUM_FRAMES} frames, stair edges seen in {NUM_FRAMES}" in outcome.stdout
    assert "170 ±" in outcome.stdout
    assert "detections.jsonl: No space left on device any more; the run goes on" in outcome.stderr
    assert outcome.stderr.splitlines()[-1].startswith("error: cannot write")
    results = load_stairways(tmp_path / "run")
    assert results.is_finished and results.num_frames == NUM_FRAMES
    assert len(results.stairways) == 1
    assert has_whole_lines(tmp_path / "run" / "detections.jsonl")
    assert has_whole_lines(tmp_path / "run" / "history.jsonl")
    assert not [path for path in (tmp_path / "run").iterdir() if path.name.startswith(".")]
    assert load_run_trajectory(tmp_path / "run") is not None
    assert stairmap("check", tmp_path / "run", "--robot", "spot").code == 0


def test_what_fits_is_written_most_valuable_first(short_recording, tmp_path, monkeypatch):
    monkeypatch.setattr("stairmap.recording_run.render_report", lambda _: "picture" * 20_000)
    whole = stairmap("run", short_recording, "-o", tmp_path / "whole")
    assert whole.code == 0
    sizes = {name: (tmp_path / "whole" / name).stat().st_size for name in RESULT_ORDER}
    logs = sum(
        (tmp_path / "whole" / name).stat().st_size
        for name in (
            "detections.jsonl",
            "history.jsonl",
            "trajectory.tum",
            "recording.json",
            "config.yaml",
            "log.txt",
        )
    )
    disk = tmp_path / "disk"
    for count in (1, 2, len(RESULT_ORDER) - 1):
        disk.mkdir()
        with monkeypatch.context() as patch:
            # Room for the logs and so many results; a file needs its room beside the one that it replaces.
            room = logs + sum(sizes[name] for name in RESULT_ORDER[:count]) + 1_000
            FullDisk(patch, disk, max(room, 34_000) if count < 3 else room + 30_000)
            outcome = stairmap("run", short_recording, "-o", disk / "run")
        written = [name for name in RESULT_ORDER if (disk / "run" / name).exists()]
        assert written == list(RESULT_ORDER[: len(written)])
        assert len(written) >= count
        assert outcome.code == 1 and "report.html" in outcome.stderr
        for name in written:
            assert (disk / "run" / name).stat().st_size == sizes[name] or name == "summary.txt"
        shutil.rmtree(disk)


def test_full_disk_is_refused_before_the_first_frame(short_recording, tmp_path, monkeypatch):
    FullDisk(monkeypatch, tmp_path, 10_000)
    outcome = stairmap("run", short_recording, "-o", tmp_path / "run")
    assert outcome.code == 1
    assert "the disk is full (9 KiB are free)" in outcome.stderr
    assert not (tmp_path / "run").exists()


def test_detect_on_a_disk_that_fills_up_goes_on_and_leaves_no_half_picture(
    short_recording, tmp_path, monkeypatch
):
    FullDisk(monkeypatch, tmp_path, 120_000)
    outcome = stairmap("detect", short_recording, "-o", tmp_path / "run")
    assert outcome.code == 1
    assert "stair edges detected in 8" in outcome.stdout
    assert outcome.stderr.count("overlays") == 3  # told once, and named in the error
    assert len(list(load_detections(tmp_path / "run"))) == 8
    assert (tmp_path / "run" / "summary.txt").exists()
    for picture in (tmp_path / "run" / "overlays").iterdir():
        assert picture.read_bytes().endswith(b"IEND\xaeB`\x82")


def test_limit_of_the_system_on_file_sizes_is_like_a_full_disk(recording, tmp_path):
    process = start(
        "run", recording, "-o", tmp_path / "run", "--no-report",
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000)),
    )  # fmt: skip
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "170 ±" in stdout
    assert "Traceback" not in stderr and "File too large" in stderr
    assert has_whole_lines(tmp_path / "run" / "detections.jsonl")
    assert load_stairways(tmp_path / "run").num_frames == NUM_FRAMES


def test_failed_export_leaves_no_half_file(run_folder, tmp_path, monkeypatch):
    FullDisk(monkeypatch, tmp_path, 1_000)
    for name in ("ply", "obj", "nav2-graph", "keepout"):
        outcome = stairmap("export", run_folder, "-f", name, "-o", tmp_path / name)
        assert outcome.code == 1, name
        assert "No space left on device" in outcome.stderr
        assert not [path for path in (tmp_path / name).iterdir() if path.suffix != ".pgm"]


def test_answer_is_printed_before_a_full_disk_is_told(run_folder, tmp_path, monkeypatch):
    disk = tmp_path / "disk"
    disk.mkdir()
    for arguments, printed in (
        (("check", run_folder, "--robot", "spot", "--picture", disk / "picture.png"), "Boston Dynamics"),
        (("plan", run_folder, "-o", disk / "plan"), "frontier"),
    ):
        with monkeypatch.context() as patch:
            FullDisk(patch, disk, 500)
            outcome = stairmap(*arguments)
        assert printed in outcome.stdout, arguments[0]
        assert outcome.code == 1 and "No space left on device" in outcome.stderr.splitlines()[-1]
        assert not list(disk.rglob("*.png")) and not list(disk.rglob(".*"))


def test_evaluation_on_a_full_disk_prints_its_tables(tmp_path, monkeypatch):
    pytest.importorskip("embreex", reason="needs the extra sim")
    FullDisk(monkeypatch, tmp_path, 500)
    options = ("--quick", "--only", "b3", "--method", "stairmap", "-o", tmp_path / "tables")
    outcome = stairmap("evaluate", "table1", *options)
    assert outcome.code == 1
    assert "| stairmap" in outcome.stdout
    assert "No space left on device" in outcome.stderr.splitlines()[-1]


def kill_after(process, seconds):
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=30)


def check_killed_run(folder, tmp_path):
    """Whatever moment it was: every command can use the folder or says that there is nothing yet."""
    if not (folder / "trajectory.tum").exists():
        return False
    assert not [path for path in folder.iterdir() if path.name.startswith(".") and "partial" not in path.name]
    results = load_stairways(folder)
    list(load_detections(folder))
    load_run_trajectory(folder)
    for arguments in (
        ("check", folder, "--robot", "spot"),
        ("export", folder, "-f", "ply", "-o", tmp_path / "ply"),
        ("plan", folder),
        ("view", folder, "--page", tmp_path / "page.html"),
    ):
        outcome = stairmap(*arguments)
        assert "fault" not in outcome.stderr
        may_refuse = not results.stairways and arguments[0] != "view"
        assert outcome.code == 0 or may_refuse, (arguments[0], outcome.stderr)
        assert outcome.code in (0, 1)
    (tmp_path / "page.html").unlink(missing_ok=True)
    shutil.rmtree(tmp_path / "ply", ignore_errors=True)
    finished = stairmap("finish", folder)
    assert finished.code == 0, finished.stderr
    again = load_stairways(folder)
    assert again.is_finished
    assert [s.id for s in again.stairways] == [s.id for s in results.stairways]
    for name in ("summary.txt", "stairways.ply", "config.yaml", "recording.json"):
        assert (folder / name).exists(), name
    if load_run_trajectory(folder) is not None:
        load_tum_trajectory(folder / "trajectory.tum")
    assert stairmap("finish", folder).stderr == "nothing is missing\n"
    return True


def wait_for(path, num_lines):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if path.exists() and path.read_bytes().count(b"\n") >= num_lines:
            return
        time.sleep(0.01)
    pytest.fail(f"{path} did not grow")


def test_killed_run_can_be_used_and_finished(long_recording, tmp_path):
    process = start("run", long_recording, "-o", tmp_path / "run", "--no-report")
    wait_for(tmp_path / "run" / "history.jsonl", 3)
    kill_after(process, 0.0)
    assert not (tmp_path / "run" / "stairways.json").exists()
    # The worst of moments: in the middle of a line, and zeros where the disk was not reached.
    for name, rest in (("detections.jsonl", b'{"stamp_ns": 1, "dete'), ("trajectory.tum", b"99.5 0.1 0.2"),
                       ("history.jsonl", b"\0" * 100)):  # fmt: skip
        with (tmp_path / "run" / name).open("ab") as file:
            file.write(rest)
    assert len(load_stairways(tmp_path / "run").stairways) == 1
    assert check_killed_run(tmp_path / "run", tmp_path)


@pytest.mark.nightly
def test_run_killed_at_twenty_moments_is_always_readable(long_recording, tmp_path):
    moments = random.Random(1)
    num_checked = 0
    for number in range(20):
        folder = tmp_path / f"run{number}"
        process = start("run", long_recording, "-o", folder, "--no-report")
        wait_for(folder / "detections.jsonl", 0)
        kill_after(process, moments.uniform(0.0, 5.0))
        num_checked += check_killed_run(folder, tmp_path)
    assert num_checked >= 15


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("arguments", [("config",), ("--help",), ("run", "--help"), ("check", "--list")])
def test_output_to_a_full_device_is_told_in_one_line(arguments):
    with Path("/dev/full").open("w") as full:
        outcome = subprocess.run(
            [sys.executable, "-m", "stairmap", *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert outcome.returncode == 1
    assert outcome.stderr.count("\n") == 1
    assert outcome.stderr.startswith("error: cannot write the output: No space left on device")


def test_pipe_that_nobody_reads_ends_without_a_word(short_recording, tmp_path):
    for stream in ("stdout", "stderr"):
        reader, writer = os.pipe()
        os.close(reader)
        folder = tmp_path / stream
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | {stream: writer}
        outcome = subprocess.run(
            [sys.executable, "-m", "stairmap", "run", str(short_recording), "-o", str(folder), "--no-report"],
            **streams, text=True, check=False,
        )  # fmt: skip
        os.close(writer)
        assert outcome.returncode == 0
        assert "Error" not in (outcome.stderr or "") and "Exception" not in (outcome.stderr or "")
        assert len(load_stairways(folder).stairways) == 1


def test_run_whose_terminal_goes_away_writes_its_results(long_recording, tmp_path):
    """The terminal's end is closed, as by a lost connection: writes fail from then on, and SIGHUP comes."""
    parent, child = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "stairmap", "run", str(long_recording), "-o", str(tmp_path / "run")],
        stdin=child, stdout=child, stderr=child, start_new_session=True,
    )  # fmt: skip
    os.close(child)
    wait_for(tmp_path / "run" / "history.jsonl", 2)
    os.close(parent)
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=60) == 129
    results = load_stairways(tmp_path / "run")
    assert results.is_finished and 0 < results.num_frames < LONG and results.stairways


def test_libraries_do_not_speak_to_the_terminal(tmp_path):
    code = (
        "import os, sys, warnings\n"
        "from stairmap.cli.streams import guard_streams\n"
        "guard_streams(shows_noise='--debug' in sys.argv)\n"
        "os.write(2, b'libpng warning\\n')\n"
        "warnings.warn('numpy warning')\n"
        "import logging; logging.getLogger('matplotlib').warning('findfont')\n"
        "sys.stderr.write('ours\\n'); sys.stderr.flush()\n"
    )
    quiet = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert quiet.stderr == "ours\n"
    loud = subprocess.run([sys.executable, "-c", code, "--debug"], capture_output=True, text=True, check=True)
    assert all(word in loud.stderr for word in ("libpng", "numpy", "findfont", "ours"))
