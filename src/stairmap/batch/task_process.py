"""Runs functions in a process of its own that a recording may kill, and that has a memory limit."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

import stairmap
from stairmap.batch.addresses import is_address
from stairmap.batch.job import RecordingJob, RecordingResult, failed_result
from stairmap.batch.output_place import partial_folder

NUM_ATTEMPTS = 2
"""A recording that kills its process so often is a failure."""

MAX_CALLS = 100
"""Calls until the process is renewed, so that what libraries leak comes to nothing."""

_CHECK_PERIOD = 0.25
"""Time between two looks at the memory of the process, s: a page takes 0.1 µs to be used, 0.25 s fill 1 GB or
two."""

_PAGE = os.sysconf("SC_PAGE_SIZE")

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class ProcessDiedError(Exception):
    """A process ended in the middle of a call.

    Parameters
    ----------
    reason
        How it ended.
    process_id
        Which it was.
    """

    def __init__(self, reason: str, process_id: int) -> None:
        super().__init__(reason)
        self.process_id = process_id


class TaskProcess:
    """A process that answers one call after the other.

    Parameters
    ----------
    memory_limit
        Bytes; a call that needs more ends the process. 0: no limit.
    """

    def __init__(self, memory_limit: int = 0) -> None:
        self._memory_limit = memory_limit
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection[Any, Any] | None = None
        self._num_calls = 0

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns there; it must be importable, its values picklable.

        Raises
        ------
        ProcessDiedError
            If the process did not live to answer.
        Exception
            What the function raised.
        """
        if self._num_calls >= MAX_CALLS:
            self.close()
        connection = self._start()
        self._num_calls += 1
        try:
            connection.send((function, arguments))
            while not connection.poll(_CHECK_PERIOD):
                self._check_memory()
            is_result, value = connection.recv()
        except (EOFError, OSError) as error:
            process_id = self._process_id
            raise ProcessDiedError(self._describe_end(), process_id) from error
        if not is_result:
            raise value
        return value

    def close(self) -> None:
        """End the process, whatever it does."""
        if self._connection is not None:
            with contextlib.suppress(OSError):
                self._connection.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process = self._connection = None
        self._num_calls = 0

    @property
    def _process_id(self) -> int:
        return 0 if self._process is None else self._process.pid

    def _start(self) -> Connection[Any, Any]:
        if self._connection is not None:
            return self._connection
        here, there = socket.socketpair()
        package = str(Path(stairmap.__file__).parents[1])
        path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
        self._process = subprocess.Popen(
            [sys.executable, "-m", "stairmap.batch.task_main", str(there.fileno())],
            pass_fds=[there.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **_ONE_THREAD, "PYTHONPATH": path, "PYTHONSAFEPATH": "1"},
        )
        there.close()
        self._connection = Connection(here.detach())
        return self._connection

    def _check_memory(self) -> None:
        process_id = self._process_id
        if self._memory_limit and resident_memory(process_id) > self._memory_limit:
            self.close()
            raise ProcessDiedError(
                f"it needs more than {self._memory_limit / 2**30:.1f} GiB of memory, the limit of a worker",
                process_id,
            )

    def _describe_end(self) -> str:
        process = self._process
        code = None
        if process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                code = process.wait(timeout=10)
        self.close()
        if code is not None and code < 0:
            name = signal.Signals(-code).name
            hint = " (no memory left?)" if name == "SIGKILL" else ""
            return f"its process was ended by {name}{hint}"
        return f"its process ended with exit code {code}"


def resident_memory(process_id: int) -> int:
    """Return how much memory a process holds, bytes; 0 where nothing tells."""
    try:
        return int(Path(f"/proc/{process_id}/statm").read_text().split()[1]) * _PAGE
    except (OSError, ValueError, IndexError):
        return 0


Answer = TypeVar("Answer")


def perform_in_process(
    process: TaskProcess, function: Callable[..., Answer], job: RecordingJob, *arguments: Any
) -> Answer | RecordingResult:
    """Perform a job in a process; one that kills it ``NUM_ATTEMPTS`` times has failed."""
    reason = ""
    for _ in range(NUM_ATTEMPTS):
        try:
            answer: Answer = process.call(function, job, *arguments)
        except ProcessDiedError as error:  # noqa: PERF203
            reason = str(error)
            _remove_partial(job, error.process_id)
        else:
            return answer
    return failed_result(job, f"{reason}, {NUM_ATTEMPTS} times")


def _remove_partial(job: RecordingJob, process_id: int) -> None:
    if not is_address(job.output):
        shutil.rmtree(partial_folder(Path(job.output), job.folder, process_id), ignore_errors=True)
