"""Tasks on other levels that the robot knows, with the way there over stairs that it can use."""

from __future__ import annotations

from dataclasses import replace

from stairmap.arrays import Float64Array
from stairmap.exploration.candidates import FLOOR_GAIN, find_tasks, staging_spot
from stairmap.exploration.known_building import KnownBuilding
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.levels import Level
from stairmap.exploration.stair_links import UNEXPLORED, Link
from stairmap.exploration.tasks import Task
from stairmap.navigation.floors import FloorError

MIN_GAIN = 2.0
"""For less the robot does not come back over stairs, m²."""


def find_tasks_elsewhere(known: KnownBuilding, search: LevelSearch) -> list[Task]:
    """Return, for each way off this level, the best of what lies beyond it, as a task to use that flight.

    Its cost is that of all the way there; its gain that of what is to be done there.
    """
    best: dict[tuple[int, bool], Task] = {}
    todo: list[tuple[float, LevelSearch, Task | None]] = [(0.0, search, None)]
    done = {search.level}
    while todo:
        todo.sort(key=lambda item: item[0])
        begun, here, first = todo.pop(0)
        for link in known.stairs.links:
            hop = _hop(known, link, here)
            if hop is None or hop[1] in done:
                continue
            cost, far, is_up = begun + hop[0], hop[1], hop[2]
            step = first or _task(link, here.level, hop[3], is_up=is_up, far=far, cost=cost)
            level = known.levels.levels[far]
            pose = link.portal.upper if is_up else link.portal.lower
            try:
                there = known.search_elsewhere(level, pose.position[:2])
            except FloorError:
                continue
            done.add(far)
            for task in tasks_there(known, level, there):
                if task.gain < MIN_GAIN:
                    continue
                key = (step.link or 0, step.is_up)
                total = cost + task.cost
                found = best.get(key)
                if found is None or total - task.gain < found.cost - found.gain:
                    best[key] = replace(
                        step, cost=total, gain=task.gain, reason=f"{task.kind} on level {far}"
                    )
            todo.append((cost, there, step))
    return list(best.values())


def tasks_there(known: KnownBuilding, level: Level, there: LevelSearch) -> list[Task]:
    """Return the tasks of a level where the robot is not; they are kept as long as its search."""
    kept = known.tasks_elsewhere.get(level.number)
    if kept is None or kept[0] is not there:
        kept = (there, find_tasks(known, level, there))
        known.tasks_elsewhere[level.number] = kept
    return kept[1]


def _hop(known: KnownBuilding, link: Link, here: LevelSearch) -> tuple[float, int, bool, Float64Array] | None:
    """Return the cost of a flight from this level to another that is known, that one, whether it is up, and
    the (2,) place where the robot lines up."""
    if not link.is_climbable or max(link.lower, link.upper) >= UNEXPLORED:
        return None
    if here.level not in (link.lower, link.upper):
        return None
    is_up = here.level == link.lower
    pose = link.portal.lower if is_up else link.portal.upper
    spot = staging_spot(here, link, pose, known.body.radius)
    if spot is None:
        return None
    climb = link.portal.cost_up if is_up else link.portal.cost_down
    return spot[1] + climb, link.upper if is_up else link.lower, is_up, spot[0]


def _task(link: Link, level: int, position: Float64Array, *, is_up: bool, far: int, cost: float) -> Task:
    return Task(
        kind="stairs", level=level, position=position, target=link.flight.base[:2], cost=cost,
        gain=FLOOR_GAIN, link=link.number, is_up=is_up, far_level=far,
    )  # fmt: skip
