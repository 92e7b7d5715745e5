"""Who does the work of a batch: a protocol, and the pool of one process of this machine."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Protocol

from stairmap.batch.job import RecordingJob, RecordingResult
from stairmap.batch.task import perform
from stairmap.batch.task_process import TaskProcess, perform_in_process


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishedJob:
    """A job that came back.

    Attributes
    ----------
    job
        Which.
    result
        What came of it; ``None`` where the workers that had it were lost.
    reason
        Why there is no result.
    """

    job: RecordingJob
    result: RecordingResult | None
    reason: str = ""


class JobPool(Protocol):
    """Takes jobs, and gives them back finished in any order."""

    @property
    def capacity(self) -> int:
        """How many jobs it is good for it to have at once."""
        ...

    @property
    def num_workers(self) -> int:
        """How many jobs it does at once."""
        ...

    @property
    def dashboard(self) -> str:
        """Address of a page that shows it at work; empty without one."""
        ...

    def submit(self, job: RecordingJob) -> None:
        """Take a job; a recording longer than ``job.max_frames`` may be split among the workers."""
        ...

    def wait(self, timeout: float) -> list[FinishedJob]:
        """Return what has finished, or an empty list after a time without anything, s."""
        ...

    def close(self) -> None:
        """End all work."""
        ...


class OneProcessPool:
    """Does one job after the other in a process of this machine, without dask.

    Parameters
    ----------
    memory_limit
        See ``TaskProcess``.
    """

    def __init__(self, memory_limit: int = 0) -> None:
        self._process = TaskProcess(memory_limit)
        self._waiting: deque[RecordingJob] = deque()

    capacity = 1
    num_workers = 1
    dashboard = ""

    def __enter__(self) -> OneProcessPool:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def submit(self, job: RecordingJob) -> None:
        """Take a job; its recording is not split, because nobody else could take a piece."""
        self._waiting.append(replace(job, max_frames=0))

    def wait(self, timeout: float) -> list[FinishedJob]:
        """Do the next job."""
        if not self._waiting:
            return []
        job = self._waiting.popleft()
        return [FinishedJob(job=job, result=perform_in_process(self._process, perform, job))]

    def close(self) -> None:
        """End the process."""
        self._process.close()
