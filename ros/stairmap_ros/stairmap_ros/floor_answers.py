"""Floors, portals and keep-out masks of what the map says, for one robot. No ROS in here."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stairmap.arrays import Vector
from stairmap.navigation.floors import FloorError, FloorStack, find_floors
from stairmap.navigation.keepout import forbidden_ground, make_keepout_mask
from stairmap.navigation.occupancy import UNKNOWN, MapError, OccupancyGrid
from stairmap.navigation.portals import ANY_ROBOT, Portal, make_portals
from stairmap.navigation.robot_profile import RobotProfile
from stairmap.navigation.traversability import assess
from stairmap.trajectory import Trajectory
from stairmap_ros.stairway_map import MapAnswer

ON_FLOOR = 0.4
"""The robot is on a floor if its feet are within this of its height, m; farther off it is on stairs."""

EMPTY_MASK = OccupancyGrid(cells=np.full((1, 1), UNKNOWN, dtype=np.int8), resolution=0.05, origin=(0.0, 0.0))
"""The mask of a floor that nothing forbids: a costmap filter waits until there is one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorAnswer:
    """What a planner is told.

    Attributes
    ----------
    floors
        The floors; ``None`` while nothing tells of any.
    portals
        The stairways as links between them.
    masks
        Keep-out mask of each floor by its level.
    current_level
        The floor that the robot is on, or was on last; ``None`` before.
    """

    floors: FloorStack | None = None
    portals: tuple[Portal, ...] = ()
    masks: dict[int, OccupancyGrid] = field(default_factory=dict)
    current_level: int | None = None


def passable_ids(answer: MapAnswer, robot: RobotProfile | None) -> tuple[int, ...]:
    """Return the ids of the stairways that a robot can climb; none for ``None``, any robot on wheels."""
    if robot is None:
        return ()
    return tuple(
        stairway.id for stairway in answer.stairways if assess(stairway, robot).verdict == "passable"
    )


def answer_floors(
    answer: MapAnswer, way: Trajectory | None, robot: RobotProfile | None, before: FloorAnswer
) -> FloorAnswer:
    """Return floors, portals and masks; floors keep their ids from what was told before.

    Parameters
    ----------
    answer, way
        What the map says, and the poses of its images; ``None`` without any.
    robot
        Whose verdicts count; ``None``: no stairs are passable.
    before
        What was told last.
    """
    if way is None:
        return FloorAnswer()
    try:
        floors = find_floors(answer.stairways, way, camera_height=answer.camera_height, known=before.floors)
        ground = forbidden_ground(answer.stairways, answer.drops, robot)
        masks = {
            floor.level: make_keepout_mask(ground, floors, floor.level) or EMPTY_MASK
            for floor in floors.floors
        }
    except (FloorError, MapError):  # no floor yet, or a localiser that jumps by kilometres
        return before
    portals = make_portals(answer.stairways, floors, robot or ANY_ROBOT, answer.drops)
    return FloorAnswer(floors=floors, portals=portals, masks=masks, current_level=before.current_level)


def find_current_level(answer: FloorAnswer, camera: Vector | None) -> int | None:
    """Return the level of the floor under a camera at (3,) m, map; on stairs, that of before."""
    if answer.floors is None or camera is None or not np.isfinite(answer.floors.camera_height):
        return answer.current_level
    feet = float(camera[2]) - answer.floors.camera_height
    nearest = min(answer.floors.floors, key=lambda floor: abs(floor.height - feet))
    is_known = any(floor.level == answer.current_level for floor in answer.floors.floors)
    if abs(nearest.height - feet) <= ON_FLOOR or not is_known:
        return nearest.level
    return answer.current_level
