"""Workers on this machine or on a dask cluster (extra ``cluster``). dask is imported here only."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import logging
import os
import pickle
import queue
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import stairmap
from stairmap.batch.job import RecordingJob, RecordingResult
from stairmap.batch.long_recordings import detect_piece, perform_with_pieces, piece_bounds
from stairmap.batch.payload import make_run_payload
from stairmap.batch.pools import FinishedJob
from stairmap.batch.task import perform
from stairmap.batch.task_process import TaskProcess, perform_in_process
from stairmap.errors import BatchError, MissingPackageError
from stairmap.input_files import shown

CONNECT_TIMEOUT = 10.0
"""Time in which a scheduler must answer, s."""

RESULT_TIMEOUT = 1.0
"""Time in which a result must come from the worker that has it, s; else that worker may be gone."""

CHECK_PERIOD = 5.0
"""Time between two looks at who the workers are, s."""

LOCAL_ALLOWED_FAILURES = 1000
"""Workers that may be lost with one task. Recordings die in processes of their own, so that a lost worker is
never the recording's fault."""

_LOCAL_SETTINGS = {
    "distributed.scheduler.allowed-failures": LOCAL_ALLOWED_FAILURES,
    # It samples the stack of a thread that waits for another process, a hundred times a second.
    "distributed.worker.profile.enabled": False,
    # The driver looks whether its own loops are alive fifty times a second for each worker, and at its load
    # twice a second: together two per cent of a core.
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    # What the scheduler keeps of each task for its developers, in the driver's memory.
    "distributed.admin.log-length": 100,
    "distributed.admin.low-level-log-length": 100,
    "distributed.diagnostics.computations.max-history": 10,
    # Workers only wait; their processes have the limit.
    "distributed.worker.memory.terminate": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.target": False,
}


class DaskPool:
    """Gives jobs to the workers of a dask cluster.

    Parameters
    ----------
    client
        A ``distributed.Client``.
    """

    def __init__(self, client: Any) -> None:
        self._client = client
        self._run_payload = make_run_payload()
        self._finished: queue.SimpleQueue[tuple[RecordingJob, Any]] = queue.SimpleQueue()
        self._futures: dict[str, list[Any]] = {}
        self._num_submitted = 0
        self._num_workers = 0
        self._checked: set[str] = set()
        self._next_check = 0.0
        self._look_at_workers()

    @property
    def num_workers(self) -> int:
        """How many jobs the workers do at once."""
        return self._num_workers

    @property
    def capacity(self) -> int:
        """Two for each worker: while one is done, the next one is there already."""
        return max(2, 2 * self._num_workers)

    @property
    def dashboard(self) -> str:
        """Address of dask's dashboard."""
        return str(self._client.dashboard_link or "")

    def submit(self, job: RecordingJob) -> None:
        """Take a job; if there are several workers, they share a recording that is too long for one."""
        whole = job if self._num_workers > 1 else replace(job, max_frames=0)
        self._keep(job, [self._send(job, (perform_on_worker, (whole,)))])

    def _submit_pieces(self, job: RecordingJob, num_frames: int) -> None:
        pieces = [
            self._send(job, (detect_on_worker, (job, bounds)))
            for bounds in piece_bounds(num_frames, job.max_frames)
        ]
        self._keep(job, [self._send(job, (join_on_worker, (job,)), pieces), *pieces])

    def _send(self, job: RecordingJob, call: tuple[Any, tuple[Any, ...]], parts: Sequence[Any] = ()) -> Any:
        self._num_submitted += 1
        # Schedulers remember the first word of keys for ever: it must be the same one.
        key = f"recording-{self._num_submitted}-{job.token[:8]}"
        return self._client.submit(self._run_payload, pickle.dumps(call), list(parts), key=key, pure=False)

    def _keep(self, job: RecordingJob, futures: list[Any]) -> None:
        self._futures[job.folder] = futures
        self._watch(job, futures[0])

    def _watch(self, job: RecordingJob, future: Any) -> None:
        future.add_done_callback(lambda done: self._finished.put((job, done)))

    def wait(self, timeout: float) -> list[FinishedJob]:
        """Return what has finished.

        Raises
        ------
        BatchError
            If the scheduler went away, or a worker has another version of stairmap.
        """
        if time.monotonic() >= self._next_check:
            self._look_at_workers()
        came: list[tuple[RecordingJob, Any]] = []
        with contextlib.suppress(queue.Empty):
            came.append(self._finished.get(timeout=timeout))
            while True:
                came.append(self._finished.get_nowait())
        return [finished for job, future in came if (finished := self._finish(job, future)) is not None]

    def _finish(self, job: RecordingJob, future: Any) -> FinishedJob | None:
        """What came of a job; ``None`` if it goes on: in pieces, or again because its worker was killed."""
        if future.status == "finished":
            try:
                result: RecordingResult = pickle.loads(future.result(timeout=RESULT_TIMEOUT))
            except (TimeoutError, asyncio.TimeoutError):
                self._watch(job, future)
                return None
            if result.num_to_split:
                self._submit_pieces(job, result.num_to_split)
                return None
            self._futures.pop(job.folder, None)
            return FinishedJob(job=job, result=result)
        self._futures.pop(job.folder, None)
        error = future.exception(timeout=CONNECT_TIMEOUT) if future.status == "error" else None
        # A worker that does not know our functions is told by name, before it fails one job after the other.
        self._look_at_workers()
        what = "the scheduler dropped it" if error is None else f"{type(error).__name__}: {error}"
        return FinishedJob(job=job, result=None, reason=f"its workers were lost ({what})")

    def _look_at_workers(self) -> None:
        self._next_check = time.monotonic() + CHECK_PERIOD
        if self._client.status != "running":
            raise BatchError("the scheduler went away; call again and the batch goes on")
        workers = self._client.scheduler_info(n_workers=-1)["workers"]
        self._num_workers = sum(int(worker["nthreads"]) for worker in workers.values())
        new = sorted(set(workers) - self._checked)
        if new:
            check_worker_versions(self._client, new)
            self._checked.update(new)

    def close(self) -> None:
        """Drop all jobs; those that are being done may come to their end, and are found there next time."""
        for futures in self._futures.values():
            with contextlib.suppress(Exception):
                self._client.cancel(futures)
        self._futures.clear()


