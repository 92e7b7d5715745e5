"""Where the robot is: odometry, pulled right by what it sees."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import DRIFT, robot_in, room_with

from stairmap.exploration.localizer import Localizer, ScanStore, thinned
from stairmap.exploration.scans import scan_from_view

pytest.importorskip("small_gicp")


def error_after_a_spin(seed, *, corrected):
    """Return the error of heading after two turns on the spot, rad, of a robot whose odometry drifts."""
    mesh = room_with(([1.0, 0.0, 0.0], [1.5, 0.6, 1.0]), ([4.0, 3.0, 0.0], [5.0, 4.0, 1.2]))
    robot = robot_in(mesh, 3.0, 2.0, model=DRIFT, seed=seed)
    localizer = Localizer(robot.pose, is_perfect=not corrected)
    known = ScanStore()
    for _ in range(36):
        view = robot.look()
        scan = scan_from_view(view, top=0.85)
        known.add(scan, localizer.correct(scan, view.odometry, known))
        robot.turn(math.radians(20))
    believed = localizer.predict(robot.odometry.pose)
    return abs((believed.heading - robot.pose.heading + math.pi) % (2 * math.pi) - math.pi)


def test_a_turn_on_the_spot_is_corrected_by_the_walls():
    seeds = range(4)
    drift = [error_after_a_spin(seed, corrected=False) for seed in seeds]
    assert max(drift) > math.radians(8)
    assert sum(error_after_a_spin(seed, corrected=True) for seed in seeds) < sum(drift) / 3


def test_perfect_odometry_is_taken_as_it_is():
    robot = robot_in(room_with(), 3.0, 2.0)
    localizer = Localizer(robot.pose, is_perfect=True)
    robot.drive(1.0)
    assert localizer.predict(robot.odometry.pose) == robot.odometry.pose


def test_where_nothing_is_seen_odometry_alone_decides():
    robot = robot_in(room_with(), 3.0, 2.0)
    localizer = Localizer(robot.pose, is_perfect=False)
    view = robot.look()
    scan = scan_from_view(view, top=0.85)
    robot.drive(0.5)
    found = localizer.correct(scan, robot.odometry.pose, ScanStore())
    assert np.hypot(found.x - robot.pose.x, found.y - robot.pose.y) < 1e-6


def test_scans_of_one_spot_are_kept_once_so_that_memory_grows_with_the_area():
    robot = robot_in(room_with(), 3.0, 2.0)
    scan = scan_from_view(robot.look(), top=0.85)
    store = ScanStore()
    for _ in range(50):
        store.add(scan, robot.pose)
    assert len(store) == 1
    robot.drive(1.0)
    store.add(scan, robot.pose)
    assert len(store) == 2


def test_points_of_a_scan_are_averaged_so_that_walls_stay_where_they_are():
    wall = np.column_stack([np.full(4000, 1.03), np.linspace(0, 2, 4000), np.linspace(0.2, 1.4, 4000)])
    found = thinned(wall)
    assert len(found) < 60
    assert np.allclose(found[:, 0], 1.03)
