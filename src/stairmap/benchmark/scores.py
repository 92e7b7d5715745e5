"""Scores of a program over the tasks of one kind: found, right, false, errors, time."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from stairmap.benchmark.programs import Answer
from stairmap.benchmark.tasks import Task, TaskKind
from stairmap.evaluation.matching import match_flights

RISE_LIMIT, RUN_LIMIT = 0.010, 0.015
"""A flight is right when rise and run err by no more, m: the goal of a team of quadruped users, and half more
for the run, which a leg forgives."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskScore:
    """What an answer is worth.

    Attributes
    ----------
    num_asked, num_found, num_right
        Flights that had to be found, were, and were measured right.
    num_false
        Flights that are not there, and second ones of one that is.
    rise_errors, run_errors, width_errors
        Of all that were found, estimate minus truth, m.
    """

    num_asked: int
    num_found: int
    num_right: int
    num_false: int
    rise_errors: tuple[float, ...] = ()
    run_errors: tuple[float, ...] = ()
    width_errors: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramScore:
    """A row of the table; means are of absolute errors, mm, NaN where nothing was found.

    ``first_error`` names the first task without an answer that counts, and says why; empty if there is none.
    """

    program: str
    kind: TaskKind
    num_tasks: int
    num_asked: int
    num_found: int
    num_right: int
    num_false: int
    rise_mm: float
    run_mm: float
    width_mm: float
    ms: float
    num_errors: int
    first_error: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types."""
        return {name: getattr(self, name) for name in self.__slots__}


def score_answer(task: Task, answer: Answer) -> TaskScore:
    """Hold an answer against the truth (``evaluation.matching`` says what may stand for what)."""
    flights = [item.flight for item in task.truth]
    must = [item.must_be_found for item in task.truth]
    matching = match_flights(answer.flights, flights, optional=[not item for item in must])
    pairs = [(answer.flights[index], flights[number], must[number]) for index, number in matching.pairs]
    asked = [(found, true) for found, true, is_asked in pairs if is_asked]
    return TaskScore(
        num_asked=sum(must),
        num_found=len(asked),
        num_right=sum(
            abs(found.rise - true.rise) <= RISE_LIMIT and abs(found.run - true.run) <= RUN_LIMIT
            for found, true in asked
        ),
        num_false=len(matching.strays) + len(matching.duplicates),
        rise_errors=tuple(found.rise - true.rise for found, true in asked),
        run_errors=tuple(found.run - true.run for found, true in asked),
        width_errors=tuple(found.width - true.width for found, true in asked),
    )


def score_program(
    program: str, kind: TaskKind, tasks: Sequence[Task], answers: Sequence[Answer]
) -> ProgramScore | None:
    """Return the row of a program for one kind of task; ``None`` where it skipped all of them."""
    given = [(task, answer) for task, answer in zip(tasks, answers, strict=True) if not answer.is_skipped]
    if not given:
        return None
    scores = [score_answer(task, answer) for task, answer in given]

    def mean_mm(name: str) -> float:
        errors = [abs(error) for score in scores for error in getattr(score, name)]
        return 1e3 * statistics.fmean(errors) if errors else float("nan")

    return ProgramScore(
        program=program,
        kind=kind,
        num_tasks=len(given),
        num_asked=sum(score.num_asked for score in scores),
        num_found=sum(score.num_found for score in scores),
        num_right=sum(score.num_right for score in scores),
        num_false=sum(score.num_false for score in scores),
        rise_mm=mean_mm("rise_errors"),
        run_mm=mean_mm("run_errors"),
        width_mm=mean_mm("width_errors"),
        ms=statistics.median(answer.ms for _, answer in given),
        num_errors=sum(bool(answer.error) for _, answer in given),
        first_error=next((f"{task.name}: {answer.error}" for task, answer in given if answer.error), ""),
    )
