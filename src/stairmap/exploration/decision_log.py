"""Every decision with what there was to choose from, so that anybody can check the choice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from stairmap.exploration.tasks import Task


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A choice.

    Attributes
    ----------
    time_s
        Time of the mission, s.
    level
        Where the robot was.
    place
        x, y, m.
    chosen
        The task; ``None`` at the end.
    tasks
        All there were.
    duration_s
        CPU time that the decision took, s.
    """

    time_s: float
    level: int
    place: tuple[float, float]
    chosen: Task | None
    tasks: tuple[Task, ...]
    duration_s: float

    def to_dict(self) -> dict[str, Any]:
        """Return the decision as JSON types."""
        return {
            "event": "decision",
            "time_s": round(self.time_s, 2),
            "level": self.level,
            "place": [round(value, 3) for value in self.place],
            "chosen": None if self.chosen is None else self.chosen.to_dict(),
            "tasks": [task.to_dict() for task in self.tasks],
            "duration_s": round(self.duration_s, 4),
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Decision:
        """Return the decision of ``to_dict``; its tasks have no cells.

        Raises
        ------
        KeyError, TypeError
            If these are not its values.
        """
        x, y = values["place"]
        chosen = values["chosen"]
        return cls(
            time_s=values["time_s"],
            level=values["level"],
            place=(x, y),
            chosen=None if chosen is None else Task.from_dict(chosen),
            tasks=tuple(Task.from_dict(task) for task in values["tasks"]),
            duration_s=values["duration_s"],
        )


class DecisionLog:
    """Keeps decisions and events, and hands each on.

    Parameters
    ----------
    write
        Told each entry as JSON types.
    """

    def __init__(self, write: Callable[[dict[str, Any]], None] = lambda _: None) -> None:
        self.decisions: list[Decision] = []
        self.events: list[dict[str, Any]] = []
        self.write = write

    @property
    def num_entries(self) -> int:
        """Number of decisions and events."""
        return len(self.decisions) + len(self.events)

    def restore(self, entries: Iterable[dict[str, Any]]) -> None:
        """Go on from entries as ``write`` was told them.

        Raises
        ------
        KeyError, TypeError, ValueError
            If there are others among them.
        """
        self.decisions, self.events = [], []
        for entry in entries:
            if entry["event"] == "decision":
                self.decisions.append(Decision.from_dict(entry))
            else:
                self.events.append(entry)

    def add(self, decision: Decision) -> None:
        """Take in a decision."""
        self.decisions.append(decision)
        self.write(decision.to_dict())

    def note(self, time_s: float, event: str, **values: Any) -> None:
        """Take in something that happened."""
        entry = {"event": event, "time_s": round(time_s, 2), **values}
        self.events.append(entry)
        self.write(entry)

    def tasks_of(self, kind: str) -> Sequence[Task]:
        """Return the chosen tasks of a kind."""
        return [d.chosen for d in self.decisions if d.chosen is not None and d.chosen.kind == kind]
