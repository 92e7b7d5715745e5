"""Whether a mission with nothing left tries again where something stopped it."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, room_with

from stairmap.exploration.behaviours.decide import Decide
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.mission import DONE_REASON, MAX_RETRIES, Mission
from stairmap.exploration.simulated_pilot import SimulatedPilot
from stairmap.exploration.tasks import Task

pytest.importorskip("py_trees")


def mission_in_a_room():
    """Return a mission of a robot on a level of which it saw one frame."""
    robot = robot_in(room_with(), 3.0, 2.0)
    known = ExplorationMap(SPOT, robot.pose)
    known.enter_level()
    known.take(robot.look())
    pilot = SimulatedPilot(robot, known, robot.sensor)
    return Mission(known=known, pilot=pilot, clock=lambda: 0.0, must_look_around=False)


def task_of(kind):
    """Return a task of a kind, all at one place."""
    return Task(kind=kind, level=0, position=np.zeros(2), target=np.ones(2), cost=1.0, gain=1.0)


def test_with_nothing_left_what_stopped_the_robot_is_forgotten_and_looked_at_again():
    mission = mission_in_a_room()
    for kind in ("frontier", "stairs"):
        for _ in range(8):
            mission.fail(task_of(kind), "something stands in the way")
    mission.known.level.map.block(np.array([[3.9, 2.0]]))
    assert not mission.is_open(task_of("frontier"))
    assert mission.try_again()
    assert mission.must_look_around
    assert mission.is_open(task_of("frontier"))
    assert not mission.is_open(task_of("stairs"))
    assert not mission.try_again()


def test_it_tries_a_few_times_only():
    mission = mission_in_a_room()
    for _ in range(MAX_RETRIES):
        mission.known.level.map.block(np.array([[3.9, 2.0]]))
        assert mission.try_again()
    mission.known.level.map.block(np.array([[3.9, 2.0]]))
    assert not mission.try_again()


def test_a_mission_ends_only_where_nothing_stopped_it(monkeypatch):
    mission = mission_in_a_room()
    monkeypatch.setattr(Mission, "is_open", lambda *_: False)
    mission.known.level.map.block(np.array([[3.9, 2.0]]))
    list(Decide(mission).steps())
    assert not mission.stopped
    list(Decide(mission).steps())
    assert mission.stopped == DONE_REASON
