"""What is left of an edge beside stairs that a robot climbs: a platform may end there to either side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stairmap.arrays import Points
from stairmap.drop import Drop
from stairmap.modeling.drop_stairways import is_edge_of
from stairmap.navigation.footprints import EDGE_MARGIN, UNSEEN_SIDE
from stairmap.stairway import Flight, Stairway

MIN_PIECE = 0.20
"""Shortest piece of an edge that is told, m."""


def pieces_beside(edge: Points, flight: Flight) -> tuple[Points, ...]:
    """Return the parts of a (2, 3) edge, m, map, that lie beside the steps of a flight.

    They begin ``EDGE_MARGIN`` beside the steps, where strips before them leave the steps open.
    """
    left = np.array([-flight.forward[1], flight.forward[0], 0.0])
    begin, end = (edge - flight.base) @ left
    half = flight.width / 2 + EDGE_MARGIN
    bounds = (
        -half - (0.0 if flight.right_bounded else UNSEEN_SIDE),
        half + (0.0 if flight.left_bounded else UNSEEN_SIDE),
    )
    length = float(np.linalg.norm(edge[1] - edge[0]))
    if abs(end - begin) < 1e-9:
        return () if bounds[0] <= begin <= bounds[1] else (edge,)
    first, last = np.clip(sorted((bound - begin) / (end - begin) for bound in bounds), 0.0, 1.0)
    return tuple(
        edge[0] + np.array([[start], [stop]]) * (edge[1] - edge[0])
        for start, stop in ((0.0, first), (last, 1.0))
        if (stop - start) * length >= MIN_PIECE
    )


def drops_beside(drop: Drop, stairways: Sequence[Stairway]) -> tuple[Drop, ...]:
    """Return what is left of a drop beside the flights of stairways that it is an edge of."""
    pieces: tuple[Points, ...] = (drop.edge,)
    for stairway in stairways:
        if stairway.id == drop.stairway_id:
            for flight in stairway.flights:
                if is_edge_of(drop, flight):
                    pieces = tuple(part for piece in pieces for part in pieces_beside(piece, flight))
    return tuple(replace(drop, edge=piece) for piece in pieces)


def drops_not_climbed(drops: Sequence[Drop], climbed: Sequence[Stairway]) -> tuple[Drop, ...]:
    """Return the drops for a robot that climbs some stairways: of their edges, what lies beside them."""
    ids = {stairway.id for stairway in climbed}
    return tuple(
        part
        for drop in drops
        for part in ((drop,) if drop.stairway_id not in ids else drops_beside(drop, climbed))
    )
