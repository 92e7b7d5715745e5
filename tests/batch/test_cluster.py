"""A real scheduler and real workers on 127.0.0.1."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import stand_in_looks

from command_line import stairmap
from small_recordings import repeat_frames, write_recording
from stairmap.batch import running
from stairmap.batch.cluster import local_pool
from stairmap.batch.long_recordings import piece_bounds
from stairmap.batch.table_files import read_table

TIMEOUT_S = 120


def wait_until(condition, what):
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


class Cluster:
    """A scheduler and workers in processes of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.env = stand_in_looks.prepare(folder / "site")
        # What a scheduler in a container of its own has: dask, and no stairmap that it could use.
        (folder / "none" / "stairmap").mkdir(parents=True)
        (folder / "none" / "stairmap" / "__init__.py").write_text("raise ImportError")
        self.processes = []
        self.workers = []
        info = folder / "scheduler.json"
        self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
            "--scheduler-file", str(info), env={**os.environ, "PYTHONPATH": str(folder / "none")},
        )  # fmt: skip
        wait_until(lambda: info.exists() and info.read_text().endswith("}"), "no scheduler")
        self.address = next(
            line.split('"')[3] for line in info.read_text().splitlines() if '"address"' in line
        )

    def _start(self, kind, *arguments, env=None):
        process = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_" + kind, *arguments],
            env=env or self.env, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def start_worker(self, env=None):
        process = self._start(
            "worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1",
            "--memory-limit", "2GiB", env=env,
        )  # fmt: skip
        self.workers.append(process)
        return process

    def stop(self):
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    cluster.start_worker()
    cluster.start_worker()
    yield cluster
    cluster.stop()


def test_rows_are_equal_from_one_process_and_a_cluster(cluster, recordings, tmp_path):
    tables = []
    for name, options in (
        ("one", ("--workers", "0")),
        ("cluster", ("--scheduler", cluster.address)),
    ):
        outcome = stairmap(
            "batch", recordings, recordings / "lost", "-o", tmp_path / name, "--robot", "go2_air", *options
        )
        assert outcome.code == 0, outcome.stderr
        assert "Traceback" not in outcome.stderr
        tables.append(read_table(tmp_path / name))
        assert len(list(tmp_path.glob(f"{name}/*/stairways.json"))) == 4
    # That local workers give the same is in test_batch_that_was_killed_goes_on.
    assert len(tables[0]) == 6 and tables[0] == tables[1]


def test_long_recording_is_split_and_gives_the_same_to_the_bit(cluster, tmp_path, monkeypatch):
    recording = write_recording(tmp_path / "long", num_frames=6)
    repeat_frames(recording, 12)
    monkeypatch.setattr(running, "MAX_FRAMES", 4)
    # One process has nobody to share a long recording with, and does all of it.
    assert stairmap("batch", recording, "-o", tmp_path / "whole", "--workers", "0").code == 0
    outcome = stairmap("batch", recording, "-o", tmp_path / "pieces", "--scheduler", cluster.address)
    assert outcome.code == 0, outcome.stderr
    for name in ("stairways.json", "detections.jsonl", "history.jsonl", "trajectory.tum", "summary.txt"):
        assert (tmp_path / "pieces" / "long" / name).read_bytes() == (
            tmp_path / "whole" / "long" / name
        ).read_bytes(), name


def test_pieces_cover_all_frames_once_and_none_is_too_long():
    for num_frames, longest in ((24, 7), (3001, 3000), (10, 10), (1, 5)):
        bounds = piece_bounds(num_frames, longest)
        frames = [frame for first, end in bounds for frame in range(first, end)]
        assert frames == list(range(num_frames))
        assert max(end - first for first, end in bounds) <= longest


def test_recordings_that_kill_or_fill_their_process_are_rows_and_the_rest_goes_on(cluster, tmp_path):
    names = ("killer", "sleeper1", "sleeper2")
    for name in names:
        (tmp_path / "in" / name).mkdir(parents=True)
    before = [worker.poll() for worker in cluster.workers]
    outcome = stairmap(
        "batch",
        *(tmp_path / "in" / name for name in names),
        "-o",
        tmp_path / "out",
        "--scheduler",
        cluster.address,
    )
    assert outcome.code == 0, outcome.stderr
    rows = read_table(tmp_path / "out")
    assert [bool(row["error"]) for row in rows] == [True, False, False]
    assert "ended by SIGKILL" in rows[0]["error"] and "2 times" in rows[0]["error"]
    assert [worker.poll() for worker in cluster.workers] == before == [None, None]


