"""Results of trials kept in a file while a long run goes on, so that a killed one need not begin anew."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path

from stairmap.evaluation.running import TrialSettings, run_trials
from stairmap.evaluation.trials import TrialResult, TrialSpec


def run_kept_trials(
    specs: Sequence[TrialSpec], settings: TrialSettings, *, num_workers: int, path: Path | None, commit: str
) -> tuple[TrialResult, ...]:
    """Run those trials that a file does not hold yet, and add them to it.

    Parameters
    ----------
    specs, settings, num_workers
        See ``run_trials``.
    path
        The file; ``None``: nothing is kept.
    commit
        Only results of the same commit are taken from the file.
    """
    kept = {} if path is None else _load(path, commit)
    waiting = [spec for spec in specs if spec not in kept]

    def keep(results: tuple[TrialResult, ...]) -> None:
        kept[results[0].spec] = results
        print(f"trial {len(kept)}/{len(specs)}: {results[0].spec}", flush=True)
        if path is not None:
            with path.open("ab") as file:
                pickle.dump((commit, results), file)

    run_trials(waiting, settings, num_workers=num_workers, on_results=keep)
    return tuple(result for spec in specs for result in kept[spec])


def _load(path: Path, commit: str) -> dict[TrialSpec, tuple[TrialResult, ...]]:
    kept: dict[TrialSpec, tuple[TrialResult, ...]] = {}
    if not path.exists():
        return kept
    with path.open("rb") as file:
        while True:
            try:
                of_commit, results = pickle.load(file)
            except EOFError:
                return kept
            if of_commit == commit:
                kept[results[0].spec] = results
