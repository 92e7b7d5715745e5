"""Look at what may be stairs from near, at full resolution, and down an edge with the camera tilted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour

SIDES = (0.0, math.radians(15), math.radians(-15))
"""Headings of the frames of a look, beside the target, rad: three make a stairway."""


class LookAtStairs(MissionBehaviour):
    """Take frames of the task's target."""

    def steps(self) -> Iterator[Status]:
        """Turn to it and look, from straight ahead and a little aside."""
        mission = self.mission
        task = mission.task
        if task is None or task.kind != "look":
            yield Status.FAILURE
            return
        pose = mission.known.pose
        heading = math.atan2(task.target[1] - pose.y, task.target[0] - pose.x)
        is_tilted = not task.is_up or "down" in task.reason or "descending" in task.reason
        for side in SIDES:
            yield from self.carry_out(partial(mission.pilot.turn, heading + side))
            yield from self.carry_out(lambda: mission.pilot.look(is_tilted=is_tilted, is_fine=True))
        mission.known.note_look(task.level, task.target)
        if task.link is not None:
            link = mission.known.stairs.link(task.link)
            if link is not None:
                link.looks[task.level] = link.looks.get(task.level, 0) + 1
        mission.note("looked", target=[round(float(v), 2) for v in task.target], reason=task.reason)
        mission.task = None
        yield Status.SUCCESS
