"""What counts as a task: stairs beside stairs that are known."""

from __future__ import annotations

import math

import numpy as np
from small_worlds import SPOT, stairs

from stairmap.exploration.candidates import is_on_link
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.odometry import Planar

BESIDE = np.array([4.0, 2.6])
"""Half a metre behind the last nosing, where a flight may begin that turns off the landing."""


def test_stairs_of_another_heading_beside_the_end_of_a_flight_are_looked_at():
    _, stairway = stairs()
    known = ExplorationMap(SPOT, Planar(x=4.1, y=2.0, z=0.9, heading=0.0))
    level, _ = known.enter_level()
    known.stairs.update([stairway], known.levels)
    assert is_on_link(known, level, BESIDE, 0.1)
    assert is_on_link(known, level, BESIDE)
    assert not is_on_link(known, level, BESIDE, math.pi / 2)
    assert not is_on_link(known, level, BESIDE, -math.pi)
