"""All tasks that a robot could do next on the level where it is."""

from __future__ import annotations

import math

import cv2
import numpy as np

from stairmap.arrays import Float64Array
from stairmap.exploration.frontiers import find_frontiers_with_gain
from stairmap.exploration.known_building import KnownBuilding
from stairmap.exploration.level_search import LevelSearch
from stairmap.exploration.levels import Level
from stairmap.exploration.low_steps import find_low_steps
from stairmap.exploration.open_ends import find_open_ends
from stairmap.exploration.sight import are_in_sight
from stairmap.exploration.stair_links import UNEXPLORED, Link
from stairmap.exploration.tasks import Task
from stairmap.geometry import wrapped_angle
from stairmap.navigation.portals import StagingPose

FLOOR_GAIN = 60.0
"""Ground that is expected on a floor that nobody saw, m²: a storey of a house."""

LOOK_GAIN = 6.0
"""What a look at possible stairs is worth, m²: one in ten shows a floor."""

MIN_GAIN = 0.3
"""A frontier that may show less is none, m²."""

MAX_LOOKS = 2
"""So often the robot looks at the same place for stairs."""

MIN_DROP_AREA = 0.3
"""A smaller hole is no stairway, m²."""

DROP_PART = 2.0
"""A long edge is looked at in parts of this length, m."""

LOOK_REACH = 1.2
"""A drop is looked into from ground at most so far from what was seen of it, m."""

LOOK_DISTANCE = 1.8
"""Distance from the first riser at which stairs that go up are looked at, m: camera and steps fit."""

OTHER_HEADING = math.radians(45)
"""Stairs whose headings differ by more are not the same, rad: flights turn by 90 or 180 deg."""

STAGING_REACH, STAGING_ASIDE = 0.5, 0.10
"""A flight is also entered from so far off its staging pose, m, and from so far off the middle of a narrow
one."""

EDGE_DISTANCE = 0.7
"""Distance from the last nosing at which stairs that go down are looked at, m."""


def find_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    """Return what the robot could do on its level, stairs from it included."""
    return [
        *_frontier_tasks(level, search),
        *_drop_tasks(known, level, search),
        *_tentative_tasks(known, level, search),
        *_low_step_tasks(known, level, search),
        *_open_end_tasks(known, level, search),
        *_stair_tasks(known, level, search),
    ]


def _frontier_tasks(level: Level, search: LevelSearch) -> list[Task]:
    found = find_frontiers_with_gain(search.grid, level.map.settled, search.open_ground, search.costs)
    return [
        Task(
            kind="frontier",
            level=level.number,
            position=frontier.position,
            target=frontier.target,
            cost=frontier.cost,
            gain=frontier.gain,
            size=frontier.size,
            cells=frontier.cells,
        )
        for frontier in found
        if frontier.gain >= MIN_GAIN
    ]


def _drop_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    """Looks into holes: stairs may lead down there."""
    drops = level.map.drops()
    num, labels, stats, _ = cv2.connectedComponentsWithStats(drops.astype(np.uint8), connectivity=8)
    tasks = []
    for label in range(1, num):
        if stats[label, cv2.CC_STAT_AREA] * search.grid.resolution**2 < MIN_DROP_AREA:
            continue
        cells = np.argwhere(labels == label)
        points = search.grid.centers(cells[:, 0], cells[:, 1])
        parts = np.unique(np.floor(points / DROP_PART).astype(int), axis=0, return_inverse=True)[1]
        for part in range(int(parts.max()) + 1):
            middle = np.median(points[parts.reshape(-1) == part], axis=0)
            if known.num_looks(level.number, middle) >= 1 or is_on_link(known, level, middle):
                continue
            spot = nearest_open(search, middle, LOOK_REACH + DROP_PART / 2, middle)
            if spot is None:
                continue
            position, cost = spot
            tasks.append(
                Task(
                    kind="look", level=level.number, position=position, target=middle, cost=cost,
                    gain=LOOK_GAIN, reason="a drop: stairs may lead down",
                )
            )  # fmt: skip
    return tasks


def _tentative_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    """Looks at what single frames took for stairs and no stairway came of."""
    tasks = []
    for sighting in known.sightings(level.number):
        if is_on_link(known, level, sighting.place[:2], sighting.heading):
            continue
        if known.num_looks(level.number, sighting.place[:2]) >= MAX_LOOKS:
            continue
        forward = np.array([math.cos(sighting.heading), math.sin(sighting.heading)])
        shift = -LOOK_DISTANCE if sighting.view == "ascending" else EDGE_DISTANCE
        target = sighting.place[:2]
        spot = nearest_open(search, target + shift * forward, LOOK_REACH, target)
        if spot is None:
            continue
        position, cost = spot
        tasks.append(
            Task(
                kind="look", level=level.number, position=position, target=sighting.place[:2], cost=cost,
                gain=LOOK_GAIN, reason=f"may be stairs, {sighting.view}: seen in too few frames",
            )
        )  # fmt: skip
    return tasks


def _low_step_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    """Looks from the front at what may be the lowest treads of stairs.

    Where a single one was seen, a frame from the front that showed no stairs settles it.
    """
    tasks = []
    for steps in find_low_steps(search.grid, level.map.tops):
        if is_on_link(known, level, steps.place, steps.heading) or known.num_looks(level.number, steps.place):
            continue
        if steps.num_seen == 1 and known.was_faced(level, steps.place, steps.heading):
            continue
        reason = "two low steps one behind the other" if steps.num_seen > 1 else "may be a lowest step"
        forward = np.array([math.cos(steps.heading), math.sin(steps.heading)])
        spot = nearest_open(search, steps.place - LOOK_DISTANCE * forward, LOOK_REACH, steps.place)
        if spot is None:
            continue
        position, cost = spot
        tasks.append(
            Task(
                kind="look", level=level.number, position=position, target=steps.place, cost=cost,
                gain=LOOK_GAIN, reason=reason,
            )
        )  # fmt: skip
    return tasks


