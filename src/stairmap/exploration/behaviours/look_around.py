"""Turn once about on the spot where the robot came to a place that it knows nothing of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from py_trees.common import Status

from stairmap.exploration.behaviours.base import MissionBehaviour

PARTS = 9
"""Headings of a full turn, 40 deg apart: views overlap."""


class LookAround(MissionBehaviour):
    """Look in every direction if the mission asks for it."""

    def steps(self) -> Iterator[Status]:
        """Turn and look."""
        mission = self.mission
        if not mission.must_look_around:
            yield Status.SUCCESS
            return
        if mission.known.level is None:
            level, _ = mission.known.enter_level()
            mission.note("entered level", level=level.number, height=round(level.height, 3))
        start = mission.known.pose.heading
        yield from self.carry_out(lambda: mission.pilot.look(is_tilted=False, is_fine=False))
        for part in range(1, PARTS + 1):
            heading = start + part * 2 * math.pi / PARTS
            yield from self.carry_out(partial(mission.pilot.turn, heading))
        mission.must_look_around = False
        yield Status.SUCCESS