def check_worker_versions(client: Any, addresses: Sequence[str]) -> None:
    """Refuse workers whose stairmap is of another version.

    Raises
    ------
    BatchError
        If there is one; it is named.
    """
    # Builtins only: a worker without our modules must be able to answer.
    asked = "__import__('stairmap').__version__"
    answers = client.run(eval, asked, workers=list(addresses), on_error="return")
    for address, answer in sorted(answers.items()):
        if answer == stairmap.__version__ or isinstance(answer, OSError):
            continue
        found = f"stairmap {answer}" if isinstance(answer, str) else f"no stairmap ({type(answer).__name__})"
        raise BatchError(
            f"expected workers with stairmap {stairmap.__version__}, but the one at {address} has {found}; "
            "install the same version there"
        )


@contextmanager
def local_pool(num_workers: int, memory_limit: str = "auto") -> Iterator[DaskPool]:
    """Start workers on this machine, one process and one thread each, and end them at the end.

    Parameters
    ----------
    num_workers
        How many.
    memory_limit
        Of each, such as ``4GiB``; ``auto``: an equal share of the machine's memory.

    Raises
    ------
    MissingPackageError
        Without the extra ``cluster``.
    BatchError
        If they cannot be started.
    """
    distributed, config = _import_dask()
    with config.set(_LOCAL_SETTINGS):
        try:
            cluster = distributed.LocalCluster(
                n_workers=num_workers,
                threads_per_worker=1,
                processes=True,
                memory_limit=memory_limit,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise BatchError(
                f"cannot start {num_workers} workers with {memory_limit} of memory: {error}"
            ) from error
        with cluster, _client_of(distributed, cluster) as pool:
            yield pool


@contextmanager
def scheduler_pool(address: str) -> Iterator[DaskPool]:
    """Connect to a dask scheduler, whoever started it.

    Raises
    ------
    MissingPackageError
        Without the extra ``cluster``.
    BatchError
        If it does not answer, or has workers of another version.
    """
    distributed, _ = _import_dask()
    try:
        # A client that was given no address waits for 20 s when the process ends, and complains then.
        distributed.comm.get_address_host_port(address, strict=True)
    except ValueError as error:
        raise BatchError(
            f"no scheduler answers at {shown(address)}; expected an address such as tcp://10.0.0.1:8786"
        ) from error
    with _client_of(distributed, address) as pool:
        yield pool


@contextmanager
def _client_of(distributed: Any, target: Any) -> Iterator[DaskPool]:
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(target, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        raise BatchError(
            f"no scheduler answers at {target}; start one with: dask scheduler ({type(error).__name__})"
        ) from error
    try:
        pool = DaskPool(client)
        yield pool
        pool.close()
    finally:
        with contextlib.suppress(Exception):
            client.close(timeout=CONNECT_TIMEOUT)


def _import_dask() -> tuple[Any, Any]:
    try:
        distributed = importlib.import_module("distributed")
        config = importlib.import_module("dask").config
    except ImportError as error:
        raise MissingPackageError("distributed", "cluster", "a batch on several workers") from error
    return distributed, config


_own = threading.local()
"""The process of each thread of this worker, once it has one."""


def perform_on_worker(job: RecordingJob) -> bytes | RecordingResult:
    """Do a job in a process of this worker."""
    return perform_in_process(_own_process(), perform, job)


def detect_on_worker(job: RecordingJob, bounds: tuple[int, int]) -> bytes | RecordingResult:
    """Look at a piece of a recording in a process of this worker; a result says why it failed."""
    return perform_in_process(_own_process(), detect_piece, job, bounds)


def join_on_worker(job: RecordingJob, pieces: Sequence[bytes | RecordingResult]) -> bytes | RecordingResult:
    """Do a job whose pieces were looked at, in a process of this worker."""
    for piece in pieces:
        if isinstance(piece, RecordingResult):
            return piece
    return perform_in_process(_own_process(), perform_with_pieces, job, pieces)


def _own_process() -> TaskProcess:
    process: TaskProcess | None = getattr(_own, "process", None)
    if process is None:
        process = _own.process = TaskProcess(_memory_limit())
    return process


def _memory_limit() -> int:
    """Bytes that one thread of this worker may use; 0 without a limit."""
    distributed, _ = _import_dask()
    try:
        worker = distributed.get_worker()
        limit, num_threads = int(worker.memory_manager.memory_limit or 0), int(worker.state.nthreads)
    except (ValueError, AttributeError):
        return 0
    return limit // max(num_threads, 1)


def default_num_workers() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
