"""Which task comes next: by cost and gain, or by simpler rules to compare with."""

from __future__ import annotations

from collections.abc import Sequence

from stairmap.exploration.tasks import Task

VALUE_OF_AREA = 60.0
"""What a square metre of unknown ground is worth while the robot is on its floor, s: whoever leaves it behind
comes back for it over the stairs."""

START_UP = 3.0
"""Time that any task costs beyond its way, s: turning there, looking, deciding."""

STRATEGIES = ("gain", "nearest", "stairs-free", "stairs-ignored")
"""``gain``: by cost and gain, stairs last. ``nearest``: the cheapest. ``stairs-free``: by cost and gain, and
the climb costs nothing. ``stairs-ignored``: stairs are never used."""


def is_worthwhile(task: Task) -> bool:
    """Tell whether a task on this level costs less than its gain says."""
    return task.cost < VALUE_OF_AREA * task.gain


def choose(tasks: Sequence[Task], *, strategy: str = "gain") -> Task | None:
    """Return the task to do next; ``None`` where there is none.

    Parameters
    ----------
    tasks
        All that can be reached.
    strategy
        One of ``STRATEGIES``.
    """
    near = [task for task in tasks if task.kind != "stairs"]
    stairs = [task for task in tasks if task.kind == "stairs"]
    if strategy == "stairs-ignored":
        stairs = []
    if strategy == "nearest":
        return min([*near, *stairs], key=lambda task: task.cost, default=None)
    if strategy == "stairs-free":
        return max([*near, *stairs], key=_rate, default=None)
    worthwhile = [task for task in near if is_worthwhile(task)]
    if worthwhile:
        return max(worthwhile, key=_rate)
    if stairs:
        return min(stairs, key=lambda task: task.cost - VALUE_OF_AREA * task.gain)
    return max(near, key=_rate, default=None)


def _rate(task: Task) -> float:
    """Ground that may be seen for the time, m²/s."""
    return task.gain / (task.cost + START_UP)
