from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import cv2
import pytest
import stand_in_looks

from small_recordings import write_recording
from stairmap.batch.job import BatchSettings, RecordingJob
from stairmap.batch.recording_task import look_at_input
from stairmap.batch.task import perform
from stairmap.batch.task_process import ProcessDiedError, TaskProcess, perform_in_process


@pytest.fixture
def with_stand_ins(tmp_path, monkeypatch):
    for name, value in stand_in_looks.prepare(tmp_path / "site").items():
        monkeypatch.setenv(name, value)


def make_job(tmp_path, name):
    (tmp_path / name).mkdir()
    output = tmp_path / "out"
    output.mkdir(exist_ok=True)
    (output / ".batch-token").write_text("t")
    return RecordingJob(
        recording=str(tmp_path / name), output=str(output), folder=name, token="t", settings=BatchSettings()
    )


def test_recording_that_kills_its_process_twice_is_a_failure_and_the_next_is_done(tmp_path, with_stand_ins):
    process = TaskProcess()
    killed = perform_in_process(process, perform, make_job(tmp_path, "killer"))
    assert not killed.is_done
    assert killed.error == "its process was ended by SIGKILL (no memory left?), 2 times"
    done = perform_in_process(process, perform, make_job(tmp_path, "sleeper"))
    assert done.is_done and done.error == "" and done.num_frames == 1
    assert (tmp_path / "out" / "sleeper" / "task.json").exists()
    process.close()


def test_recording_that_needs_too_much_memory_is_stopped(tmp_path, with_stand_ins):
    process = TaskProcess(memory_limit=400 * 2**20)
    result = perform_in_process(process, perform, make_job(tmp_path, "greedy"))
    assert result.error == "it needs more than 0.4 GiB of memory, the limit of a worker, 2 times"
    process.close()


def test_error_of_a_function_comes_back_and_the_process_goes_on():
    process = TaskProcess()
    first = process.call(os.getpid)
    with pytest.raises(ZeroDivisionError):
        process.call(divmod, 1, 0)
    assert process.call(os.getpid) == first != os.getpid()
    with pytest.raises(ProcessDiedError, match="exit code 7"):
        process.call(os._exit, 7)
    assert process.call(os.getpid) != first
    process.close()


def test_process_uses_one_thread(tmp_path, monkeypatch):
    process = TaskProcess()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        assert process.call(os.getenv, name) == "1"
    assert process.call(cv2.getNumThreads) == 1
    process.close()
    # A recording is looked at without another thread.
    recording = write_recording(tmp_path / "r", num_frames=3)
    started = []
    start = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: (started.append(thread), start(thread)))
    look = look_at_input(recording, BatchSettings(), tmp_path / "run")
    assert look.num_frames == 3 and started == []


def test_process_ends_in_the_middle_of_its_work_when_its_worker_is_killed(tmp_path):
    code = (
        "import os, sys, time, pathlib\n"
        "from stairmap.batch.task_process import TaskProcess\n"
        "process = TaskProcess()\n"
        f"pathlib.Path({str(tmp_path / 'pid')!r}).write_text(str(process.call(os.getpid)))\n"
        "process.call(time.sleep, 600)\n"
    )
    worker = subprocess.Popen([sys.executable, "-c", code])
    deadline = time.monotonic() + 60
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process_id = int((tmp_path / "pid").read_text())
    assert Path(f"/proc/{process_id}").exists()
    worker.kill()
    worker.wait()
    while Path(f"/proc/{process_id}").exists() and "Z" not in Path(f"/proc/{process_id}/stat").read_text():
        assert time.monotonic() < deadline
        time.sleep(0.05)
