"""Where stairs are on the map of a floor: ground that wheels must never touch.

On the floor below it is the part of the stairway under which nobody can pass; on the floor above it is the
whole well with its open eye, and a strip before each edge, which no depth camera sees as an obstacle. So it
is on each floor that the well cuts in passing, and before every other drop. A robot that climbs the stairs
has them open, but not the sides of their well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.drop import Drop
from stairmap.geometry import wrapped_angle
from stairmap.navigation.carried_stairs import carry_to_floors
from stairmap.navigation.floors import FloorStack
from stairmap.stairway import Flight, Landing, Stairway

HEADROOM = 2.0
"""Under stairs that are higher than this above a floor one can pass, m."""

EDGE_MARGIN = 0.30
"""Width of the strip before a descending edge, m: the way a robot rolls on after it saw its mistake."""

FOOT_MARGIN = 0.05
"""Width of the strip before the first riser, m."""

BEYOND_EDGE = 0.20
"""Width of the strip beyond an edge that is forbidden too, m: the edge is known to a few centimetres."""

PLACE_ERROR = 0.05
"""How far beyond its true place an edge may be modelled, m: stereo cameras fatten near ground by half a
window, and a cell of a mask counts by its middle. The strip before it is so much wider."""

UNSEEN_SIDE = 0.60
"""Stairs of which an end of the width was not seen may go on so far to that side, m: half a usual width."""

_WAY_END = 0.6
"""How far beyond both ends of a flight a robot climbs it, m."""

MAX_EYE, OPPOSITE = 2.0, math.radians(150.0)
"""Between two flights of a stairway that lead against each other, rad, and are so near, m, the well is
open."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectangle:
    """A level rectangle: (x, y) of its centre, m, map, direction of its length, rad, and its size, m."""

    center: tuple[float, float]
    heading: float
    length: float
    width: float

    def contains(self, points: Float64Array) -> Mask:
        """Tell which of (..., 2) points lie in it."""
        offset = points - np.array(self.center)
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        along = offset[..., 0] * cosine + offset[..., 1] * sine
        across = offset[..., 1] * cosine - offset[..., 0] * sine
        return np.asarray((np.abs(along) <= self.length / 2) & (np.abs(across) <= self.width / 2))

    def corners(self) -> Float64Array:
        """Return its (4, 2) corners, counter-clockwise."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [self.length / 2, self.width / 2]
        return np.asarray(local @ np.array([[cosine, sine], [-sine, cosine]]) + np.array(self.center))


def stair_rectangles(
    stairway: Stairway,
    floors: FloorStack,
    level: int,
    *,
    drops: Sequence[Drop] = (),
    side_margin: float = 0.0,
) -> tuple[Rectangle, ...]:
    """Return what a stairway covers on a floor; nothing on a floor below or above it.

    Parameters
    ----------
    stairway, floors, level
        Which stairs on which floor.
    drops
        Edges of the ground; those of this stairway tell where its upper end is.
    side_margin
        Width of the strip beside the well on floors that it cuts, m.
    """
    lower, upper = floors.levels[stairway.id]
    if not lower <= level <= upper:
        return ()
    floor_height = floors.floor(level).height
    carried = carry_to_floors(stairway, floors, drops)
    flights = carried.stairway.flights
    side = 0.0 if level == lower else side_margin
    rectangles = []
    for flight in flights:
        covered = flight.num_risers
        if level == lower:
            covered = int((floor_height + HEADROOM - flight.base[2]) / flight.rise)
        foot = edge = 0.0
        if flight is flights[0]:
            # On a floor above the first, both ends of the hole are edges.
            foot = FOOT_MARGIN + carried.unknown_below if level == lower else EDGE_MARGIN
        if flight is flights[-1] and level != lower:
            edge = EDGE_MARGIN + carried.unknown_above
        sides = (0.0, 0.0) if level == lower else tuple(side + unseen for unseen in _unseen_sides(flight))
        if covered > 0:
            ends = (foot, edge)
            rectangles.append(_flight_rectangle(flight, min(covered, flight.num_risers), ends, sides))
    rectangles += [
        _landing_rectangle(landing, side)
        for landing in stairway.landings
        if level != lower or landing.center[2] < floor_height + HEADROOM
    ]
    return (*rectangles, *(() if level == lower else _open_eyes(flights)))


def side_rectangles(
    stairway: Stairway, floors: FloorStack, level: int
) -> tuple[tuple[Rectangle, ...], tuple[Rectangle, ...]]:
    """Return the edges of a well beside stairs that a robot climbs, and the ground on which it climbs them.

    The second is open, also where it lies in the first. Both are empty but on the floors that the well cuts.
    """
    lower, upper = floors.levels[stairway.id]
    if not lower < level <= upper:
        return (), ()
    flights = carry_to_floors(stairway, floors).stairway.flights
    beside, ways = [], []
    for flight in flights:
        # Where an end of the width was not seen, the steps may go on, and so may the robot.
        unseen = _unseen_sides(flight)
        sides = tuple(value or EDGE_MARGIN for value in unseen)
        beside.append(_flight_rectangle(flight, flight.num_risers, (0.0, 0.0), sides))
        ends = (_WAY_END, _WAY_END)
        ways.append(_flight_rectangle(flight, flight.num_risers, ends, unseen))
    beside += [_landing_rectangle(landing, EDGE_MARGIN) for landing in stairway.landings]
    ways += [_landing_rectangle(landing, 0.0) for landing in stairway.landings]
    return (*beside, *_open_eyes(flights)), tuple(ways)


def drop_rectangles(drops: Iterable[Drop], floors: FloorStack, level: int) -> tuple[Rectangle, ...]:
    """Return the strips before the edges of a floor: from ``EDGE_MARGIN`` before each to a bit beyond.

    An edge is on the floor that is nearest to its height, however far that is: a ramp may lead to it.
    """
    rectangles = []
    for drop in drops:
        if _level_of(drop, floors) != level:
            continue
        before = EDGE_MARGIN + PLACE_ERROR
        middle = drop.center + 0.5 * (BEYOND_EDGE - before) * drop.outward
        rectangles.append(
            Rectangle(
                center=(float(middle[0]), float(middle[1])),
                heading=math.atan2(drop.outward[1], drop.outward[0]),
                length=before + BEYOND_EDGE,
                width=drop.length + 2 * EDGE_MARGIN,
            )
        )
    return tuple(rectangles)


def _level_of(drop: Drop, floors: FloorStack) -> int:
    return min(floors.floors, key=lambda floor: abs(floor.height - float(drop.center[2]))).level


def _unseen_sides(flight: Flight) -> tuple[float, float]:
    """How far steps may go on beyond the left and right end of their width, m."""
    return (
        0.0 if flight.left_bounded else UNSEEN_SIDE,
        0.0 if flight.right_bounded else UNSEEN_SIDE,
    )


def _flight_rectangle(
    flight: Flight, num_risers: int, ends: tuple[float, float], sides: tuple[float, ...]
) -> Rectangle:
    """The first risers of a flight, with strips at its foot and edge, and at its left and right side, m."""
    foot, edge = ends
    left, right = sides
    begin = -foot
    # The tread of the last riser that counts belongs to the stairs, unless that is the floor itself.
    end = (num_risers - 1) * flight.run + edge
    if num_risers < flight.num_risers:
        end += flight.run
    to_left = np.array([-flight.forward[1], flight.forward[0], 0.0])
    middle = flight.base + flight.forward * (begin + end) / 2 + to_left * (left - right) / 2
    return Rectangle(
        center=(float(middle[0]), float(middle[1])),
        heading=flight.heading,
        length=end - begin,
        width=flight.width + left + right,
    )


def _landing_rectangle(landing: Landing, side: float) -> Rectangle:
    return Rectangle(
        center=(float(landing.center[0]), float(landing.center[1])),
        heading=landing.heading,
        length=landing.size[0] + 2 * side,
        width=landing.size[1] + 2 * side,
    )


def _open_eyes(flights: Sequence[Flight]) -> tuple[Rectangle, ...]:
    """The open ground between flights that lead against each other, with the strips before its ends."""
    eyes = []
    for first, second in combinations(flights, 2):
        if abs(wrapped_angle(second.heading - first.heading)) < OPPOSITE:
            continue
        left = np.array([-first.forward[1], first.forward[0], 0.0])
        ends = [second.base, second.base + (second.num_risers - 1) * second.run * second.forward]
        along = [0.0, (first.num_risers - 1) * first.run]
        along += [float((end - first.base) @ first.forward) for end in ends]
        across = float(np.mean([(end - first.base) @ left for end in ends]))
        gap = abs(across) - (first.width + second.width) / 2
        if not 0.0 < gap <= MAX_EYE:
            continue
        begin, end = min(along) - EDGE_MARGIN, max(along) + EDGE_MARGIN
        aside = math.copysign((first.width + gap) / 2, across)
        middle = first.base + first.forward * (begin + end) / 2 + left * aside
        eyes.append(
            Rectangle(
                center=(float(middle[0]), float(middle[1])),
                heading=first.heading,
                length=end - begin,
                width=gap,
            )
        )
    return tuple(eyes)
