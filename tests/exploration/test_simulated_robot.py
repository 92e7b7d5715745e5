"""The simulated robot counts what happens to it, and stands where it can stand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import DRIFT, ROOM, SPOT, robot_in, room_with, stairs

from stairmap.exploration.odometry import Planar, RunningOdometry
from stairmap.exploration.simulated_robot import SENSED_ROOM
from stairmap.exploration.world import STEP_OVER, World
from stairmap.simulation.odometry import PERFECT_ODOMETRY
from stairmap.simulation.storeys import make_slab
from stairmap.simulation.triangle_mesh import joined, make_block


def test_a_wall_is_a_collision_and_the_robot_stands_before_it():
    robot = robot_in(room_with(), 3.0, 2.0)
    assert not robot.drive(5.0)
    assert robot.counters.collisions == 1
    assert robot.pose.x == pytest.approx(6.0 - 0.06 - SPOT.radius, abs=0.06)


def test_what_the_body_passes_over_is_no_collision():
    low = robot_in(room_with(([3.0, 0.0, 0.0], [3.1, 4.0, STEP_OVER - 0.02])), 2.0, 2.0)
    assert low.drive(2.0)
    high = robot_in(room_with(([3.0, 0.0, 0.0], [3.1, 4.0, 0.2])), 2.0, 2.0)
    assert not high.drive(2.0)
    assert (low.counters.collisions, high.counters.collisions) == (0, 1)


def test_a_table_at_the_height_of_the_body_is_a_collision_and_a_shelf_above_it_is_none():
    table = robot_in(room_with(([3.0, 0.0, 0.6], [3.5, 4.0, 0.65])), 2.0, 2.0)
    shelf = robot_in(room_with(([3.0, 0.0, SPOT.top + 0.1], [3.5, 4.0, SPOT.top + 0.15])), 2.0, 2.0)
    assert not table.drive(1.5)
    assert shelf.drive(1.5)


def test_the_edge_of_the_floor_is_a_fall_and_the_robot_stays_on_it():
    robot = robot_in(make_slab(ROOM, 0.0), 5.0, 2.0)
    assert not robot.drive(2.0)
    assert robot.counters.falls == 1
    assert robot.pose.x < 6.0


def test_a_crack_in_the_floor_is_no_fall():
    mesh = joined([make_slab((0.0, 0.0, 3.0, 4.0), 0.0), make_slab((3.15, 0.0, 6.0, 4.0), 0.0)])
    robot = robot_in(mesh, 2.0, 2.0)
    assert robot.drive(2.0)
    assert robot.counters.falls == 0


def test_stairs_are_driven_against_but_climbed():
    mesh, _ = stairs()
    assert not robot_in(mesh, 1.0, 2.0).drive(2.0)
    climber = robot_in(mesh, 1.0, 2.0)
    assert climber.climb(3.5)
    assert climber.pose.z == pytest.approx(0.9, abs=1e-3)
    # Each riser lies within one small step of 0.05 m.
    assert climber.counters.path_m == pytest.approx(3.5 + 6 * (math.hypot(0.05, 0.15) - 0.05), abs=0.02)


def test_feet_feel_the_next_riser_and_the_void():
    mesh, _ = stairs()
    assert robot_in(mesh, 1.9, 2.0).feel(0.15) == pytest.approx(0.15, abs=1e-3)
    assert math.isnan(robot_in(make_slab(ROOM, 0.0), 5.9, 2.0).feel(0.3))


def test_a_foot_does_not_fall_into_a_hair_crack_of_the_mesh():
    mesh = joined([make_block([0, 0, -0.2], [1.0, 1, 0]), make_block([1.001, 0, -0.2], [2, 1, 0])])
    assert World(mesh).foot(np.array([1.0005, 0.5, 0.0]), reach=0.1) == pytest.approx(0.0, abs=1e-4)


def test_odometry_drifts_with_the_way_and_perfect_odometry_does_not():
    perfect, drifting = robot_in(room_with(), 1.0, 2.0), robot_in(room_with(), 1.0, 2.0, model=DRIFT, seed=3)
    for robot in (perfect, drifting):
        robot.drive(4.0)
        robot.turn(1.0)
    assert perfect.odometry.pose.to_row() == pytest.approx(perfect.pose.to_row(), abs=1e-9)
    error = np.abs(drifting.odometry.pose.to_row() - drifting.pose.to_row())
    assert 1e-4 < error[0] < 0.5
    assert 1e-3 < error[3] < 0.5


def test_turning_takes_time_and_no_way():
    robot = robot_in(room_with(), 3.0, 2.0)
    robot.turn(math.pi)
    assert robot.counters.time_s == pytest.approx(math.pi / SPOT.mount.turn_rate)
    assert robot.counters.path_m == 0


def test_its_own_sensors_tell_how_far_it_can_go_before_a_wall_or_an_edge():
    by_wall = robot_in(room_with(), 5.0, 2.0)
    free = by_wall.free_way(1.0)
    assert free == pytest.approx(6.0 - 0.06 - SPOT.radius - 5.0, abs=0.06)
    assert by_wall.drive(free)
    at_edge = robot_in(make_slab(ROOM, 0.0), 5.0, 2.0)
    assert at_edge.drive(at_edge.free_way(2.0))
    assert at_edge.pose.x < 6.0
    for robot in (by_wall, at_edge):
        assert robot.counters.sensor_stops == 1
        assert robot.counters.falls == robot.counters.collisions == 0
    assert robot_in(room_with(), 2.0, 2.0).free_way(1.0) == 1.0


def test_its_sensors_see_a_corner_that_is_thinner_than_the_gaps_between_their_beams():
    y = 2.0 + 0.5 * SPOT.radius
    post = ([3.5013, y - 0.001, 0.0], [3.5033, y + 0.001, 1.0])
    robot = robot_in(room_with(post), 2.0, 2.0)
    free = robot.free_way(2.0)
    assert free < 1.51
    assert robot.drive(free)
    assert robot.counters.collisions == 0


def test_its_sensors_stop_it_a_little_before_a_surface_and_lead_it_on_beside_one():
    wall = 6.0 - 0.06
    start = wall - SPOT.radius - SENSED_ROOM - 0.101
    robot = robot_in(room_with(), start, 2.0)
    assert robot.free_way(0.15) == pytest.approx(0.10)
    beside = robot_in(room_with(), 3.0, 0.06 + SPOT.radius + SENSED_ROOM / 2)
    assert beside.free_way(1.0) == 1.0


def test_what_is_right_beside_the_body_on_stairs_is_sensed_before_it_is_touched():
    y = 2.0 + SPOT.radius
    robot = robot_in(room_with(([2.1, y - 0.01, 0.0], [2.5, y + 0.01, 1.0])), 2.0, 2.0)
    assert robot.is_free_aside(0.05, 0.0)
    assert not robot.is_free_aside(0.15, 0.0)
    assert (robot.counters.sensor_stops, robot.counters.collisions) == (1, 0)
    assert robot.is_free_aside(0.15, -0.02)


def test_a_step_aside_or_backwards_is_no_turn():
    def heading_errors(forward, left):
        start = Planar(x=0.0, y=0.0, z=0.0, heading=0.3)
        found = []
        for seed in range(60):
            odometry = RunningOdometry(start, DRIFT, np.random.default_rng(seed))
            for _ in range(20):
                odometry.move(0.05 * forward, 0.05 * left, 0.0, 0.0)
            found.append(odometry.pose.heading - start.heading)
        return np.std(found)

    ahead = heading_errors(1.0, 0.0)
    assert ahead > 0
    assert heading_errors(0.0, 1.0) == pytest.approx(ahead)
    assert heading_errors(-1.0, 0.0) == pytest.approx(ahead)


def test_perfect_odometry_follows_a_step_aside():
    odometry = RunningOdometry(
        Planar(x=1.0, y=2.0, z=0.0, heading=math.pi / 2), PERFECT_ODOMETRY, np.random.default_rng(0)
    )
    odometry.move(0.3, -0.2, 0.1, 0.15)
    assert odometry.pose.to_row() == pytest.approx((1.2, 2.3, 0.15, math.pi / 2 + 0.1))
