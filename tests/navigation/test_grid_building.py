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


def level_frame(*heights, camera_height=2.5):
    """Return depth of a level surface seen from straight above: its columns have these heights in turn."""
    depth = np.empty((KINECT_CAMERA.height, KINECT_CAMERA.width), dtype=np.float32)
    for columns, height in zip(
        np.array_split(np.arange(KINECT_CAMERA.width), len(heights)), heights, strict=True
    ):
        depth[:, columns] = camera_height - height
    return DepthFrame(stamp_ns=0, depth=depth, camera=KINECT_CAMERA)


def looking_down(height=2.5, x=0.0, y=0.0):
    """Return the pose of a camera that looks straight down; the image's right is the map's +x."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = x, y, height
    return pose


HIGH = FloorStack(floors=(Floor(level=0, height=0.0, is_explored=True),), levels={}, camera_height=2.5)


def value_of(heights, at=(0.4, 0.4), floors=HIGH):
    """Return the value of a cell after level surfaces of these heights were seen, one after the other."""
    builder = GridBuilder(floors)
    for height in heights:
        builder.add(level_frame(height), looking_down())
    return builder.grids()[0].value_at(at)


@pytest.mark.parametrize(
    ("height", "value"),
    [
        (0.0, 0), (0.06, 0), (-0.06, 0), (0.08, -1), (-0.08, -1), (0.10, -1), (0.12, 100), (1.19, 100),
        (1.21, -1), (-0.14, -1), (-0.16, 100),
    ],
)  # fmt: skip
def test_a_height_above_the_floor_is_floor_obstacle_hole_or_nothing(height, value):
    """Floor to 0.07 m either way, obstacle from 0.11 to 1.2 m, hole below 0.15 m."""
    assert value_of([height] * 3, at=(0.3, 0.3)) == value


@pytest.mark.parametrize(("camera_height", "value"), [(3.95, 0), (4.0, 0), (4.05, None)])
def test_what_is_farther_than_4_m_is_not_taken_in(camera_height, value):
    floors = FloorStack(floors=HIGH.floors, levels={}, camera_height=camera_height)
    builder = GridBuilder(floors)
    builder.add(level_frame(0.0, camera_height=camera_height), looking_down(camera_height))
    assert builder.grids()[0].value_at((1.0, 1.0)) == value


@pytest.mark.parametrize(("foot", "is_taken"), [(0.28, True), (-0.28, True), (0.32, False), (-0.32, False)])
def test_a_frame_is_of_a_floor_when_its_foot_is_within_0_3_m_of_it(foot, is_taken):
    builder = GridBuilder(HIGH)
    builder.add(level_frame(0.0, camera_height=2.5 + foot), looking_down(2.5 + foot))
    if is_taken:
        assert builder.grids()[0].value_at((0.4, 0.4)) == 0
    else:
        with pytest.raises(MapError):
            builder.grids()


def test_a_frame_belongs_to_the_floor_that_is_nearest_to_its_foot():
    floors = tuple(Floor(level=level, height=0.4 * level, is_explored=True) for level in (-1, 0, 1))
    builder = GridBuilder(FloorStack(floors=floors, levels={}, camera_height=2.5))
    builder.add(level_frame(0.4, camera_height=2.75), looking_down(2.75))
    builder.add(level_frame(-0.4, camera_height=2.0), looking_down(2.0))
    grids = builder.grids()
    assert list(grids) == [-1, 1]
    assert grids[1].value_at((0.4, 0.4)) == 0


@pytest.mark.parametrize(("num_frames", "value"), [(1, -1), (2, 100)])
def test_one_frame_alone_makes_no_obstacle(num_frames, value):
    assert value_of([0.5] * num_frames) == value


@pytest.mark.parametrize(("num_floor", "value"), [(6, 100), (7, 0)])
def test_an_obstacle_is_seen_in_three_of_ten_frames_that_saw_floor(num_floor, value):
    """Two of six are more than 0.3, two of seven less."""
    assert value_of([0.5, 0.5] + [0.0] * num_floor) == value


def test_left_and_right_and_near_and_far_are_where_the_camera_saw_them():
    """Floor at the image's left, an obstacle at its right; the camera stands away from the origin."""
    builder = GridBuilder(HIGH)
    for _ in range(2):
        builder.add(level_frame(0.0, 0.5), looking_down(x=3.0, y=-7.0))
    grid = builder.grids()[0]
    assert (grid.value_at((2.5, -7.5)), grid.value_at((3.5, -7.5))) == (0, 100)
    # 4:3: what is 0.9 m to the side is seen, what is 1.2 m to the front or back is not.
    assert grid.value_at((2.1, -7.0)) == 0
    assert grid.value_at((2.6, -6.0)) == 0
    assert grid.value_at((2.6, -5.7)) in (None, -1)
    assert grid.value_at((2.6, -8.3)) in (None, -1)


def test_each_pixel_counts_alone_as_only_every_fourth_is_looked_at():
    """A cell of 0.05 m is 5 px wide from 2.5 m; gaps of up to 5 cells are closed, larger ones are not."""
    for num_pixels, value in ((16, 0), (60, -1)):
        frame = level_frame(0.0)
        depth = frame.depth.copy()
        depth[:, 60 : 60 + num_pixels] = np.nan
        builder = GridBuilder(HIGH)
        builder.add(DepthFrame(stamp_ns=0, depth=depth, camera=KINECT_CAMERA), looking_down())
        x = (60 + num_pixels / 2 - 159.5) / 262.5 * 2.5
        assert builder.grids()[0].value_at((x, 0.5)) == value


def test_the_ground_within_a_quarter_of_a_metre_of_the_robot_is_free_and_the_map_ends_three_cells_beyond():
    empty = np.full((KINECT_CAMERA.height, KINECT_CAMERA.width), np.nan, dtype=np.float32)
    builder = GridBuilder(FLOORS, resolution=0.05)
    pose = pose_looking([1.025, -2.025, 0.9], yaw=0.0)
    builder.add(DepthFrame(stamp_ns=0, depth=empty, camera=KINECT_CAMERA), pose)
    grid = builder.grids()[0]
    assert grid.resolution == 0.05
    assert grid.cells.shape == (17, 17)
    assert grid.origin == pytest.approx((0.60, -2.45))
    rows, columns = np.nonzero(grid.cells == 0)
    away = np.abs(grid.centers(rows, columns) - [1.025, -2.025])
    assert away.max(axis=0) == pytest.approx([0.25, 0.25])
    assert grid.value_at((1.025 + 0.24, -2.025 - 0.24)) == -1


def test_a_coarser_map_has_larger_cells_in_the_same_place():
    builder = GridBuilder(HIGH, resolution=0.1)
    builder.add(level_frame(0.0), looking_down(x=3.0, y=-7.0))
    grid = builder.grids()[0]
    assert grid.resolution == 0.1
    assert (grid.value_at((2.1, -7.0)), grid.value_at((3.9, -7.0))) == (0, 0)
