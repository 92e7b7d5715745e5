"""What the map says comes out as messages; run by ``colcon test``, where ROS is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2 with stairmap_msgs built")

from stairmap.drop import Drop
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap_ros.messages import make_header
from stairmap_ros.navigation_messages import make_cloud, make_drop_array, make_mask

HEADER = make_header("map", 3_000_000_007)


def test_a_drop_keeps_its_place_depth_and_stamps() -> None:
    drop = Drop(
        id=3,
        edge=np.array([[1.0, 0.5, 0.1], [1.0, -0.5, 0.1]]),
        depth=0.8,
        num_observations=5,
        first_seen_ns=1_000_000_000,
        last_seen_ns=2_000_000_005,
    )
    message = make_drop_array([drop], HEADER)
    (told,) = message.drops
    assert message.header.frame_id == "map"
    assert (told.left.y, told.right.y, told.depth) == (0.5, -0.5, 0.8)
    assert (told.stairway, told.last_seen.sec, told.last_seen.nanosec) == (0, 2, 5)
    (void,) = make_drop_array([replace(drop, depth=None)], HEADER).drops
    assert math.isnan(void.depth)


def test_a_mask_keeps_cells_origin_and_height() -> None:
    grid = OccupancyGrid(
        cells=np.array([[0, 100, 0], [0, 0, 100]], dtype=np.int8), resolution=0.05, origin=(-1.0, 2.0)
    )
    message = make_mask(grid, 3.1, HEADER)
    assert (message.info.width, message.info.height) == (3, 2)
    assert list(message.data) == [0, 100, 0, 0, 0, 100]
    origin = message.info.origin.position
    assert (origin.x, origin.y, origin.z) == (-1.0, 2.0, 3.1)


def test_a_cloud_holds_its_points() -> None:
    message = make_cloud(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), HEADER)
    assert (message.width, message.point_step, len(message.data)) == (2, 12, 24)
    np.testing.assert_array_equal(
        np.frombuffer(message.data, dtype=np.float32), np.arange(1, 7, dtype=np.float32)
    )
