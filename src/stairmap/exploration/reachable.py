"""The ground that a robot could reach in a world whose surfaces and stairs are known.

It is what a mission is held to. Places are cells of a grid on each level. From a cell the robot gets to its
neighbours where it can stand, and over every true flight that it can climb.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points
from stairmap.exploration.body import Body
from stairmap.exploration.odometry import Planar
from stairmap.exploration.world import MIN_SUPPORT, World
from stairmap.modeling.landings import top_of
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.standoff import STANDOFF
from stairmap.stairway import Flight

STEP = 0.10
"""Size of a cell, m."""

LEVEL = 0.30
"""Cells nearer together in height than this are one, m."""

NEAR_STAGING = 0.45
"""A flight is entered from a cell so near to its staging place, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReachableGround:
    """Cells that a robot can reach.

    Attributes
    ----------
    places
        (N, 3) middles of the cells on the ground, m, map.
    flights
        Numbers of the true flights that it can use, in the order given.
    """

    places: Points
    flights: tuple[int, ...]

    @property
    def area_m2(self) -> float:
        """Area of all cells, m²."""
        return len(self.places) * STEP**2

    def heights(self, min_area: float = 6.0) -> list[float]:
        """Return the heights of the levels that hold at least so much ground, m."""
        z = np.round(self.places[:, 2] / LEVEL)
        return [
            float(np.median(self.places[z == value, 2]))
            for value in np.unique(z)
            if np.count_nonzero(z == value) * STEP**2 >= min_area
        ]


def find_reachable_ground(
    world: World, body: Body, start: Planar, flights: Sequence[Flight]
) -> ReachableGround:
    """Return what a robot can reach from a start; flights that it can climb are in ``flights``.

    The robot's middle keeps its radius and its clearance from obstacles, as its planner does.
    """
    seen: set[tuple[int, int, int]] = set()
    found: list[Float64Array] = []
    used: set[int] = set()
    border = np.array([[start.x, start.y, start.z]])
    ends = _ends(flights, body.profile)
    while len(border):
        border = _new_cells(border, seen)
        border = border[_can_stand(world, body, border)] if len(border) else border
        found.append(border)
        jumps = []
        for number, near, far in ends:
            if len(border) and number not in used:
                apart = np.abs(border - near)
                hits = (np.hypot(apart[:, 0], apart[:, 1]) < NEAR_STAGING) & (apart[:, 2] < LEVEL)
                if hits.any():
                    used.add(number)
                    jumps.append(far)
        steps = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]) * STEP
        border = (border[:, None] + steps).reshape(-1, 3)
        if jumps:
            around = np.stack(np.meshgrid(*[np.arange(-3, 4) * STEP] * 2), axis=-1).reshape(-1, 2)
            spots = np.concatenate(
                [jump + np.column_stack([around, np.zeros(len(around))]) for jump in jumps]
            )
            border = np.concatenate([border, spots])
    return ReachableGround(places=np.concatenate(found), flights=tuple(sorted(used)))


def is_climbable(flight: Flight, profile: RobotProfile) -> bool:
    """Tell whether the true measures of a flight keep all limits of a robot that were published."""
    limits = (
        (profile.max_continuous_rise, flight.rise), (profile.max_pitch_deg, np.degrees(flight.pitch)),
    )  # fmt: skip
    if any(limit is not None and value > limit + 1e-4 for limit, value in limits):
        return False
    if profile.min_run is not None and flight.run < profile.min_run - 1e-4:
        return False
    return profile.min_width is None or flight.width >= profile.min_width


def _ends(flights: Sequence[Flight], profile: RobotProfile) -> list[tuple[int, Float64Array, Float64Array]]:
    found = []
    for number, flight in enumerate(flights):
        if not is_climbable(flight, profile):
            continue
        low = flight.base - STANDOFF * flight.forward
        high = top_of(flight) + STANDOFF * flight.forward
        found += [(number, low, high), (number, high, low)]
    return found


def _new_cells(places: Points, seen: set[tuple[int, int, int]]) -> Points:
    """Return the middles of those cells that were not seen before, and note them."""
    cells = np.floor(places[:, :2] / STEP).astype(int)
    kept = []
    for (x, y), z in zip(cells.tolist(), places[:, 2].tolist(), strict=True):
        key = (x, y, round(z / LEVEL))
        if key not in seen:
            seen.add(key)
            kept.append(((x + 0.5) * STEP, (y + 0.5) * STEP, z))
    return np.array(kept).reshape(-1, 3)


def _can_stand(world: World, body: Body, places: Points) -> Mask:
    """Tell where a robot can stand; moves the places to the ground."""
    offsets = np.array([[0, 0, 0], *[(np.cos(a), np.sin(a), 0) for a in np.arange(8) * np.pi / 4]])
    feet = (places[:, None] + 0.8 * body.radius * offsets).reshape(-1, 3)
    heights = world.ground(feet).reshape(len(places), -1)
    has_ground = np.isfinite(heights)
    is_good = has_ground.mean(axis=1) >= MIN_SUPPORT
    with np.errstate(all="ignore"):
        middle = np.where(is_good, np.nanmedian(np.where(is_good[:, None], heights, 0.0), axis=1), 0.0)
    places[is_good, 2] = middle[is_good]
    index = np.flatnonzero(is_good)
    if len(index):
        is_good[index[world.are_blocked(places[index], body)]] = False
    return np.asarray(is_good)
