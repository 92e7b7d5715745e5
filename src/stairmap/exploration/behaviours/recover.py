"""After a failure: look where the robot is, so that the next decision knows more."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour


class Recover(MissionBehaviour):
    """Take a frame and forget the task."""

    def steps(self) -> Iterator[Status]:
        """Look."""
        mission = self.mission
        if mission.stopped:
            yield Status.FAILURE
            return
        yield from self.carry_out(lambda: mission.pilot.look(is_tilted=False, is_fine=False))
        mission.task = None
        yield Status.SUCCESS
