"""Ask every program every task, and score the answers."""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from stairmap.benchmark.programs import Answer, Program
from stairmap.benchmark.scores import ProgramScore, score_program
from stairmap.benchmark.tasks import KINDS, Task, TaskKind, make_tasks
from stairmap.evaluation.table_format import format_table
from stairmap.pipeline import METHODS

COLUMNS = (
    "program", "task", "tasks", "flights", "found", "right", "false", "rise mm", "run mm", "width mm", "ms",
    "failed",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchmarkSettings:
    """Which tasks: how many of each kind, from which seed, and the time for an answer, s."""

    numbers: Mapping[TaskKind, int]
    seed: int
    timeout: float


def own_programs(*, timeout: float) -> list[Program]:
    """Return our own methods as programs."""
    command = f"{sys.executable} -m stairmap.benchmark.entry"
    return [Program(method, f"{command} {method}", timeout=timeout) for method in METHODS]


def run_benchmark(
    programs: Sequence[Program],
    settings: BenchmarkSettings,
    *,
    on_task: Callable[[str], None] = lambda _: None,
) -> list[ProgramScore]:
    """Ask every program every task; return a row for each program and kind.

    Parameters
    ----------
    programs
        Who enters.
    settings
        Which tasks.
    on_task
        Called after each task with its name.

    Raises
    ------
    StairmapError
        If a program cannot be started, or tasks cannot be generated.
    """
    scores = []
    try:
        for kind in KINDS:
            tasks: list[Task] = []
            answers: dict[str, list[Answer]] = {program.name: [] for program in programs}
            with tempfile.TemporaryDirectory(prefix="stairmap-benchmark-") as folder:
                for task in make_tasks(kind, settings.numbers[kind], seed=settings.seed, folder=Path(folder)):
                    for program in programs:
                        answers[program.name].append(program.ask(task.request))
                    tasks.append(task)
                    on_task(task.name)
            rows = [score_program(program.name, kind, tasks, answers[program.name]) for program in programs]
            scores += [row for row in rows if row is not None]
    finally:
        for program in programs:
            program.close()
    return scores


def format_scores(scores: Sequence[ProgramScore]) -> str:
    """Return the table, and below it why answers did not count."""
    rows = [
        [
            score.program, score.kind, *(str(value) for value in (
                score.num_tasks, score.num_asked, score.num_found, score.num_right, score.num_false,
            )),
            *("" if math.isnan(value) else f"{value:.1f}" for value in (
                score.rise_mm, score.run_mm, score.width_mm, score.ms,
            )),
            str(score.num_errors),
        ]
        for score in scores
    ]  # fmt: skip
    failures = [
        f"{score.program}: {score.num_errors} failed, first {score.first_error}"
        for score in scores
        if score.first_error
    ]
    return "\n\n".join([format_table(COLUMNS, rows, num_left=2), *failures])
