"""The levels of a building that a robot has stood on: floors and landings, with numbers that stay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from stairmap.exploration.level_map import LevelMap

SAME_LEVEL = 0.35
"""Places whose heights differ by less are on one level, m: less than three risers."""


@dataclass(slots=True, kw_only=True)
class Level:
    """A level that the robot stood on.

    Attributes
    ----------
    number
        From 0, in the order in which they were reached; it stays.
    height
        Of its ground, m, map.
    map
        What was seen of it.
    is_landing
        Whether it is only a part of a stairway.
    """

    number: int
    height: float
    map: LevelMap
    is_landing: bool = False


class LevelBook:
    """All levels so far; ``make_map`` gives the empty map of one at a height, m."""

    def __init__(self, make_map: Callable[[float], LevelMap]) -> None:
        self.levels: list[Level] = []
        self._make_map = make_map

    def find(self, height: float) -> Level | None:
        """Return the level at a height, m; ``None`` if the robot never stood there."""
        near = [level for level in self.levels if abs(level.height - height) < SAME_LEVEL]
        return min(near, key=lambda level: abs(level.height - height)) if near else None

    def enter(self, height: float) -> tuple[Level, bool]:
        """Return the level at a height, and whether it is new."""
        known = self.find(height)
        if known is not None:
            return known, False
        level = Level(number=len(self.levels), height=height, map=self._make_map(height))
        self.levels.append(level)
        return level, True

    @property
    def floors(self) -> list[Level]:
        """Those that are no landings."""
        return [level for level in self.levels if not level.is_landing]
