"""What a worker does with one recording: fetch it, look at it, put the run folder in its place.

Nothing here assumes that workers share a disk with each other or with whoever asked: recordings may come from
an address, and run folders go to an address, to the batch's disk where the worker sees it, or else back with
the result. Whatever is done once is not done again.
"""

from __future__ import annotations

import json
import os
import resource
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import stairmap
from stairmap.batch.addresses import fetch_recording, is_address
from stairmap.batch.inputs import describe_missing
from stairmap.batch.job import RecordingJob, RecordingResult, failed_result
from stairmap.batch.look import Look
from stairmap.batch.output_place import (
    TASK_FILE,
    TOKEN_FILE,
    LocalPlace,
    OutputPlace,
    open_place,
    pack_folder,
    partial_folder,
)
from stairmap.batch.recording_task import Detections, look_at_input, remove_folder
from stairmap.errors import BatchError, RecordingError, StairmapError
from stairmap.input_files import parse_json
from stairmap.output_files import write_whole_text

Answer = TypeVar("Answer")


def perform(job: RecordingJob, known: Detections | None = None) -> RecordingResult:
    """Make the run folder of a recording; never raises for what is wrong with the recording.

    Parameters
    ----------
    job
        What to do.
    known
        What was found in its frames already.
    """
    started = processor_time()
    result = guarded(job, lambda: _perform(job, known))
    return replace(result, cpu_s=processor_time() - started)


def guarded(job: RecordingJob, work: Callable[[], Answer]) -> Answer | RecordingResult:
    """Return what the work returns, or a result that says in a line why it failed."""
    try:
        return work()
    except StairmapError as error:
        return failed_result(job, str(error))
    except MemoryError:
        return failed_result(job, "there is not enough memory for it")
    # Whatever it is, it is a row of the table and not the end of the batch.
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return failed_result(
            job,
            f"a fault of stairmap itself ({type(error).__name__} in {Path(place.filename).name}:"
            f"{place.lineno}: {error}); please report it",
        )


def _perform(job: RecordingJob, known: Detections | None) -> RecordingResult:
    check_version(job)
    place = _find_place(job)
    if place is not None and (result := _find_done(job, place)) is not None:
        return result
    with tempfile.TemporaryDirectory(prefix="stairmap-") as scratch:
        path = fetch_input(job, Path(scratch))
        folder = Path(scratch) / "run"
        if isinstance(place, LocalPlace):
            folder = partial_folder(place.folder, job.folder, os.getpid())
            remove_folder(folder)
        try:
            look = look_at_input(path, job.settings, folder, max_frames=job.max_frames, known=known)
            result = _result_of(job, look)
            if look.num_to_split:
                return result
            write_whole_text(folder / TASK_FILE, json.dumps(result.to_dict()) + "\n")
            if place is None:
                return replace(result, packed=pack_folder(folder))
            place.put_folder(folder, job.folder, last=TASK_FILE)
            return result
        except BaseException:
            remove_folder(folder)
            raise


def check_version(job: RecordingJob) -> None:
    """Refuse a job of another version of stairmap.

    Raises
    ------
    BatchError
        If it is one.
    """
    if job.settings.version != stairmap.__version__:
        raise BatchError(
            f"expected a worker with stairmap {job.settings.version}, this one has {stairmap.__version__}"
        )


def fetch_input(job: RecordingJob, scratch: Path) -> Path:
    """Return where the recording of a job is on this machine, copied into ``scratch`` if it comes from afar.

    Raises
    ------
    RecordingError
        If it is not there.
    """
    if is_address(job.recording):
        return fetch_recording(job.recording, scratch)
    path = Path(job.recording)
    if not os.path.lexists(path):
        raise RecordingError(describe_missing(job.recording))
    return path


def processor_time() -> float:
    """Return the processor time of this process so far, s."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def _find_place(job: RecordingJob) -> OutputPlace | None:
    """Where the run folder goes; ``None``: this machine does not see the batch's disk."""
    place = open_place(job.output)
    if isinstance(place, LocalPlace) and place.read(TOKEN_FILE) != job.token.encode():
        return None
    return place


def _find_done(job: RecordingJob, place: OutputPlace) -> RecordingResult | None:
    """What came of the recording already, in a task whose answer was lost."""
    content = place.read(f"{job.folder}/{TASK_FILE}")
    if content is None:
        return None
    try:
        result = RecordingResult.from_dict(parse_json(content.decode("utf-8")))
    except ValueError:
        return None
    is_same = (result.recording, result.fingerprint) == (job.recording, job.settings.fingerprint())
    return result if is_same else None


def _result_of(job: RecordingJob, look: Look) -> RecordingResult:
    return RecordingResult(
        recording=job.recording,
        folder=job.folder,
        fingerprint=job.settings.fingerprint(),
        num_frames=look.num_frames,
        num_detections=look.num_detections,
        stairways=look.stairways,
        error=" ".join(look.failure.split()),
        num_to_split=look.num_to_split,
    )
