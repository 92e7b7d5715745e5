"""What a frame shows of the ground, and the map that many of them make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_worlds import SPOT, robot_in, room_with

from stairmap.exploration.body import load_body
from stairmap.exploration.layer_map import MAX_SLIT, RESOLUTION, LayerMap
from stairmap.exploration.odometry import Planar
from stairmap.exploration.open_ground import find_open_ground
from stairmap.exploration.scans import DROP, FLOOR, HIGH, OBSTACLE, Scan, scan_from_view
from stairmap.navigation.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from stairmap.simulation.rooms import make_railing
from stairmap.simulation.storeys import make_slab
from stairmap.simulation.triangle_mesh import joined

ORIGIN = Planar(x=0.0, y=0.0, z=0.0, heading=0.0)


def scan_of(points, kind):
    points = np.asarray(points, dtype=np.float32).reshape(-1, 3)
    return Scan(stamp_ns=1, points=points, kinds=np.full(len(points), kind, dtype=np.int8))


def patch(x0, x1, y0, y1, z=0.0):
    x, y = np.meshgrid(np.arange(x0, x1, RESOLUTION / 2), np.arange(y0, y1, RESOLUTION / 2))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


def value(grid, x, y):
    return grid.value_at((x, y))


def test_a_scan_tells_floor_obstacle_and_drop_apart():
    mesh = room_with(([3.0, 1.0, 0.0], [3.4, 1.6, 0.5]))
    scan = scan_from_view(robot_in(mesh, 1.5, 1.3).look(), top=0.85)
    ahead = scan.points[(np.abs(scan.points[:, 1]) < 0.2) & (scan.kinds == OBSTACLE)]
    assert ahead[:, 0].min() == pytest.approx(1.5, abs=0.05)
    assert np.abs(scan.points[scan.kinds == FLOOR][:, 2]).max() <= 0.11
    assert (scan.kinds == HIGH).any()
    assert not (scan.kinds == DROP).any()


def test_ground_too_near_to_be_seen_counts_as_seen_where_floor_follows_it():
    scan = scan_from_view(robot_in(room_with(), 1.5, 2.0).look(), top=0.85)
    near = scan.points[np.hypot(scan.points[:, 0], scan.points[:, 1]) < 0.4]
    assert len(near) > 20
    edge = robot_in(make_slab((0.0, 0.0, 2.0, 4.0), 0.0), 1.5, 2.0)
    beyond = scan_from_view(edge.look(), top=0.85)
    assert not (beyond.points[:, 0] > 0.5).any()


def test_a_low_camera_that_looks_down_upon_ground_within_its_shortest_range_sees_no_obstacle_there():
    robot = robot_in(room_with(), 1.5, 2.0, body=load_body("wheeled"))
    scan = scan_from_view(robot.look(is_tilted=True), top=0.6)
    near = np.hypot(scan.points[:, 0], scan.points[:, 1]) < 1.0
    assert not (scan.kinds[near] == OBSTACLE).any()
    wall = scan_from_view(robot_in(room_with(), 0.4, 2.0, 180.0).look(), top=0.6)
    assert (wall.kinds[np.hypot(wall.points[:, 0], wall.points[:, 1]) < 0.6] == OBSTACLE).any()


def test_pixels_between_bars_and_wall_are_no_obstacles():
    mesh = joined([room_with(), make_railing((3.0, 0.5), (3.0, 3.5), 0.0)])
    robot = robot_in(mesh, 1.5, 2.0)
    scans = [scan_from_view(robot.look(), top=0.85) for _ in range(4)]
    points = np.concatenate([scan.points[scan.kinds == OBSTACLE] for scan in scans])
    at_bars = np.abs(points[:, 0] - 1.5) < 0.1
    behind = (points[:, 0] > 1.8) & (points[:, 0] < 3.9) & (np.abs(points[:, 1]) < 1.0)
    assert at_bars.sum() > 100
    assert behind.sum() < 0.05 * at_bars.sum()


def test_a_scan_moves_with_the_pose_of_its_robot():
    scan = scan_of([[1.0, 0.0, 0.1]], OBSTACLE)
    placed = scan.placed(Planar(x=2.0, y=3.0, z=1.0, heading=np.pi / 2))
    assert placed[0] == pytest.approx([2.0, 4.0, 1.1], abs=1e-6)


def test_an_obstacle_takes_two_frames_and_unknown_stays_unknown():
    layer = LayerMap(0.0)
    layer.add(scan_of(patch(0.5, 2.0, -0.5, 0.5), FLOOR), ORIGIN, radius=0.25)
    layer.add(scan_of(patch(1.0, 1.2, -0.2, 0.2, 0.4), OBSTACLE), ORIGIN, radius=0.25)
    assert value(layer.grid(), 1.1, 0.0) == FREE
    layer.add(scan_of(patch(1.0, 1.2, -0.2, 0.2, 0.4), OBSTACLE), ORIGIN, radius=0.25)
    assert value(layer.grid(), 1.1, 0.0) == OCCUPIED
    assert value(layer.grid(), 1.7, 0.0) == FREE
    assert value(layer.grid(), 1.7, 1.2) in (UNKNOWN, None)
    assert layer.tops.max() == pytest.approx(0.4, abs=1e-6)


def test_a_drop_is_occupied_but_a_slit_is_none():
    layer = LayerMap(0.0)
    layer.add(scan_of(patch(0.3, 3.0, -0.6, 0.6), FLOOR), ORIGIN, radius=0.25)
    slit = (MAX_SLIT - 1.5) * RESOLUTION
    for _ in range(2):
        layer.add(scan_of(patch(1.0, 1.0 + slit, -0.5, 0.5, -1.0), DROP), ORIGIN, radius=0.25)
        layer.add(scan_of(patch(2.0, 2.6, -0.5, 0.5, -1.0), DROP), ORIGIN, radius=0.25)
    assert value(layer.grid(), 2.3, 0.0) == OCCUPIED
    assert value(layer.grid(), 1.02, 0.0) == FREE
    assert layer.drops().any()


def test_what_stopped_the_robot_is_an_obstacle_whatever_was_seen_before():
    layer = LayerMap(0.0)
    for _ in range(9):
        layer.add(scan_of(patch(0.3, 2.0, -0.5, 0.5), FLOOR), ORIGIN, radius=0.25)
    before = layer.trail.sum()
    layer.block(np.array([[0.3, 0.02]]))
    assert layer.trail.sum() < before
    layer.block(np.array([[1.02, 0.02]]))
    assert value(layer.grid(), 1.02, 0.02) == OCCUPIED
    assert value(layer.grid(), 1.5, 0.02) == FREE


def test_what_stopped_the_robot_is_forgiven_and_where_it_stood_since_nothing_is():
    layer = LayerMap(0.0)
    for _ in range(9):
        layer.add(scan_of(patch(0.3, 2.0, -0.5, 0.5), FLOOR), ORIGIN, radius=0.25)
    before = layer.trail.sum()
    assert not layer.forgive()
    layer.block(np.array([[0.3, 0.02], [1.52, 0.02]]))
    far = Planar(x=-30.0, y=40.0, z=0.0, heading=0.0)
    layer.add(scan_of(patch(0.5, 1.5, -0.5, 0.5), FLOOR), far, radius=0.25)
    assert value(layer.grid(), 1.52, 0.02) == OCCUPIED
    layer.add(scan_of(patch(2.0, 2.2, -0.5, 0.5), FLOOR), replace(ORIGIN, x=0.3), radius=0.2)
    assert value(layer.grid(), 0.32, 0.02) == FREE
    changes = layer.num_changes
    assert layer.forgive()
    assert layer.num_changes > changes
    assert value(layer.grid(), 1.52, 0.02) == FREE
    assert layer.trail.sum() > before
    assert not layer.forgive()


def test_a_map_of_nothing_is_unknown():
    layer = LayerMap(0.0)
    assert (layer.grid().cells == UNKNOWN).all()
    assert not layer.drops().any()


def test_a_map_grows_and_keeps_what_it_has():
    layer = LayerMap(0.0)
    layer.add(scan_of(patch(0.5, 1.5, -0.5, 0.5), FLOOR), ORIGIN, radius=0.25)
    layer.settle(np.array([[1.0, 0.0]]), 0.1)
    before = layer.settled.sum()
    far = Planar(x=-30.0, y=40.0, z=0.0, heading=0.0)
    layer.add(scan_of(patch(0.5, 1.5, -0.5, 0.5), FLOOR), far, radius=0.25)
    assert value(layer.grid(), 1.0, 0.0) == FREE
    assert value(layer.grid(), -29.0, 40.0) == FREE
    assert layer.settled.sum() == before


def test_open_ground_keeps_clear_of_obstacles_and_of_unknown_but_not_of_the_robots_own_way():
    cells = np.full((60, 60), FREE, dtype=np.int8)
    cells[:, :10] = UNKNOWN
    cells[:, 50:] = OCCUPIED
    grid = OccupancyGrid(cells=cells, resolution=0.05, origin=(0.0, 0.0))
    trail = np.zeros((60, 60), dtype=bool)
    found = find_open_ground(grid, trail, SPOT)
    centers = found.centers(*np.nonzero(found.cells == FREE))
    assert centers[:, 0].min() == pytest.approx(0.5 + 0.2, abs=0.11)
    assert centers[:, 0].max() == pytest.approx(2.5 - SPOT.radius - SPOT.clearance, abs=0.11)
    trail[10:50, 44:56] = True
    again = find_open_ground(grid, trail, SPOT)
    assert (again.cells == FREE).sum() > (found.cells == FREE).sum()


@pytest.mark.parametrize(("side", "is_kept"), [(7, False), (11, True)])
def test_a_spot_where_the_robot_was_is_no_place_to_start_from_beside_larger_ground(side, is_kept):
    cells = np.full((60, 60), OCCUPIED, dtype=np.int8)
    cells[:, :20] = FREE
    grid = OccupancyGrid(cells=cells, resolution=0.05, origin=(0.0, 0.0))
    trail = np.zeros((60, 60), dtype=bool)
    # Of what the body covered its middle was where it reached half its width in every direction.
    margin = round(SPOT.radius / 0.05) - 1
    trail[
        30 - margin - side // 2 : 31 + margin + side // 2, 40 - margin - side // 2 : 41 + margin + side // 2
    ] = True
    found = find_open_ground(grid, trail, SPOT)
    centers = found.centers(*np.nonzero(found.cells == FREE))
    assert (centers[:, 0] < 1.0).any()
    assert (centers[:, 0] > 1.0).any() == is_kept
    # Where there is nothing else, the spot is what there is.
    alone = OccupancyGrid(cells=np.full_like(cells, OCCUPIED), resolution=0.05, origin=(0.0, 0.0))
    assert (find_open_ground(alone, trail, SPOT).cells == FREE).any()
