"""Where a robot turns on a landing, so that straight lines lead over it and not along its edge."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Vector
from stairmap.geometry import wrapped_angle
from stairmap.modeling.landings import top_of
from stairmap.stairway import Flight, Landing

MIN_TURN = float(np.radians(30.0))
"""Where the next flight turns by less, one walks straight on to it, rad."""

QUARTER_TURN = (float(np.radians(60.0)), float(np.radians(120.0)))
"""Between these, the way turns where the middle lines of both flights meet, rad."""

SAME_PLACE = 0.15
"""Corners that are nearer to each other are one, m."""


def find_landing_corners(below: Flight, above: Flight, landing: Landing | None) -> list[Vector]:
    """Return the (3,) places on a landing at which the way from one flight to the next turns, m.

    Half turns are taken in the middle of the landing's depth; without a landing that is known, half a width
    behind the lower flight's top.
    """
    turn = abs(wrapped_angle(above.heading - below.heading))
    if turn < MIN_TURN:
        return []
    top = top_of(below)
    depth = 0.5 * (max(below.width, above.width) if landing is None else landing.size[0])
    if QUARTER_TURN[0] < turn < QUARTER_TURN[1]:
        depth = max(float((above.base - top) @ below.forward), SAME_PLACE)
    first = top + depth * below.forward
    before = min(float((first - above.base) @ above.forward), -SAME_PLACE)
    second = above.base + before * above.forward
    # The landing is level: what the flights differ by is their error.
    second[2] = first[2]
    return [first] if np.linalg.norm(second - first) < SAME_PLACE else [first, second]
