"""Run many trials on all cores. A trial that fails becomes a row that says so; the others go on."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path

from stairmap.config import Config
from stairmap.evaluation.trials import TrialResult, TrialSpec, run_trial
from stairmap.evaluation.workers import make_worker_pool

TrialFunction = Callable[..., tuple[TrialResult, ...]]
"""``run_trial``, or what stands for it in a test; must be importable by a worker."""

OnResults = Callable[[tuple[TrialResult, ...]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialSettings:
    """What all trials of a run share; see ``run_trial``."""

    methods: tuple[str, ...]
    config: Config = field(default_factory=Config)
    buildings: Path | None = None
    cache: Path | None = None


def run_trials(
    specs: Sequence[TrialSpec],
    settings: TrialSettings,
    *,
    num_workers: int,
    on_results: OnResults | None = None,
    trial: TrialFunction = run_trial,
) -> tuple[TrialResult, ...]:
    """Run trials in parallel.

    Parameters
    ----------
    specs
        The trials.
    settings
        Shared by all.
    num_workers
        Number of processes.
    on_results
        Called with the results of each trial when it has come to its end, in that order.
    trial
        What to run.

    Returns
    -------
    The results in the order of ``specs``, for each spec one per method.
    """
    results: dict[int, tuple[TrialResult, ...]] = {}

    def finish(index: int, found: tuple[TrialResult, ...]) -> None:
        results[index] = found
        if on_results is not None:
            on_results(found)

    waiting = list(range(len(specs)))
    while waiting:
        suspects = _run_until_broken(
            waiting, specs, settings, num_workers=num_workers, trial=trial, finish=finish
        )
        # Whichever of them killed its process: alone, only the guilty one does it again.
        for index in suspects:
            finish(index, _run_alone(specs[index], settings, trial))
        waiting = [index for index in waiting if index not in results]
    return tuple(result for index in range(len(specs)) for result in results[index])


def _run_until_broken(
    waiting: Sequence[int],
    specs: Sequence[TrialSpec],
    settings: TrialSettings,
    *,
    num_workers: int,
    trial: TrialFunction,
    finish: Callable[[int, tuple[TrialResult, ...]], None],
) -> list[int]:
    """Run trials until all are done or a worker dies; return those that were running then."""
    running: dict[Future[tuple[TrialResult, ...]], int] = {}
    queue = list(reversed(waiting))
    with make_worker_pool(num_workers) as pool:
        while queue or running:
            # No more than there are workers, so that whatever is in the pool is running.
            try:
                while queue and len(running) < num_workers:
                    running[pool.submit(_try_trial, trial, specs[queue[-1]], settings)] = queue[-1]
                    queue.pop()
            except BrokenProcessPool:
                return list(running.values())
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                if isinstance(future.exception(), BrokenProcessPool):
                    return list(running.values())
                finish(running.pop(future), future.result())
    return []


def _run_alone(spec: TrialSpec, settings: TrialSettings, trial: TrialFunction) -> tuple[TrialResult, ...]:
    with make_worker_pool(1) as pool:
        try:
            return pool.submit(_try_trial, trial, spec, settings).result()
        except BrokenProcessPool:
            return _crashed(spec, settings, "its process died")


def _try_trial(trial: TrialFunction, spec: TrialSpec, settings: TrialSettings) -> tuple[TrialResult, ...]:
    try:
        return trial(
            spec, settings.methods, config=settings.config, buildings=settings.buildings, cache=settings.cache
        )
    # A crash of any kind is a row of the table.
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        return _crashed(spec, settings, f"{type(error).__name__}: {error} ({where})")


def _crashed(spec: TrialSpec, settings: TrialSettings, crash: str) -> tuple[TrialResult, ...]:
    return tuple(TrialResult(spec=spec, method=method, crash=crash) for method in settings.methods)