def test_workers_that_are_killed_lose_nothing_and_do_nothing_twice(cluster, tmp_path):
    names = [f"sleeper{number:03d}" for number in range(60)]
    for name in names:
        (tmp_path / "in" / name).mkdir(parents=True)
    batch = subprocess.Popen(
        [sys.executable, "-m", "stairmap", "batch", str(tmp_path / "in") + "/*", "-o", str(tmp_path / "out"),
         "--scheduler", cluster.address],
        env=cluster.env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    log = tmp_path / "out" / "looks.log"
    for count in (10, 30):
        wait_until(lambda count=count: log.exists() and len(log.read_text().splitlines()) >= count, "no work")
        cluster.workers.pop(0).kill()
        cluster.start_worker()
    stdout, stderr = batch.communicate(timeout=TIMEOUT_S)
    assert batch.returncode == 0, stderr
    assert "60 recordings: 60 done, 0 failed" in stdout
    assert [row["folder"] for row in read_table(tmp_path / "out")] == names
    # What was begun by a worker that was killed is begun anew; what was done is not.
    looks = log.read_text().splitlines()
    assert sorted(set(looks)) == names and len(looks) <= len(names) + 4


@pytest.mark.nightly
def test_dashboard_is_told_and_answers(recordings, tmp_path):
    process = start_batch(recordings, tmp_path / "fleet")
    address = process.stderr.readline().rpartition("dashboard: ")[2].strip()
    with urllib.request.urlopen(address, timeout=TIMEOUT_S) as page:
        assert address.startswith("http://127.0.0.1:") and page.status == 200
    _, stderr = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, stderr


@pytest.mark.nightly
def test_driver_that_waits_for_workers_takes_little_of_a_core():
    with local_pool(2) as pool:
        pool.wait(1.0)
        started, taken = time.monotonic(), time.process_time()
        for _ in range(50):
            pool.wait(running.WAIT_PERIOD)
        assert time.process_time() - taken < 0.015 * (time.monotonic() - started)


@pytest.mark.nightly
def test_worker_of_another_version_is_refused_by_name(tmp_path):
    cluster = Cluster(tmp_path)
    try:
        (tmp_path / "old" / "stairmap").mkdir(parents=True)
        (tmp_path / "old" / "stairmap" / "__init__.py").write_text('__version__ = "0.0.9"\n')
        worker = cluster.start_worker({**os.environ, "PYTHONPATH": str(tmp_path / "old")})
        recording = write_recording(tmp_path / "r", num_frames=2)

        outcome = stairmap("batch", recording, "-o", tmp_path / "out", "--scheduler", cluster.address)
        assert outcome.code == 1 and worker.poll() is None
        last = outcome.stderr.splitlines()[-1]
        assert "but the one at tcp://127.0.0.1:" in last and "has stairmap 0.0.9" in last
    finally:
        cluster.stop()


def start_batch(recordings, folder, num_workers=2):
    return subprocess.Popen(
        [sys.executable, "-m", "stairmap", "batch", str(recordings), "-o", str(folder),
         "--workers", str(num_workers)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def check_state(folder):
    """Every run folder is whole, and the tables are whole or not there."""
    for entry in folder.iterdir() if folder.exists() else ():
        if entry.is_dir() and not entry.name.startswith("."):
            assert (entry / "task.json").exists() and stairmap("check", entry, "--robot", "spot").code in (
                0,
                1,
            )
    if (folder / "batch.parquet").exists():
        read_table(folder)


def kill_and_go_on(recordings, folder, moments, expected):
    """Kill a batch at these moments after its start, s; then let it come to its end."""
    for moment in moments:
        process = start_batch(recordings, folder)
        time.sleep(moment)
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=TIMEOUT_S)
        check_state(folder)
    process = start_batch(recordings, folder)
    _, stderr = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, stderr
    assert read_table(folder) == expected
    assert len(list(folder.glob("r*"))) == 4
    assert not list((folder / ".partial").iterdir())


@pytest.fixture(scope="module")
def undisturbed(recordings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "fleet"
    assert stairmap("batch", recordings, "-o", folder, "--workers", "0").code == 0
    return read_table(folder)


@pytest.mark.nightly
def test_batch_that_was_killed_goes_on(recordings, undisturbed, tmp_path):
    folder = tmp_path / "fleet"
    process = start_batch(recordings, folder)
    wait_until(lambda: len(list(folder.glob("r*/task.json"))) >= 1, "no recording was done")
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=TIMEOUT_S)
    check_state(folder)
    kill_and_go_on(recordings, folder, (), undisturbed)


@pytest.mark.nightly
def test_batch_killed_at_twenty_moments_is_always_readable_and_goes_on(recordings, undisturbed, tmp_path):
    moments = random.Random(1)
    for number in range(5):
        kill_and_go_on(
            recordings,
            tmp_path / f"fleet{number}",
            [moments.uniform(0.5, 12.0) for _ in range(4)],
            undisturbed,
        )


@pytest.mark.nightly
def test_interrupted_batch_writes_its_tables_and_says_so(recordings, tmp_path):
    process = start_batch(recordings, tmp_path / "fleet", num_workers=1)
    wait_until(lambda: len(list((tmp_path / "fleet").glob("r*/task.json"))) >= 1, "no recording was done")
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode in (130, 0), stderr
    assert "Traceback" not in stderr
    assert read_table(tmp_path / "fleet") and str(tmp_path / "fleet") in stdout
