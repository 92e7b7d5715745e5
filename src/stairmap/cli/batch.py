"""``stairmap batch``: many recordings, on this machine or on a cluster."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from pathlib import Path

import typer

from stairmap.batch.batch_folder import BatchFolder
from stairmap.batch.cluster import default_num_workers, local_pool, scheduler_pool
from stairmap.batch.inputs import find_inputs
from stairmap.batch.job import BatchSettings
from stairmap.batch.pools import JobPool, OneProcessPool
from stairmap.batch.running import BatchOutcome, BatchProgress, BatchRun
from stairmap.batch.summary_page import PAGE_FILE
from stairmap.batch.table_files import CSV_FILE, PARQUET_FILE, load_pyarrow
from stairmap.cli.interrupts import Interrupt, noted_interrupts
from stairmap.cli.progress import TrialProgress
from stairmap.cli.requests import BatchRequest
from stairmap.config import dump_config, load_config
from stairmap.export.summary import counted
from stairmap.navigation.robot_profile import load_robot


def run_batch(request: BatchRequest) -> int:
    """Make a run folder of each recording and the tables of all; return the exit code.

    Raises
    ------
    StairmapError
        If the batch cannot be started or go on; a recording that fails is a row of the tables.
    """
    load_pyarrow()
    # A column is called what the user called the robot: spot, or the name of a file.
    robots = {Path(name).stem: load_robot(name) for name in request.robots}
    config = load_config(request.config_file, request.overrides)
    settings = BatchSettings(
        # Poses from depth bring a drift of their own, unless one was given.
        config_yaml=dump_config(config, only_given=request.with_odometry),
        method=request.method,
        up=request.up,
        pose_format=request.pose_format,
        with_odometry=request.with_odometry,
        bag=request.bag,
        with_reports=request.with_reports,
    )
    recordings = find_inputs(request.recordings)
    with (
        noted_interrupts() as interrupt,
        BatchFolder(request.output, settings.fingerprint()) as folder,
        _open_pool(request) as pool,
    ):
        _announce(pool, len(recordings))
        batch = BatchRun(recordings, settings, folder, robots=robots)
        with TrialProgress(len(recordings), unit="recording", num_known=batch.num_known) as progress:
            outcome = batch.run(
                pool,
                should_stop=lambda: bool(interrupt),
                on_progress=lambda state: progress.advance(_describe(state)),
            )
        typer.echo(_answer(request, outcome, folder.output, interrupt))
    return interrupt.exit_code


def _open_pool(request: BatchRequest) -> AbstractContextManager[JobPool]:
    if request.scheduler is not None:
        return scheduler_pool(request.scheduler)
    num_workers = default_num_workers() if request.num_workers is None else request.num_workers
    return local_pool(num_workers, request.memory_limit) if num_workers else OneProcessPool()


def _announce(pool: JobPool, num_recordings: int) -> None:
    workers = counted(pool.num_workers, "worker")
    page = f"; dashboard: {pool.dashboard}" if pool.dashboard else ""
    typer.echo(f"{counted(num_recordings, 'recording')}, {workers}{page}", err=True)
    if not pool.num_workers:
        typer.echo("the scheduler has no worker yet; waiting for one", err=True)


def _describe(state: BatchProgress) -> str:
    failed = f", {state.num_failed} failed" if state.num_failed else ""
    return f"{counted(state.num_stairways, 'stairway')}{failed}"


def _answer(request: BatchRequest, outcome: BatchOutcome, output: str, interrupt: Interrupt) -> str:
    if request.as_json:
        values = {
            "output": output,
            "interrupted": bool(interrupt),
            "num_recordings": outcome.num_recordings,
            "num_known": outcome.num_known,
            "num_done": outcome.num_done,
            "num_failed": outcome.num_failed,
            "num_broken_off": outcome.num_broken_off,
            "num_stairways": outcome.num_stairways,
            "task_cpu_s": round(outcome.task_cpu_s, 3),
            "tables": [CSV_FILE, PARQUET_FILE, PAGE_FILE],
        }
        return json.dumps(values, indent=1)
    broken = f" ({outcome.num_broken_off} broke off)" if outcome.num_broken_off else ""
    known = f", {outcome.num_known} done before" if outcome.num_known else ""
    rest = outcome.num_recordings - outcome.num_known - outcome.num_done - outcome.num_failed
    left = f", {rest} left: call again to go on" if outcome.was_stopped and rest > 0 else ""
    return (
        f"{counted(outcome.num_recordings, 'recording')}: {outcome.num_done} done{broken}{known}, "
        f"{outcome.num_failed} failed{left}; {counted(outcome.num_stairways, 'stairway')}\n"
        f"tables: {CSV_FILE}, {PARQUET_FILE}; page: {PAGE_FILE}\n\n{output}"
    )
