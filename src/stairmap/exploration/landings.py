"""Tell landings from floors: a landing is a small level between two flights, far below a storey's height."""

from __future__ import annotations

import numpy as np

from stairmap.exploration.known_building import KnownBuilding
from stairmap.exploration.levels import Level
from stairmap.navigation.occupancy import FREE

MIN_STOREY = 2.4
"""A level so far from both levels that its flights lead to is a floor, m: rooms are that high."""

MIN_FLOOR_AREA = 6.0
"""A smaller level between two flights is a landing, m²."""

AREA_OF_WIDTH = 12.0
"""One is a landing up to so many squares of its flights' width: that of a half turn is three."""


def classify_landings(known: KnownBuilding) -> None:
    """Mark each level as a landing or not, from the links and the ground known by now."""
    for level in known.levels.levels:
        level.is_landing = _is_landing(known, level)


def _is_landing(known: KnownBuilding, level: Level) -> bool:
    links = [link for link in known.stairs.links if level.number in (link.lower, link.upper)]
    up = [link for link in links if link.lower == level.number]
    down = [link for link in links if link.upper == level.number]
    if not up or not down:
        return False
    height_of = {other.number: other.height for other in known.levels.levels}
    steps = [
        abs(height_of.get(link.upper if link in up else link.lower, level.height) - level.height)
        for link in links
    ]
    steps = [step for step in steps if step > 0]
    if steps and min(steps) >= MIN_STOREY:
        return False
    width = max(link.flight.width for link in links)
    return free_area(level) < max(MIN_FLOOR_AREA, AREA_OF_WIDTH * width**2)


def free_area(level: Level) -> float:
    """Return the free ground of a level, m²."""
    grid = level.map.grid()
    return float(np.count_nonzero(grid.cells == FREE)) * grid.resolution**2
