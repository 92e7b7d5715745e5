"""``stairmap evaluate``: suites of trials with known truth, one table for all methods."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import typer

from stairmap.config import load_config
from stairmap.evaluation.running import TrialSettings, run_trials
from stairmap.evaluation.suites import TrialChoice, make_specs
from stairmap.evaluation.summary import group_results, summarize
from stairmap.evaluation.tables import format_groups, format_summary, format_trials
from stairmap.evaluation.trials import TrialResult


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluateRequest:
    """What was asked for; see the options of the command."""

    suites: tuple[str, ...]
    methods: tuple[str, ...]
    choice: TrialChoice = field(default_factory=TrialChoice)
    data: Path | None = None
    cache: Path | None = None
    num_workers: int | None = None
    config: Path | None = None
    overrides: Sequence[str] = ()
    is_json: bool = False


def evaluate_methods(request: EvaluateRequest) -> int:
    """Run the suites and print the tables; return the exit code."""
    buildings = None if request.data is None else request.data / "buildings"
    specs = [
        spec for suite in request.suites for spec in make_specs(suite, request.choice, buildings=buildings)
    ]
    settings = TrialSettings(
        methods=request.methods,
        config=load_config(request.config, request.overrides),
        buildings=buildings,
        cache=request.cache,
    )
    count = 0

    def show(results: tuple[TrialResult, ...]) -> None:
        nonlocal count
        count += 1
        if sys.stderr.isatty():
            typer.echo(f"\rtrial {count}/{len(specs)} · {results[0].spec}\x1b[K", err=True, nl=False)

    results = run_trials(
        specs, settings, num_workers=request.num_workers or os.cpu_count() or 1, on_results=show
    )
    if sys.stderr.isatty():
        typer.echo("\r\x1b[K", err=True, nl=False)
    if request.is_json:
        typer.echo(json.dumps({"trials": [result.to_dict() for result in results]}))
    else:
        typer.echo(format_results(results))
    return 0


def format_results(results: Sequence[TrialResult]) -> str:
    """Return all tables: trials, sums, sums by sensor."""
    by_method = group_results(results, lambda result: result.method)
    summaries = {method: summarize(mine) for method, mine in by_method.items()}
    parts = [format_trials(results), format_summary(summaries)]
    for method, mine in by_method.items():
        for title, key in (("sensor", lambda r: r.spec.sensor), ("suite", lambda r: r.spec.suite)):
            groups = group_results(mine, key)
            if len(groups) > 1:
                parts.append(
                    format_groups(
                        f"{method}, by {title}", {name: summarize(some) for name, some in groups.items()}
                    )
                )
    return "\n\n".join(parts)


def _main(
    suites: list[str],
    method: str = "both",
    only: list[str] = typer.Option([]),
    sensor: str | None = None,
    width: int | None = None,
    robot: str | None = None,
    seed: int = 0,
    drives: int | None = None,
    quick: bool = False,
    data: Path = Path("../shared/data"),
    cache: Path | None = None,
    jobs: int | None = None,
    config: Path | None = None,
    set_: list[str] = typer.Option([], "--set"),
    json_: bool = typer.Option(False, "--json"),
) -> None:
    names = suites if suites != ["all"] else ["table1", "stairs", "buildings", "look-alikes"]
    evaluate_methods(
        EvaluateRequest(
            suites=tuple(names),
            methods=("stairmap", "delmerico2013") if method == "both" else (method,),
            choice=TrialChoice(
                only=tuple(only),
                sensor=sensor,
                width=width,
                robot=robot,
                seed=seed,
                num_drives=drives,
                is_quick=quick,
            ),
            data=data,
            cache=cache,
            num_workers=jobs,
            config=config,
            overrides=set_,
            is_json=json_,
        )
    )


if __name__ == "__main__":
    typer.run(_main)
