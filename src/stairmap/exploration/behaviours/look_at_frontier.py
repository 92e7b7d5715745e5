"""Face a frontier that was reached; what was in view and stays unknown is not looked at again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np
from py_trees.common import Status

from stairmap.arrays import Mask, Points
from stairmap.exploration.behaviours.base import MissionBehaviour
from stairmap.exploration.behaviours.drive import frontier_left
from stairmap.exploration.candidates import nearest_open
from stairmap.exploration.sight import are_in_view
from stairmap.exploration.tasks import Task
from stairmap.navigation.floors import FloorError
from stairmap.navigation.occupancy import OCCUPIED

SETTLED_RADIUS = 0.15
"""Around each cell of the frontier nothing is looked at again, m."""

ARRIVED = 0.6
"""From farther off nothing is said of a frontier that stays unknown, m."""

ALWAYS_SETTLED = 0.5
"""What lies so near to the place that was looked at counts as seen, m: no look is in vain twice."""

STEEPEST = math.radians(42)
"""A camera that looks across an edge less steeply may not see the stairs that lead down there, rad."""

MIN_NEARER = 0.15
"""For less the robot does not go nearer, m."""

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
        seen = np.linalg.norm(task.cells - task.target, axis=1) < ALWAYS_SETTLED
        for is_tilted in (False, True):
            if frontier_left(mission, task.cells) < SEEN_SHARE:
                break
            yield from self._face(task, is_tilted=is_tilted)
            seen |= self._are_in_view(task)
        if frontier_left(mission, task.cells) >= SEEN_SHARE:
            way = self._way_nearer(task)
            if way is not None:
                yield from self.carry_out(partial(mission.pilot.drive, way))
                yield from self._face(task, is_tilted=True)
                seen |= self._are_in_view(task)
        if frontier_left(mission, task.cells) >= SEEN_SHARE and mission.known.level is not None:
            mission.known.level.map.settle(task.cells[seen], SETTLED_RADIUS)
        mission.task = None
        yield Status.SUCCESS

    def _face(self, task: Task, *, is_tilted: bool) -> Iterator[Status]:
        """Turn to the frontier and take a frame."""
        pilot, pose = self.mission.pilot, self.mission.known.pose
        heading = math.atan2(task.target[1] - pose.y, task.target[0] - pose.x)
        yield from self.carry_out(partial(pilot.turn, heading))
        yield from self.carry_out(partial(pilot.look, is_tilted=is_tilted, is_fine=False))

    def _way_nearer(self, task: Task) -> Points | None:
        """Return the way to where the camera looks down steeply enough upon stairs beyond an edge.

        ``None`` where the robot stands near enough, or cannot come nearer.
        """
        known = self.mission.known
        assert known.level is not None
        apart = math.dist((known.pose.x, known.pose.y), task.target)
        if apart < known.body.mount.camera_height / math.tan(STEEPEST):
            return None
        try:
            search = known.search(known.level)
        except FloorError:
            return None
        spot = nearest_open(search, task.target, apart - MIN_NEARER, task.target)
        return None if spot is None else search.way_to(spot[0])

    def _are_in_view(self, task: Task) -> Mask:
        """Tell which cells of the task's frontier the camera looks at now."""
        known = self.mission.known
        assert known.level is not None
        grid = known.level.map.grid()
        return are_in_view(grid, grid.cells == OCCUPIED, known.pose, known.half_view, task.cells)
