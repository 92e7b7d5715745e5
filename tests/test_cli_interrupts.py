"""Ctrl-C, SIGTERM and SIGHUP in mid-run: what was found so far is written, and the exit code tells."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

from small_recordings import repeat_frames, write_recording
from stairmap.cli.interrupts import Interrupt, noted_interrupts

NUM_FRAMES = 5_000
"""So many that no run ends by itself before it is interrupted."""


@pytest.fixture(scope="module")
def long_recording(tmp_path_factory):
    folder = write_recording(tmp_path_factory.mktemp("recordings") / "long")
    repeat_frames(folder, NUM_FRAMES)
    return folder


def start(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "stairmap", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def wait_for_lines(path, num_lines, process):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        if path.exists() and path.read_text().count("\n") >= num_lines:
            return
        time.sleep(0.05)
    pytest.fail(f"{path} did not grow: {process.communicate(timeout=10)}")


@pytest.mark.parametrize(
    ("signal_number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_interrupted_run_writes_what_it_has(long_recording, tmp_path, signal_number, code):
    process = start("run", long_recording, "-o", tmp_path / "out", "--no-report")
    wait_for_lines(tmp_path / "out" / "detections.jsonl", 8, process)
    process.send_signal(signal_number)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == code
    assert "interrupted" in stderr
    assert "Traceback" not in stderr
    assert stdout.rstrip().endswith(str(tmp_path / "out"))
    saved = json.loads((tmp_path / "out" / "stairways.json").read_text())
    assert 8 <= saved["num_frames"] < NUM_FRAMES
    assert len(saved["stairways"]) == 1
    assert "was interrupted after" in (tmp_path / "out" / "summary.txt").read_text()
    lines = (tmp_path / "out" / "detections.jsonl").read_text().splitlines()
    assert len(lines) == saved["num_frames"]


def test_interrupted_detect_writes_its_summary(long_recording, tmp_path):
    process = start("detect", long_recording, "-o", tmp_path / "out", "--no-overlays", "--json")
    wait_for_lines(tmp_path / "out" / "detections.jsonl", 2, process)
    process.send_signal(signal.SIGTERM)
    stdout, _ = process.communicate(timeout=60)
    assert process.returncode == 143
    assert json.loads(stdout)["interrupted"] is True
    assert (tmp_path / "out" / "summary.txt").exists()


def test_hangup_stays_ignored_where_it_was_as_under_nohup():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with noted_interrupts() as interrupt:
            signal.raise_signal(signal.SIGHUP)
        assert not interrupt
    finally:
        signal.signal(signal.SIGHUP, before)


def test_second_signal_stops_at_once():
    interrupt = Interrupt()
    interrupt.handle(signal.SIGINT, None)
    assert interrupt
    assert interrupt.exit_code == 130
    with pytest.raises(SystemExit) as ending:
        interrupt.handle(signal.SIGTERM, None)
    assert ending.value.code == 143


def test_handlers_are_restored():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with noted_interrupts() as interrupt:
        signal.raise_signal(signal.SIGTERM)
    assert interrupt.exit_code == 143
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


def test_ctrl_c_while_the_program_is_being_loaded_leaves_no_traceback():
    code = (
        "import sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'typer':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from stairmap.__main__ import main\n"
        "main()\n"
    )
    outcome = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (outcome.returncode, outcome.stderr) == (130, "interrupted\n")
