"""``stairmap benchmark``: any detector on generated tasks with known truth."""

from __future__ import annotations

import json

import typer

import stairmap
from stairmap.benchmark.programs import Program
from stairmap.benchmark.running import BenchmarkSettings, format_scores, own_programs, run_benchmark
from stairmap.cli.progress import TrialProgress
from stairmap.cli.requests import BenchmarkRequest
from stairmap.errors import BenchmarkError
from stairmap.export.results import null_for_nan
from stairmap.simulation.render import check_ray_caster


def score_programs(request: BenchmarkRequest) -> int:
    """Ask programs and our own methods, print one table; return the exit code.

    Raises
    ------
    StairmapError
        If a program cannot be started, or the extra ``sim`` is missing.
    """
    check_ray_caster()
    programs = own_programs(timeout=request.timeout) if request.with_own else []
    for name, command in request.programs:
        if any(program.name == name for program in programs):
            raise BenchmarkError(f"two programs are called {name}; give one another name")
        programs.append(Program(name, command, timeout=request.timeout))
    if not programs:
        raise BenchmarkError("expected --program NAME=COMMAND with --no-own: nobody is left to be scored")
    settings = BenchmarkSettings(
        numbers={"frame": request.num_frames, "drive": request.num_drives, "cloud": request.num_clouds},
        seed=request.seed,
        timeout=request.timeout,
    )
    with TrialProgress(sum(settings.numbers.values()), unit="task") as progress:
        scores = run_benchmark(programs, settings, on_task=progress.advance)
    if request.as_json:
        values = {
            "software": f"stairmap {stairmap.__version__}",
            "seed": request.seed,
            "scores": [score.to_dict() for score in scores],
        }
        typer.echo(json.dumps(null_for_nan(values), indent=1, allow_nan=False))
    else:
        typer.echo(f"seed {request.seed}, stairmap {stairmap.__version__}\n\n{format_scores(scores)}")
    return 0
