"""Climbing riser by riser: up, down, and back where it cannot go on; and links that stay themselves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, room_with, stairs

from stairmap.exploration.climber import Climber
from stairmap.exploration.exploration_map import ExplorationMap
from stairmap.exploration.layer_map import LayerMap
from stairmap.exploration.levels import LevelBook
from stairmap.exploration.simulated_pilot import SimulatedPilot
from stairmap.exploration.stair_links import MIN_PROBABILITY, StairBook
from stairmap.navigation.robot_profile import load_robot
from stairmap.simulation.triangle_mesh import joined, make_block


def prepared(mesh, stairway, *, is_up=True, body=SPOT):
    top = stairway.flights[0]
    x = 1.4 if is_up else 2.0 + (top.num_risers - 1) * top.run + 0.6
    z = 0.0 if is_up else top.num_risers * top.rise
    robot = robot_in(mesh, x, 2.0, 0.0 if is_up else 180.0, z=z, body=body)
    known = ExplorationMap(body, robot.pose)
    known.stairs.update([stairway], known.levels)
    return robot, known, Climber(robot, known, known.stairs.links[0], is_up=is_up)


def carried_out(climber):
    for _ in range(200):
        progress = climber.poll()
        if progress.state != "running":
            return progress
    raise AssertionError("the climb does not end")


@pytest.mark.parametrize("is_up", [True, False])
def test_every_riser_is_felt_and_the_robot_ends_on_the_floor_beyond(is_up):
    mesh, stairway = stairs()
    robot, _, climber = prepared(mesh, stairway, is_up=is_up)
    assert carried_out(climber).state == "done"
    assert len(climber.risers) == 6
    assert np.abs(climber.risers) == pytest.approx(0.15, abs=1e-3)
    assert robot.pose.z == pytest.approx(0.9 if is_up else 0.0, abs=1e-3)
    assert robot.counters.falls == robot.counters.collisions == 0


def test_risers_above_the_limit_turn_the_robot_back_to_where_it_began():
    mesh, stairway = stairs(rise=0.21, run=0.28, num_risers=8)
    robot, _, climber = prepared(mesh, stairway)
    progress = carried_out(climber)
    assert progress.state == "failed"
    assert "above the robot's limit of 0.178 m" in progress.reason
    assert robot.pose.x == pytest.approx(1.4, abs=0.02)
    assert robot.pose.z == pytest.approx(0.0, abs=1e-3)


def test_after_a_climb_that_failed_the_robot_believes_to_be_where_it_began():
    mesh, stairway = stairs(rise=0.21, run=0.28, num_risers=8)
    robot, known, _ = prepared(mesh, stairway)
    pilot = SimulatedPilot(robot, known, robot.sensor)
    pilot.climb(known.stairs.links[0], is_up=True)
    assert carried_out(pilot).state == "failed"
    assert len(known.poses) > 0
    assert known.pose.z == pytest.approx(0.0, abs=1e-3)
    assert known.enter_level()[0].height == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("aside", [0.5, -0.5])
def test_whoever_believes_the_middle_elsewhere_does_not_run_into_the_wall_beside_the_stairs(aside):
    mesh, stairway = stairs()
    low, high = sorted((2.0 + np.sign(aside) * 0.61, 2.0 + np.sign(aside) * 0.81))
    wall = make_block([1.0, low, 0.0], [3.5, high, 2.0])
    robot, known, _ = prepared(joined([mesh, wall]), stairway)
    moved = dataclasses.replace(
        stairway.flights[0], base=stairway.flights[0].base + np.array([0.0, aside, 0.0])
    )
    known.stairs.update([dataclasses.replace(stairway, flights=(moved,))], known.levels)
    assert carried_out(Climber(robot, known, known.stairs.links[0], is_up=True)).state == "done"
    assert robot.counters.collisions == robot.counters.falls == 0


def test_what_stands_right_beside_the_body_on_the_stairs_ends_the_climb_before_it_is_touched():
    mesh, stairway = stairs()
    post = make_block([2.7, 2.0 + 0.95 * SPOT.radius, 0.0], [3.4, 2.6, 2.5])
    robot, _, climber = prepared(joined([mesh, post]), stairway)
    progress = carried_out(climber)
    assert progress.state == "failed"
    assert "right beside the body" in progress.reason
    assert robot.counters.collisions == robot.counters.falls == 0
    assert robot.counters.sensor_stops > 0


def test_stairs_that_are_not_there_end_the_climb():
    _, stairway = stairs()
    robot = robot_in(room_with(), 1.4, 2.0)
    known = ExplorationMap(SPOT, robot.pose)
    known.stairs.update([stairway], known.levels)
    progress = carried_out(Climber(robot, known, known.stairs.links[0], is_up=True))
    assert progress.state == "failed"
    assert robot.counters.falls == 0


def test_a_link_keeps_its_number_when_its_flight_grows():
    _, stairway = stairs()
    flight = stairway.flights[0]
    book, levels = StairBook(SPOT.profile), LevelBook(LayerMap)
    levels.enter(0.0)
    book.update([stairway], levels)
    grown = dataclasses.replace(flight, num_risers=9, base=flight.base + np.array([0.03, 0.05, 0.0]))
    book.update([dataclasses.replace(stairway, flights=(grown,))], levels)
    assert [link.number for link in book.links] == [1]
    assert book.links[0].flight.num_risers == 9
    other = dataclasses.replace(flight, base=flight.base + np.array([0.0, 4.0, 0.0]))
    book.update([dataclasses.replace(stairway, flights=(grown, other))], levels)
    assert [link.number for link in book.links] == [1, 2]


def test_risers_that_are_too_high_close_stairs_and_other_failures_only_the_second_time():
    _, stairway = stairs()
    for reason, num in (("a riser of 0.4 m is above the robot's single step of 0.3 m", 1), ("slipped", 2)):
        book = StairBook(SPOT.profile)
        book.update([stairway], LevelBook(LayerMap))
        link = book.links[0]
        for _ in range(num):
            assert link.is_climbable
            link.note_failure(reason)
        assert not link.is_climbable


def test_a_link_that_nobody_sees_any_more_is_forgotten_unless_it_was_climbed():
    _, stairway = stairs()
    book, levels = StairBook(SPOT.profile), LevelBook(LayerMap)
    book.update([stairway], levels)
    book.update([], levels)
    assert not book.links
    book.update([stairway], levels)
    book.links[0].state = "climbed"
    book.update([], levels)
    assert len(book.links) == 1


@pytest.mark.parametrize(
    ("rise", "robot", "allow", "expected"),
    [
        (0.15, "spot", False, True),
        (0.21, "spot", False, False),
        (0.21, "spot", True, False),
        (0.177, "spot", False, True),
        (0.183, "spot", False, False),
        (0.15, "anymal", False, False),
        (0.15, "anymal", True, True),
    ],
)
def test_what_is_climbed_follows_from_verdict_and_probability(rise, robot, allow, expected):
    _, stairway = stairs(rise=rise)
    book = StairBook(load_robot(robot), allow_unknown=allow)
    book.update([stairway], LevelBook(LayerMap))
    link = book.links[0]
    assert link.is_climbable is expected, (link.portal.verdict, link.probability, MIN_PROBABILITY)
    link.state = "failed"
    assert not link.is_climbable