def _open_end_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    """Looks at the ends of modelled flights that nobody saw, where they would meet this level."""
    tasks = []
    for end in find_open_ends(known.stairs.links, level):
        if end.link.looks.get(level.number, 0) >= MAX_LOOKS:
            continue
        shift = -LOOK_DISTANCE if end.is_up else EDGE_DISTANCE
        spot = nearest_open(search, end.place + shift * end.link.flight.forward[:2], LOOK_REACH, end.place)
        if spot is None:
            continue
        position, cost = spot
        side = "lower" if end.is_up else "upper"
        tasks.append(
            Task(
                kind="look", level=level.number, position=position, target=end.place, cost=cost,
                gain=LOOK_GAIN, link=end.link.number, is_up=end.is_up,
                reason=f"the {side} end of stairs was not seen: {end.unseen:.2f} m are missing",
            )
        )  # fmt: skip
    return tasks


def _stair_tasks(known: KnownBuilding, level: Level, search: LevelSearch) -> list[Task]:
    tasks = []
    for link in known.stairs.links:
        for near, far, pose, climb, is_up in (
            (link.lower, link.upper, link.portal.lower, link.portal.cost_up, True),
            (link.upper, link.lower, link.portal.upper, link.portal.cost_down, False),
        ):
            if near != level.number or link.state != "open":
                continue
            if far < UNEXPLORED and not _leads_to_unknown(known, link, far, is_up=is_up):
                continue
            spot = staging_spot(search, link, pose, known.body.radius)
            if spot is None:
                continue
            position, cost = spot
            reason = f"{link.portal.verdict}, P {link.probability:.2f}"
            if link.is_climbable:
                tasks.append(
                    Task(
                        kind="stairs", level=level.number, position=position,
                        target=link.flight.base[:2], cost=cost + climb, gain=FLOOR_GAIN,
                        link=link.number, is_up=is_up, far_level=far, reason=reason,
                    )
                )  # fmt: skip
            elif link.portal.verdict == "unknown" and link.looks.get(near, 0) < MAX_LOOKS:
                tasks.append(
                    Task(
                        kind="look", level=level.number, position=position,
                        target=link.flight.base[:2] if is_up else link.portal.way[-2][:2], cost=cost,
                        gain=LOOK_GAIN, link=link.number, is_up=is_up, reason=f"verdict: {reason}",
                    )
                )  # fmt: skip
    return tasks


def staging_spot(
    search: LevelSearch, link: Link, pose: StagingPose, radius: float
) -> tuple[Float64Array, float] | None:
    """Return the (2,) place from which the robot, with a body of a radius, lines up, and the cost to it, s.

    It is the reachable one nearest to a staging pose, before the flight: a map may show something right
    beside the pose, and from a little farther back the robot goes straight to the steps as well.
    ``None`` if there is none.
    """
    costs = search.costs
    rows, columns = np.nonzero(np.isfinite(costs))
    if not len(rows):
        return None
    centers = search.open_ground.centers(rows, columns)
    offsets = centers - pose.position[:2]
    lateral = np.abs(offsets @ link.flight.map_from_flight[:2, 1])
    room = max(link.flight.width / 2 - radius, STAGING_ASIDE)
    apart = np.where(lateral <= room, np.hypot(*offsets.T), np.inf)
    best = int(np.argmin(apart))
    if apart[best] > STAGING_REACH:
        return None
    return centers[best], float(costs[rows[best], columns[best]])


def _leads_to_unknown(known: KnownBuilding, link: Link, far: int, *, is_up: bool) -> bool:
    """Whether a flight to a level that is known ends there on ground that nobody saw."""
    level = known.levels.levels[far]
    pose = link.portal.upper if is_up else link.portal.lower
    return level.map.grid().value_at(pose.position) in (None, -1)


def is_on_link(known: KnownBuilding, level: Level, place: Float64Array, heading: float | None = None) -> bool:
    """Whether a (2,) place is on a flight that is known, or before its ends.

    Stairs that were seen with another heading, rad, are others: on a landing they begin right beside it.
    """
    for link in known.stairs.links:
        if level.number not in (link.lower, link.upper):
            continue
        if heading is not None and abs(wrapped_angle(heading - link.flight.heading)) > OTHER_HEADING:
            continue
        offset = place - link.flight.base[:2]
        along = float(offset @ link.flight.forward[:2])
        lateral = float(offset @ link.flight.map_from_flight[:2, 1])
        length = link.flight.num_risers * link.flight.run
        if -0.8 < along < length + 0.8 and abs(lateral) < link.flight.width / 2 + 0.4:
            return True
    return False


def nearest_open(
    search: LevelSearch, place: Float64Array, reach: float, target: Float64Array
) -> tuple[Float64Array, float] | None:
    """Return the reachable open place nearest to a (2,) one within a distance, and the cost to it, s.

    From there nothing hides a (2,) target.
    """
    costs = search.costs
    rows, columns = np.nonzero(np.isfinite(costs))
    centers = search.open_ground.centers(rows, columns)
    apart = np.hypot(*(centers - place).T)
    near = np.flatnonzero(apart < reach)
    near = near[are_in_sight(search.grid, search.opaque, centers[near], target)]
    if not len(near):
        return None
    best = near[np.argmin(apart[near])]
    return centers[best], float(costs[rows[best], columns[best]])
