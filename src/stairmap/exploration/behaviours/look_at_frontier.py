"""Face a frontier that was reached; what stays unknown then is not looked at again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour
from stairmap.exploration.behaviours.drive import frontier_left

SETTLED_RADIUS = 0.15
"""Around each cell of the frontier nothing is looked at again, m."""

ARRIVED = 0.6
"""From farther off nothing is said of a frontier that stays unknown, m."""

SEEN_SHARE = 0.1
"""With less left of it a frontier has been seen across."""


class LookAtFrontier(MissionBehaviour):
    """Look across the frontier of the task; where it stays, look down: the floor may end there."""

    def steps(self) -> Iterator[Status]:
        """Turn to it and look, level and tilted."""
        mission = self.mission
        task = mission.task
        if task is None or task.kind != "frontier":
            yield Status.FAILURE
            return
        pose = mission.known.pose
        if math.dist((pose.x, pose.y), task.position) > ARRIVED:
            # Seen on the way: what is left of it is a frontier of its own.
            mission.task = None
            yield Status.SUCCESS
            return
        for is_tilted in (False, True):
            if frontier_left(mission, task.cells) < SEEN_SHARE:
                break
            pose = mission.known.pose
            heading = math.atan2(task.target[1] - pose.y, task.target[0] - pose.x)
            yield from self.carry_out(partial(mission.pilot.turn, heading))
            yield from self.carry_out(partial(mission.pilot.look, is_tilted=is_tilted, is_fine=False))
        if frontier_left(mission, task.cells) >= SEEN_SHARE and mission.known.level is not None:
            mission.known.level.map.settle(task.cells, SETTLED_RADIUS)
        mission.task = None
        yield Status.SUCCESS
