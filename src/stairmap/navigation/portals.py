"""Stairways as a planner sees them: links between two floors at a cost that is high but finite.

A portal (the report's word) has a staging pose at either end, both facing the stairs: before the first
riser, and behind the last nosing. Its cost is in seconds: the time to climb, and a price for the risk.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from stairmap.arrays import Points, Vector, readonly
from stairmap.drop import Drop
from stairmap.modeling.landings import top_of
from stairmap.navigation.carried_stairs import carry_to_floors
from stairmap.navigation.floors import FloorStack
from stairmap.navigation.landing_corners import find_landing_corners
from stairmap.navigation.limits import Verdict
from stairmap.navigation.occupancy import FREE, UNKNOWN, OccupancyGrid
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.standoff import find_room, staging_distance
from stairmap.navigation.traversability import Assessment, assess
from stairmap.stairway import Stairway

WayKind: TypeAlias = Literal["staging", "foot", "top", "corner"]
"""What a point of the way over a stairway is."""

ANY_ROBOT = RobotProfile(
    name="any robot", max_continuous_rise=None, max_single_rise=None, min_run=None, max_pitch_deg=None,
    max_slope_deg=None, body_width=None, side_clearance=None, min_landing_length=None,
)  # fmt: skip
"""A robot of which nothing is known but the default costs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StagingPose:
    """Where a robot lines up: (3,) position on the floor, m, map, and the heading to face the stairs, rad."""

    position: Vector
    heading: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", readonly(self.position))

    def to_dict(self) -> dict[str, Any]:
        """Return the pose as JSON types."""
        return {"position": self.position.tolist(), "heading": self.heading}


@dataclass(frozen=True, slots=True, kw_only=True)
class Portal:
    """A stairway as a link between two floors.

    Attributes
    ----------
    stairway_id
        Which stairway.
    lower_level, upper_level
        The floors that it joins.
    leads_to_unexplored
        Whether one of them was never visited.
    lower, upper
        Staging poses at its ends, facing the stairs.
    way
        (N, 3) points from the lower staging pose over flights and landings to the upper one, m: straight
        lines between them lie on the stairs.
    way_kinds
        (N,) what each point is: ``staging``, ``foot`` or ``top`` of a flight, ``corner`` of a landing.
    length, height
        Length of the way and height gained, m.
    cost_up, cost_down
        What using it costs, s. Finite also for a robot that cannot climb it; ``verdict`` forbids that.
    assessment
        Whether the robot can climb it.
    is_lower_open, is_upper_open
        Whether nobody saw that end, as is held of ends of which nothing is said: the stairs may go on, so its
        staging pose may lie on steps, and length, height and cost are at least what is said.
    notes
        What is wrong with it, such as a staging pose inside an obstacle; one sentence each.
    """

    stairway_id: int
    lower_level: int
    upper_level: int
    leads_to_unexplored: bool
    lower: StagingPose
    upper: StagingPose
    way: Points
    way_kinds: tuple[WayKind, ...]
    length: float
    height: float
    cost_up: float
    cost_down: float
    assessment: Assessment
    is_lower_open: bool = True
    is_upper_open: bool = True
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "way", readonly(self.way))

    @property
    def verdict(self) -> Verdict:
        """Whether the robot can climb it."""
        return self.assessment.verdict

    def to_dict(self) -> dict[str, Any]:
        """Return the portal as JSON types."""
        return {
            "stairway": self.stairway_id,
            "levels": [self.lower_level, self.upper_level],
            "leads_to_unexplored": self.leads_to_unexplored,
            "lower": self.lower.to_dict(),
            "upper": self.upper.to_dict(),
            "length": self.length,
            "height": self.height,
            "cost_up": self.cost_up,
            "cost_down": self.cost_down,
            "verdict": self.verdict,
            "open_ends": {"lower": self.is_lower_open, "upper": self.is_upper_open},
            "notes": list(self.notes),
        }


