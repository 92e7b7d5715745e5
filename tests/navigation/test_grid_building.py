"""Maps of floors from depth frames: free floor, stairs as obstacles, holes, floors apart."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import KINECT_CAMERA, AnalyticStairs, pose_looking, render_frame
from stairmap.frame import DepthFrame
from stairmap.navigation.floors import Floor, FloorStack
from stairmap.navigation.grid_building import GridBuilder
from stairmap.navigation.occupancy import MapError

FLOORS = FloorStack(floors=(Floor(level=0, height=0.0, is_explored=True),), levels={}, camera_height=0.9)
STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.2, num_risers=8)


def build(poses, floors=FLOORS, stairs=STAIRS):
    builder = GridBuilder(floors)
    for index, pose in enumerate(poses):
        builder.add(render_frame(stairs, pose, stamp_ns=index, wall_at=4.5), pose)
    return builder


@pytest.fixture(scope="module")
def grid():
    poses = [pose_looking([-2.4 + 0.1 * index, 0.05, 0.9], yaw=0.0, down=0.3) for index in range(6)]
    return build(poses).grids()[0]


def test_the_floor_before_the_stairs_is_free_and_the_stairs_are_occupied(grid):
    assert grid.value_at((-0.5, 0.0)) == 0
    assert grid.value_at((0.5, 0.0)) == 100


def test_where_the_robot_was_is_free_though_the_camera_did_not_see_it(grid):
    assert grid.value_at((-2.2, 0.05)) == 0


def test_what_was_not_seen_is_unknown(grid):
    assert grid.value_at(np.array(grid.origin) + 0.02) == -1


def test_a_point_below_the_floor_is_no_ground_to_drive_on():
    # The same view, taken for one from a floor 0.5 m higher: everything lies in a hole.
    floors = FloorStack(floors=(Floor(level=0, height=0.5, is_explored=True),), levels={}, camera_height=0.4)
    poses = [pose_looking([-2.4, 0.05, 0.9], yaw=0.02 * index, down=0.3) for index in range(4)]
    assert build(poses, floors).grids()[0].value_at((-0.8, 0.0)) == 100


def test_frames_between_floors_are_passed_over():
    pose = pose_looking([-2.4, 0.0, 2.4], yaw=0.0, down=0.3)
    with pytest.raises(MapError, match="no frame was taken on a floor"):
        build([pose]).grids()


def test_frames_without_depth_show_only_where_the_robot_was():
    empty = np.full((KINECT_CAMERA.height, KINECT_CAMERA.width), np.nan, dtype=np.float32)
    pose = pose_looking([0.0, 0.0, 0.9], yaw=0.0, down=0.3)
    builder = GridBuilder(FLOORS)
    builder.add(DepthFrame(stamp_ns=0, depth=empty, camera=KINECT_CAMERA), pose)
    assert builder.grids()[0].value_at((0.0, 0.0)) == 0
