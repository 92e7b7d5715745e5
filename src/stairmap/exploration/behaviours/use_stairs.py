"""Line up before a flight, look at it once more, climb it, and see where it led."""

from __future__ import annotations

import math
from collections.abc import Iterator

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour
from stairmap.exploration.candidates import find_tasks
from stairmap.exploration.stair_links import Link
from stairmap.exploration.strategies import is_worthwhile
from stairmap.exploration.tasks import Task
from stairmap.navigation.floors import FloorError

MIN_CLIMB = 0.3
"""A climb that gained less height led nowhere, m."""


class UseStairs(MissionBehaviour):
    """Carry out a task of kind ``stairs`` from its staging pose on."""

    def steps(self) -> Iterator[Status]:
        """Face the flight, look, climb, verify."""
        mission, known = self.mission, self.mission.known
        task = mission.task
        if task is None or task.kind != "stairs" or task.link is None:
            yield Status.FAILURE
            return
        link = known.stairs.link(task.link)
        if link is None:
            mission.fail(task, "the stairs are not there any more")
            yield Status.FAILURE
            return
        if self._has_something_nearer():
            mission.note("put off", link=link.number, reason="something on this level was seen on the way")
            mission.task = None
            yield Status.SUCCESS
            return
        yield from self._face(link, task)
        link = known.stairs.link(task.link)
        if link is None or not link.is_climbable:
            reason = "gone" if link is None else f"{link.portal.verdict} after another look"
            mission.fail(task, f"the stairs are {reason}")
            yield Status.FAILURE
            return
        before, near = known.pose.z, known.level
        mission.note("climb", link=link.number, is_up=task.is_up, verdict=link.portal.verdict,
                     probability=list(link.portal.assessment.probability))  # fmt: skip
        known.leave_level()
        yield from self.carry_out(lambda: mission.pilot.climb(link, is_up=task.is_up))
        if self.last.is_stranded:
            mission.fail(task, self.last.reason)
            mission.stop(f"the robot is stranded on stairs: {self.last.reason}")
            yield Status.FAILURE
            return
        if self.last.state == "failed":
            known.enter_level()
            link.note_failure(self.last.reason)
            mission.fail(task, self.last.reason)
            yield Status.FAILURE
            return
        self._verify(link, task, before, near)
        yield Status.SUCCESS

    def _has_something_nearer(self) -> bool:
        """Whether the way to the stairs showed something worthwhile on this level."""
        mission, known = self.mission, self.mission.known
        if mission.strategy != "gain" or known.level is None:
            return False
        known.refresh_stairs()
        try:
            tasks = find_tasks(known, known.level, known.search(known.level))
        except FloorError:
            return False
        return any(task.kind != "stairs" and is_worthwhile(task) and mission.is_open(task) for task in tasks)

    def _face(self, link: Link, task: Task) -> Iterator[Status]:
        mission, known = self.mission, self.mission.known
        heading = link.flight.heading if task.is_up else link.flight.heading + math.pi
        yield from self.carry_out(lambda: mission.pilot.turn(heading))
        yield from self.carry_out(lambda: mission.pilot.look(is_tilted=not task.is_up, is_fine=True))
        yield from self.carry_out(lambda: mission.pilot.look(is_tilted=False, is_fine=True))
        known.refresh_stairs()

    def _verify(self, link: Link, task: Task, before: float, near: object) -> None:
        """See on which level the robot came out, and whether that is where the model said."""
        mission, known = self.mission, self.mission.known
        climbed = known.pose.z - before
        level, is_new = known.enter_level()
        link = known.stairs.link(link.number) or link
        link.state = "climbed"
        end = link.portal.way[-2] if task.is_up else link.portal.way[1]
        mission.stairs_climbed += 1
        mission.must_look_around = True
        mission.task = None
        mission.note(
            "arrived", level=level.number, height=round(known.pose.z, 3), is_new=is_new, link=link.number,
            climbed=round(climbed, 3), difference=round(known.pose.z - float(end[2]), 3),
        )  # fmt: skip
