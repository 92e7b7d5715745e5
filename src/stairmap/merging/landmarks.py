"""Flights as landmarks: when two may be the same one, and what that says of how two maps lie to each other.

Maps are level, so that a turn about the vertical and a shift lead from one to another. One flight gives all
four numbers: its heading, and the place of a step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Transform
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, transform_from_parts, transform_points

SIGMAS = 3.0
"""Two measures of one thing differ by less, in standard deviations of their difference ..."""

RISE_MARGIN, RUN_MARGIN, WIDTH_MARGIN = 0.003, 0.005, 0.06
"""... and by what is not in these, m: worn steps, finishes, ends that a rail hides."""

HEADING_MARGIN = math.radians(4)
"""Headings of one flight in two aligned maps differ by no more beyond that, rad: maps bend."""

PLACE_MARGIN = 0.30
"""Places of one flight in two aligned maps differ by no more beyond that, m: maps drift."""

MIN_SHARED_RISERS = 2
"""Flights of which ends are open may be shifted by whole steps as long as this many risers stay common."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A flight as one run measured it.

    Attributes
    ----------
    run
        Number of the run.
    stairway_id, flight_index
        Where it is in that run.
    flight
        The flight, in the map of that run.
    num_observations
        Of its stairway.
    """

    run: int
    stairway_id: int
    flight_index: int
    flight: Flight
    num_observations: int


def may_be_same(first: Flight, second: Flight) -> bool:
    """Tell whether two flights have the same dimensions, as far as both were measured."""
    if not _agree(first.rise, second.rise, first.std.rise, second.std.rise, RISE_MARGIN):
        return False
    if not _agree(first.run, second.run, first.std.run, second.std.run, RUN_MARGIN):
        return False
    if not _agree(first.width, second.width, first.std.width, second.std.width, WIDTH_MARGIN):
        # A width of which an end was not seen is a lower bound.
        narrow = min(first, second, key=lambda flight: flight.width)
        if narrow.left_bounded and narrow.right_bounded:
            return False
    are_closed = is_closed(first) and is_closed(second)
    return not are_closed or first.num_risers == second.num_risers


def is_closed(flight: Flight) -> bool:
    """Whether both ends of a flight were seen, so that all its risers are counted."""
    return bool(flight.bottom_seen) and bool(flight.top_seen)


def _agree(first: float, second: float, first_std: float, second_std: float, margin: float) -> bool:
    std = math.hypot(*(value if math.isfinite(value) else 0.0 for value in (first_std, second_std)))
    return abs(first - second) <= margin + SIGMAS * std


def step_shifts(first: Flight, second: Flight) -> Iterator[int]:
    """Yield how many steps higher in the first flight the foot of the second may be.

    0 where both feet were seen, or what puts one top on the other where both tops were; else whatever leaves
    ``MIN_SHARED_RISERS`` in common and no seen end inside of the other flight.
    """
    for shift in range(MIN_SHARED_RISERS - second.num_risers, first.num_risers - MIN_SHARED_RISERS + 1):
        below, above = shift, shift + second.num_risers - first.num_risers
        if (first.bottom_seen and below < 0) or (second.bottom_seen and below > 0):
            continue
        if (first.top_seen and above > 0) or (second.top_seen and above < 0):
            continue
        yield shift


def first_from_second(first: Flight, second: Flight, shift: int) -> Transform:
    """Return the (4, 4) level transform that puts the second flight on the first, ``shift`` steps up.

    Sideways, centre lies on centre, or seen end on seen end where one alone was seen by both.
    """
    turn = wrapped_angle(first.heading - second.heading)
    cos, sin = math.cos(turn), math.sin(turn)
    rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    local = np.array([shift * first.run, sideways_shift(first, second), shift * first.rise])
    target = transform_points(first.map_from_flight, local)
    return transform_from_parts(rotation, target - rotation @ second.base)


def sideways_shift(first: Flight, second: Flight) -> float:
    """How far left of the first flight's centre line that of the second one lies, m."""
    half = (first.width - second.width) / 2
    has_left = first.left_bounded and second.left_bounded
    has_right = first.right_bounded and second.right_bounded
    return 0.0 if has_left == has_right else half if has_left else -half


def lies_on(first: Flight, second: Flight, first_from_second_map: Transform) -> int | None:
    """Return how many steps higher in the first flight the second one's foot is; ``None``: it is another one.

    Parameters
    ----------
    first, second
        In their own maps.
    first_from_second_map
        (4, 4) level transform between the maps.
    """
    if not may_be_same(first, second):
        return None
    turn = math.atan2(first_from_second_map[1, 0], first_from_second_map[0, 0])
    off = abs(wrapped_angle(second.heading + turn - first.heading))
    if off > HEADING_MARGIN + SIGMAS * _std(first.std.heading, second.std.heading):
        return None
    flight_from_map = invert_transform(first.map_from_flight) @ first_from_second_map
    x, y, z = transform_points(flight_from_map, second.base).tolist()
    shift = round((x / first.run + z / first.rise) / 2)
    if shift not in step_shifts(first, second):
        return None
    margin = PLACE_MARGIN + SIGMAS * _std(*first.std.base[:2].tolist(), *second.std.base[:2].tolist())
    is_there = math.hypot(x - shift * first.run, z - shift * first.rise) <= margin
    return shift if is_there and abs(y - sideways_shift(first, second)) <= margin else None


def _std(*values: float) -> float:
    return math.hypot(*(value if math.isfinite(value) else 0.0 for value in values))
