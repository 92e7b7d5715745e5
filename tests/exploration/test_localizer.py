"""Where the robot is: odometry, pulled right by what it sees."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from small_worlds import DRIFT, SPOT, robot_in, room_with

from stairmap.exploration import localizer as localizer_module
from stairmap.exploration.exploration_map import ExplorationMap
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


def after_a_blind_turn(*, error_deg, blind_frames=4, lost_room=None):
    """Return robot, localizer and what is known of a room, after turns of 20 degrees in which nothing was
    seen and odometry erred; with a ``lost_room`` the robot stands in that one then."""
    mesh = room_with(([1.0, 0.0, 0.0], [1.5, 0.6, 1.0]), ([4.0, 3.0, 0.0], [5.0, 4.0, 1.2]))
    robot = robot_in(mesh, 3.0, 2.0)
    localizer, known = Localizer(robot.pose, is_perfect=False), ScanStore()
    for _ in range(18):
        view = robot.look()
        scan = scan_from_view(view, top=0.85)
        known.add(scan, localizer.correct(scan, robot.pose, known))
        robot.turn(math.radians(20))
    if lost_room is not None:
        robot = robot_in(lost_room, 3.0, 2.0, math.degrees(robot.pose.heading))
    nothing = replace(scan, points=scan.points[:0], kinds=scan.kinds[:0])
    for number in range(blind_frames):
        robot.turn(math.radians(20))
        error = math.radians(error_deg) * (number + 1) / blind_frames
        localizer.correct(nothing, replace(robot.pose, heading=robot.pose.heading + error), known)
    return robot, localizer, known


@pytest.mark.parametrize(("error_deg", "blind_frames"), [(-9.0, 4), (9.0, 4), (14.0, 9), (-13.0, 9)])
def test_after_a_turn_in_which_nothing_was_seen_the_walls_are_found_again(error_deg, blind_frames):
    robot, localizer, known = after_a_blind_turn(error_deg=error_deg, blind_frames=blind_frames)
    scan = scan_from_view(robot.look(), top=0.85)
    odometry = replace(robot.pose, heading=robot.pose.heading + math.radians(error_deg))
    found = localizer.correct(scan, odometry, known)
    assert found.heading == pytest.approx(robot.pose.heading, abs=math.radians(1.5))
    assert found.place[:2] == pytest.approx(robot.pose.place[:2], abs=0.08)
    assert localizer.is_sure


def test_scans_that_fit_nothing_wait_a_while_where_the_heading_is_in_doubt(monkeypatch):
    monkeypatch.setattr(localizer_module, "MAX_UNSURE", 1)
    elsewhere = room_with(([0.5, 3.0, 0.0], [5.5, 3.1, 2.5]))
    robot, localizer, known = after_a_blind_turn(error_deg=9.0, lost_room=elsewhere)
    odometry = replace(robot.pose, heading=robot.pose.heading + math.radians(9.0))
    scan = scan_from_view(robot.look(), top=0.85)
    assert localizer.is_sure
    localizer.correct(scan, odometry, known)
    assert not localizer.is_sure
    localizer.correct(scan, odometry, known)
    assert localizer.is_sure


def test_a_refused_scan_is_kept_where_the_heading_is_known():
    elsewhere = room_with(([4.0, 0.2, 0.0], [4.1, 3.8, 2.5]))
    robot, localizer, known = after_a_blind_turn(error_deg=0.0, blind_frames=0, lost_room=elsewhere)
    before = localizer.num_refused
    localizer.correct(scan_from_view(robot.look(), top=0.85), robot.pose, known)
    assert localizer.num_refused == before + 1
    assert localizer.is_sure


@pytest.mark.parametrize("is_sure", [True, False])
def test_only_scans_that_lie_well_in_the_map_are_kept_to_lay_others_over(monkeypatch, is_sure):
    monkeypatch.setattr(Localizer, "is_sure", property(lambda _: is_sure))
    robot = robot_in(room_with(), 3.0, 2.0)
    known = ExplorationMap(SPOT, robot.pose, has_perfect_odometry=False)
    known.enter_level()
    known.take(robot.look())
    assert bool(len(known.scans)) is is_sure
