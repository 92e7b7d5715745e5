"""How far off stairs a robot lines up: nearer where other edges of the ground leave less room."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Vector
from stairmap.drop import Drop
from stairmap.navigation.footprints import EDGE_MARGIN, PLACE_ERROR

STANDOFF = 0.6
"""Distance of a staging pose from the first riser or the last nosing, m."""

SAME_GROUND = 0.4
"""Edges within this of the height of an end are edges of its floor, m."""

TOWARDS_STAIRS = -0.5
"""An edge that falls off towards the stairs, by the cosine to the way off them, is that of their well."""


def find_room(end: Vector, outward: Vector, drops: Sequence[Drop], stairway_id: int) -> float:
    """Return how far from an end of stairs the ground goes on before an edge of it, m; infinite without one.

    Parameters
    ----------
    end
        (3,) foot of the first riser, or last nosing, m, map.
    outward
        (3,) level unit vector from the stairs over the floor.
    drops
        Edges of the ground; those of the stairway itself do not count.
    stairway_id
        The stairway.
    """
    room = np.inf
    left = np.array([-outward[1], outward[0], 0.0])
    for drop in drops:
        is_of_the_stairs = drop.stairway_id == stairway_id or float(drop.outward @ outward) < TOWARDS_STAIRS
        if is_of_the_stairs or abs(float(drop.center[2] - end[2])) > SAME_GROUND:
            continue
        ahead, aside = (drop.edge - end) @ outward, (drop.edge - end) @ left
        # Where the edge comes nearest within the width of a path.
        shares = np.linspace(0.0, 1.0, 50)
        is_in_path = np.abs(aside[0] + shares * (aside[1] - aside[0])) < EDGE_MARGIN
        distances = (ahead[0] + shares * (ahead[1] - ahead[0]))[is_in_path]
        distances = distances[distances > 0.0]
        room = min(room, float(distances.min(initial=np.inf)))
    return room


def staging_distance(room: float, unknown: float) -> tuple[float, bool]:
    """Return how far off a staging pose stands, m, and whether it is off all edges as far as masks forbid.

    Parameters
    ----------
    room
        Ground before the next edge, m; see ``find_room``.
    unknown
        How far stairs may go on beyond their end, m.
    """
    wanted, margin = STANDOFF + unknown, EDGE_MARGIN + PLACE_ERROR
    nearest = EDGE_MARGIN + unknown
    distance = max(min(wanted, room - margin), min(nearest, wanted))
    return distance, room - distance >= margin - 1e-9
