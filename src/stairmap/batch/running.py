"""Run a batch: hand out what is missing, write down what comes back, keep the tables up to date."""

from __future__ import annotations

import socket
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from stairmap.batch.batch_folder import BatchFolder
from stairmap.batch.job import BatchSettings, RecordingJob, RecordingResult, failed_result
from stairmap.batch.output_place import unpack_folder
from stairmap.batch.pools import FinishedJob, JobPool
from stairmap.batch.table import Robots, Row, columns, rows_of
from stairmap.output_files import output_error

MAX_LOST = 20
"""How often a recording is handed out again after its workers were lost: a recording dies in a process of its
own, so that only losing workers again and again comes here."""

TABLE_PERIOD, TABLE_SHARE = 60.0, 20.0
"""The tables are written anew after 60 s, or after 20 times as long as that took, whichever is more."""

WAIT_PERIOD = 0.2
"""Time after which a signal is answered, s."""

MAX_FRAMES = 3_000
"""Recordings with more than one and a half times as many frames are split into pieces of at most this many: a
minute or two of work each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchProgress:
    """How far a batch is; ``result`` is the latest."""

    num_recordings: int
    num_failed: int
    num_stairways: int
    result: RecordingResult | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchOutcome:
    """What came of a batch.

    Attributes
    ----------
    num_recordings
        That were asked for.
    num_known
        Of these, done before.
    num_done, num_failed
        That got a run folder this time, and that got none.
    num_broken_off
        Of those done this time, read to a place where they are broken.
    num_stairways
        In all recordings that are done.
    was_stopped
        Whether it was stopped before all were done.
    task_cpu_s
        Processor time of the work done this time, s.
    """

    num_recordings: int
    num_known: int
    num_done: int
    num_failed: int
    num_broken_off: int
    num_stairways: int
    was_stopped: bool
    task_cpu_s: float


@dataclass(slots=True)
class _Counts:
    known: int = 0
    done: int = 0
    failed: int = 0
    broken_off: int = 0
    stairways: int = 0
    cpu_s: float = 0.0
    lost: Counter[str] = field(default_factory=Counter)


class BatchRun:
    """One call of a batch.

    Parameters
    ----------
    recordings
        Absolute paths and addresses, each once; see ``find_inputs``.
    settings
        How to look at them.
    folder
        Where results go; see ``BatchFolder``.
    robots
        Whose verdicts the tables give, by the names of their columns.
    """

    def __init__(
        self,
        recordings: Sequence[str],
        settings: BatchSettings,
        folder: BatchFolder,
        *,
        robots: Robots | None = None,
    ) -> None:
        self._recordings, self._settings, self._folder = recordings, settings, folder
        self._robots = dict(robots or {})
        journal = folder.journal
        self._counts = _Counts(
            known=sum(journal.is_done(recording) for recording in recordings),
            stairways=sum(journal.num_stairways(recording) for recording in recordings),
        )
        self._running: set[str] = set()
        self._tables_due = time.monotonic() + TABLE_PERIOD
        self._waiting = self._missing()

    @property
    def num_known(self) -> int:
        """How many recordings were done before."""
        return self._counts.known

    def run(
        self,
        pool: JobPool,
        *,
        should_stop: Callable[[], bool] = lambda: False,
        on_progress: Callable[[BatchProgress], None] = lambda _: None,
    ) -> BatchOutcome:
        """Do what is missing, and write the tables.

        Parameters
        ----------
        pool
            Who does it.
        should_stop
            Asked several times a second; the batch ends there when it says so.
        on_progress
            Called after each recording.

        Raises
        ------
        StairmapError
            If the batch's own files cannot be written, or the workers are gone. What was done stays done.
        """
        stopped = False
        try:
            for result in self._results(pool, should_stop):
                self._note(result)
                on_progress(self._progress(result))
                self._keep_tables()
            stopped = bool(self._running) or should_stop()
            if stopped:
                pool.close()
        finally:
            self._folder.sync()
        self.write_tables()
        counts = self._counts
        return BatchOutcome(
            num_recordings=len(self._recordings),
            num_known=counts.known,
            num_done=counts.done,
            num_failed=counts.failed,
            num_broken_off=counts.broken_off,
            num_stairways=counts.stairways,
            was_stopped=stopped,
            task_cpu_s=counts.cpu_s,
        )

    def _results(self, pool: JobPool, should_stop: Callable[[], bool]) -> Iterator[RecordingResult]:
        """Yield what comes back, while as much is handed out as the workers can take."""
        is_all_out = False
        while not should_stop():
            while not is_all_out and len(self._running) < pool.capacity:
                job = next(self._waiting, None)
                if job is None:
                    is_all_out = True
                else:
                    self._running.add(job.folder)
                    pool.submit(job)
            if is_all_out and not self._running:
                return
            for finished in pool.wait(WAIT_PERIOD):
                result = self._answer(finished, pool)
                if result is not None:
                    self._running.discard(finished.job.folder)
                    yield result
            self._folder.sync_if_due()

    def _missing(self) -> Iterator[RecordingJob]:
        """The jobs of recordings that are not done, made when they are handed out."""
        journal = self._folder.journal
        for recording in self._recordings:
            if journal.is_done(recording):
                continue
            yield RecordingJob(
                recording=recording,
                output=self._folder.output,
                folder=journal.folder_of(recording),
                token=self._folder.token,
                settings=self._settings,
                max_frames=MAX_FRAMES,
            )

    def _answer(self, finished: FinishedJob, pool: JobPool) -> RecordingResult | None:
        """The result of a job that came back; ``None`` if it was handed out again."""
        job, result = finished.job, finished.result
        if result is None:
            self._counts.lost[job.folder] += 1
            if self._counts.lost[job.folder] < MAX_LOST:
                pool.submit(replace(job, max_frames=0))
                return None
            return failed_result(job, f"{finished.reason}, {MAX_LOST} times")
        if result.packed:
            self._unpack(result)
            return replace(result, packed=b"")
        return result

    def _unpack(self, result: RecordingResult) -> None:
        local = self._folder.local_folder
        partial = local / ".partial" / f"{result.folder}-{socket.gethostname()}-{uuid.uuid4().hex}"
        unpack_folder(result.packed, partial)
        try:
            partial.rename(local / result.folder)
        except OSError as error:
            raise output_error(local / result.folder, error) from error

    def _note(self, result: RecordingResult) -> None:
        counts = self._counts
        counts.cpu_s += result.cpu_s
        counts.done += result.is_done
        counts.failed += not result.is_done
        counts.broken_off += result.is_done and bool(result.error)
        counts.stairways += len(result.stairways)
        self._folder.journal.add(result)

    def _progress(self, result: RecordingResult) -> BatchProgress:
        counts = self._counts
        return BatchProgress(
            num_recordings=len(self._recordings),
            num_failed=counts.failed,
            num_stairways=counts.stairways,
            result=result,
        )

    def _keep_tables(self) -> None:
        if time.monotonic() >= self._tables_due:
            started = time.monotonic()
            self.write_tables()
            taken = time.monotonic() - started
            self._tables_due = time.monotonic() + max(TABLE_PERIOD, TABLE_SHARE * taken)

    def rows(self) -> Iterator[Row]:
        """Yield the rows of all recordings that are done or failed, in the order of the arguments."""
        for recording in self._recordings:
            result = self._folder.journal.result_of(recording)
            if result is not None:
                yield from rows_of(result, self._robots)

    def write_tables(self) -> None:
        """Write ``batch.csv``, ``batch.parquet`` and the page.

        Raises
        ------
        OutputError
            If one cannot be written.
        """
        self._folder.write_tables(columns(self._robots), self.rows)
