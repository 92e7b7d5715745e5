"""Drive to where the task begins; a frontier that was seen on the way needs no visit any more."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour
from stairmap.exploration.frontiers import frontier_mask

SAME_BORDER = np.ones((5, 5), np.uint8)
"""A border that moved by two cells was not seen across: noise does that."""

SEEN_SHARE = 0.3
"""A frontier of which less than this is left was seen on the way."""


class Drive(MissionBehaviour):
    """Drive to the task's place."""

    def steps(self) -> Iterator[Status]:
        """Follow the way of the last search."""
        mission = self.mission
        task, search = mission.task, mission.search
        assert task is not None and search is not None
        way = search.way_to(task.position)
        if way is None:
            mission.fail(task, "there is no way")
            yield Status.FAILURE
            return
        yield from self.carry_out(lambda: mission.pilot.drive(way), until=self._is_seen)
        if self.last.state == "failed":
            if mission.known.level is not None:
                mission.known.level.map.block(mission.pilot.blocking)
            mission.fail(task, self.last.reason)
            yield Status.FAILURE
            return
        yield Status.SUCCESS

    def _is_seen(self) -> bool:
        task = self.mission.task
        if task is None or task.kind != "frontier":
            return False
        return frontier_left(self.mission, task.cells) < SEEN_SHARE


def frontier_left(mission: object, cells: np.ndarray) -> float:
    """Return which share of (N, 2) cells is still a frontier of the robot's level, or right beside one."""
    level = mission.known.level  # type: ignore[attr-defined]
    grid = level.map.grid()
    mask = cv2.dilate(frontier_mask(grid, level.map.settled).astype(np.uint8), SAME_BORDER) > 0
    index, inside = grid.cells_at(cells)
    index = index[inside]
    return float(mask[index[:, 0], index[:, 1]].sum()) / max(len(cells), 1)
