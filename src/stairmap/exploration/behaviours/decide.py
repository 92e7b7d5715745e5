"""Choose the next task; without one the mission ends."""

from __future__ import annotations

import time
from collections.abc import Iterator

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour
from stairmap.exploration.candidates import find_tasks
from stairmap.exploration.decision_log import Decision
from stairmap.exploration.mission import DONE_REASON
from stairmap.exploration.other_levels import find_tasks_elsewhere
from stairmap.exploration.strategies import choose
from stairmap.navigation.floors import FloorError

MAX_STUCK = 3
"""So often the robot looks around anew where its map says that it cannot be."""


class Decide(MissionBehaviour):
    """Choose what to do next."""

    def steps(self) -> Iterator[Status]:
        """Gather the tasks and choose one."""
        mission, known = self.mission, self.mission.known
        assert known.level is not None
        mission.on_rest(False)
        begun = time.thread_time()
        known.refresh_stairs()
        try:
            search = known.search(known.level)
        except FloorError as error:
            mission.num_stuck += 1
            mission.must_look_around = True
            if mission.num_stuck > MAX_STUCK:
                mission.stop(f"stuck: {error}")
            yield Status.FAILURE
            return
        tasks = [task for task in find_tasks(known, known.level, search) if mission.is_open(task)]
        chosen = choose(tasks, strategy=mission.strategy)
        if chosen is None or (chosen.kind == "stairs" and mission.strategy != "stairs-ignored"):
            elsewhere = [task for task in find_tasks_elsewhere(known, search) if mission.is_open(task)]
            tasks += elsewhere
            chosen = choose(tasks, strategy=mission.strategy)
        mission.task = chosen
        mission.search = search
        place = (known.pose.x, known.pose.y)
        mission.log.add(
            Decision(
                time_s=mission.clock(),
                level=known.level.number,
                place=place,
                chosen=chosen,
                tasks=tuple(tasks),
                duration_s=time.thread_time() - begun,
            )
        )
        mission.coverage.append((mission.clock(), known.area(), known.level.number))
        if chosen is None:
            if not mission.try_again():
                mission.stop(DONE_REASON)
            yield Status.FAILURE
            return
        yield Status.SUCCESS