def make_portal(
    stairway: Stairway, floors: FloorStack, robot: RobotProfile = ANY_ROBOT, drops: Sequence[Drop] = ()
) -> Portal:
    """Return a stairway as a portal for a robot.

    An end that nobody saw is carried on to the floor that the stairs must reach (``carry_to_floors``), and
    its staging pose stands farther off by what is not known.

    ``cost = length / stair_speed + alignment_time · (flights + 1) + risk · height``, with the risk of going
    up or down.
    """
    lower_level, upper_level = floors.levels[stairway.id]
    carried = carry_to_floors(stairway, floors, drops)
    flights = carried.stairway.flights
    first, last = flights[0], flights[-1]
    top = top_of(last)
    off_below, has_room_below = staging_distance(
        find_room(first.base, -first.forward, drops, stairway.id), carried.unknown_below
    )
    off_above, has_room_above = staging_distance(
        find_room(top, last.forward, drops, stairway.id), carried.unknown_above
    )
    begin = first.base - off_below * first.forward
    end = top + off_above * last.forward
    way, way_kinds = _find_way(carried.stairway, begin, end)
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    height = float(top[2] - first.base[2])
    open_ends = {name: floors.has_open_end(stairway.id, upper=name == "upper") for name in ("lower", "upper")}
    time = length / robot.stair_speed + robot.alignment_time * (len(stairway.flights) + 1)
    return Portal(
        stairway_id=stairway.id,
        lower_level=lower_level,
        upper_level=upper_level,
        leads_to_unexplored=not all(floors.floor(level).is_explored for level in (lower_level, upper_level)),
        lower=StagingPose(position=begin, heading=first.heading),
        upper=StagingPose(position=end, heading=_turned(last.heading)),
        way=way,
        way_kinds=way_kinds,
        length=length,
        height=height,
        cost_up=time + robot.ascent_risk * height,
        cost_down=time + robot.descent_risk * height,
        assessment=assess(stairway, robot),
        is_lower_open=open_ends["lower"],
        is_upper_open=open_ends["upper"],
        notes=(
            *(
                f"stairway {stairway.id}: nobody saw its {name} end, it may go on beyond its {name} "
                "staging pose"
                for name, is_open in open_ends.items()
                if is_open
            ),
            *(
                f"stairway {stairway.id}: its {name} staging pose stands near another edge of the ground"
                for name, has_room in (("lower", has_room_below), ("upper", has_room_above))
                if not has_room
            ),
        ),
    )


def _find_way(stairway: Stairway, begin: Vector, end: Vector) -> tuple[Points, tuple[WayKind, ...]]:
    """Way over a stairway from one staging pose to the other, and what its points are."""
    points: list[Vector] = [begin]
    kinds: list[WayKind] = ["staging"]
    for index, flight in enumerate(stairway.flights):
        if index:
            landing = stairway.landings[index - 1] if index <= len(stairway.landings) else None
            corners = find_landing_corners(stairway.flights[index - 1], flight, landing)
            points += corners
            kinds += ["corner"] * len(corners)
        points += [flight.base, top_of(flight)]
        kinds += ["foot", "top"]
    return np.array([*points, end]), (*kinds, "staging")


def make_portals(
    stairways: Sequence[Stairway],
    floors: FloorStack,
    robot: RobotProfile = ANY_ROBOT,
    drops: Sequence[Drop] = (),
) -> tuple[Portal, ...]:
    """Return all stairways as portals for a robot: links between floors with a cost in seconds.

    Parameters
    ----------
    stairways, floors
        Stairways of the map, and the floors that they join; see ``find_floors``.
    robot
        The robot that climbs; its profile gives the verdict and the cost.
    drops
        Edges of the ground, which staging poses keep away from.
    """
    return tuple(make_portal(stairway, floors, robot, drops) for stairway in stairways)


def note_obstacles(portal: Portal, grids: Mapping[int, OccupancyGrid]) -> Portal:
    """Return a portal with a note for each staging pose that does not stand on free ground.

    A portal is kept in any case: a box before the stairs may be gone tomorrow.

    Parameters
    ----------
    portal
        What to look at.
    grids
        Occupancy by level; levels without one are not looked at.
    """
    notes = list(portal.notes)
    for name, level, pose in (
        ("lower", portal.lower_level, portal.lower),
        ("upper", portal.upper_level, portal.upper),
    ):
        if level not in grids:
            continue
        value = grids[level].value_at(pose.position)
        if value == FREE:
            continue
        x, y = pose.position[:2]
        where = {None: "outside of the map", UNKNOWN: "on unknown ground"}.get(value, "inside an obstacle")
        notes.append(
            f"stairway {portal.stairway_id}: its {name} staging pose ({x:.2f}, {y:.2f}) is {where} "
            f"of floor {level}"
        )
    return replace(portal, notes=tuple(notes))


def _turned(heading: float) -> float:
    return heading % (2 * math.pi) - math.pi
