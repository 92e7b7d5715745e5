"""What a robot may do next: go to a frontier, look at something, use stairs; with cost and expected gain."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

from stairmap.arrays import Float64Array, Vector, readonly

TaskKind = Literal["frontier", "look", "stairs"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Something to do.

    Attributes
    ----------
    kind
        ``frontier``: see across the border of unknown ground; ``look``: look at what may be stairs, from
        nearer; ``stairs``: use a flight.
    level
        Number of the level where it begins.
    position
        (2,) where to go, m, map.
    target
        (2,) what to look at from there, m, map.
    cost
        To get there, and for stairs to climb them, s.
    gain
        Ground that may be seen, m².
    size
        Length of a frontier, m; NaN for others.
    cells
        (N, 2) cells of a frontier, m.
    link
        Number of the flight; ``None`` without one.
    is_up
        Whether a flight is used upwards.
    reason
        Why, in words, for the log.
    far_level
        Where stairs lead.
    """

    kind: TaskKind
    level: int
    position: Vector
    target: Vector
    cost: float
    gain: float
    size: float = math.nan
    cells: Float64Array = field(default_factory=lambda: readonly([]).reshape(-1, 2))
    link: int | None = None
    is_up: bool = True
    reason: str = ""
    far_level: int | None = None

    def __post_init__(self) -> None:
        for name in ("position", "target", "cells"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Task:
        """Return the task of ``to_dict``; it has no cells.

        Raises
        ------
        KeyError, TypeError
            If these are not its values.
        """
        size = math.nan if values["size"] is None else values["size"]
        return cls(**{**values, "size": size})

    def to_dict(self) -> dict[str, Any]:
        """Return the task as JSON types, without its cells."""
        return {
            "kind": self.kind,
            "level": self.level,
            "position": [round(float(value), 3) for value in self.position],
            "target": [round(float(value), 3) for value in self.target],
            "cost": round(self.cost, 2),
            "gain": round(self.gain, 2),
            "size": None if math.isnan(self.size) else round(self.size, 2),
            "link": self.link,
            "is_up": self.is_up,
            "far_level": self.far_level,
            "reason": self.reason,
        }
