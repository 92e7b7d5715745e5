"""What a batch counts and hands out again, with workers that answer what a test says."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.batch.batch_folder import BatchFolder
from stairmap.batch.job import BatchSettings, RecordingResult, failed_result
from stairmap.batch.pools import FinishedJob
from stairmap.batch.running import MAX_LOST, BatchRun
from stairmap.batch.table_files import read_table
from stairmap.stairway import Flight, FlightStd, Stairway

SETTINGS = BatchSettings()


class Answers:
    """Answers each job at once, with what ``answer`` makes of it."""

    capacity = num_workers = 1
    dashboard = ""

    def __init__(self, answer):
        self.answer, self.jobs, self.waiting = answer, [], []

    def submit(self, job):
        self.jobs.append(job)
        self.waiting.append(job)

    def wait(self, timeout):
        jobs, self.waiting = self.waiting, []
        return [FinishedJob(job=job, result=self.answer(job), reason="its workers were lost") for job in jobs]

    def close(self):
        pass


def done(job, **values):
    return RecordingResult(
        recording=job.recording, folder=job.folder, fingerprint=SETTINGS.fingerprint(), num_frames=7, **values
    )


def run(folder, recordings, answer, **options):
    pool = Answers(answer)
    with BatchFolder(str(folder), SETTINGS.fingerprint()) as batch_folder:
        return BatchRun(recordings, SETTINGS, batch_folder).run(pool, **options), pool


def test_each_recording_counts_once_also_one_that_broke_off(tmp_path):
    answers = {
        "/a": done,
        "/b": lambda job: done(job, error="cut off"),
        "/c": lambda job: failed_result(job, "no poses"),
    }
    seen = []
    outcome, _ = run(
        tmp_path, list(answers), lambda job: answers[job.recording](job), on_progress=seen.append
    )
    assert (outcome.num_done, outcome.num_broken_off, outcome.num_failed, outcome.num_known) == (2, 1, 1, 0)
    assert len(seen) == 3
    assert [row["error"] for row in read_table(tmp_path)] == ["", "cut off", "no poses"]
    again, pool = run(tmp_path, list(answers), done)
    assert [job.recording for job in pool.jobs] == ["/c"]
    assert (again.num_known, again.num_done, again.num_failed) == (2, 1, 0)


def test_recording_whose_workers_are_lost_again_and_again_is_a_row(tmp_path):
    outcome, pool = run(tmp_path, ["/a", "/b"], lambda job: None if job.recording == "/a" else done(job))
    assert (outcome.num_done, outcome.num_failed) == (1, 1)
    assert len(pool.jobs) == MAX_LOST + 1
    assert read_table(tmp_path)[0]["error"] == f"its workers were lost, {MAX_LOST} times"


def test_stopped_batch_says_what_is_left(tmp_path):
    count = [0]

    def should_stop():
        count[0] += 1
        return count[0] > 2

    outcome, pool = run(tmp_path, ["/a", "/b", "/c"], done, should_stop=should_stop)
    assert outcome.was_stopped and outcome.num_done == len(pool.jobs) < 3
    again, _ = run(tmp_path, ["/a", "/b", "/c"], done)
    assert again.num_known == outcome.num_done and again.num_known + again.num_done == 3


@pytest.mark.parametrize("num_stairways", [0, 2])
def test_stairways_of_what_was_done_before_count(tmp_path, num_stairways):
    std = FlightStd(rise=0.002, run=0.003, width=0.01, pitch=0.004, heading=0.01, base=np.full(3, 0.01))
    flight = Flight(base=np.zeros(3), heading=0.0, rise=0.17, run=0.28, width=1.2, num_risers=8, std=std)
    stairways = tuple(
        Stairway(id=number, flights=(flight,), num_observations=9, first_seen_ns=0, last_seen_ns=1).to_dict()
        for number in range(1, num_stairways + 1)
    )
    run(tmp_path, ["/a"], lambda job: done(job, stairways=stairways))
    outcome, _ = run(tmp_path, ["/a", "/b"], done)
    assert (outcome.num_known, outcome.num_stairways) == (1, num_stairways)
