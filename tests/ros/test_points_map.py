"""Windows of sweeps in the node's map; no ROS in here."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import pose_looking
from ideal_observations import assert_is_flight, make_flight, observe, poses_before
from solid_scenes import frame_of
from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap.modeling.landings import top_of
from stairmap.simulation.triangle_mesh import make_rectangle
from stairmap_ros.floor_answers import FloorAnswer, answer_floors, find_current_level
from stairmap_ros.live_map import LiveMap
from stairmap_ros.obstacle_points import obstacle_points
from stairmap_ros.stairway_map import StairwayMap

FLIGHT = make_flight()
POSES = poses_before(FLIGHT, 12)
START_NS = 1_700_000_000_000_000_000


def seen(pose: Transform, stamp_ns: int) -> Detection:
    """What a window of sweeps may show, with the real stamp."""
    observation = observe(FLIGHT, pose, stamp_ns)
    return Detection(stamp_ns=stamp_ns, observations=(observation,), rejections=())


def test_windows_make_a_stairway_with_their_own_stamps() -> None:
    stairway_map = StairwayMap(Config(), method="stairmap", views_per_place=10)
    for index, pose in enumerate(POSES):
        stairway_map.add_points(seen(pose, START_NS + index), pose)
    (stairway,) = stairway_map.stairways()
    assert_is_flight(stairway.flights[0], FLIGHT)
    assert (stairway.first_seen_ns, stairway.last_seen_ns) == (START_NS, START_NS + len(POSES) - 1)
    restored = StairwayMap(Config(), method="stairmap", views_per_place=10)
    restored.restore(stairway_map.snapshot())
    (again,) = restored.stairways()
    assert_is_flight(again.flights[0], FLIGHT)
    assert (again.first_seen_ns, again.num_observations) == (START_NS, stairway.num_observations)


def test_a_place_counts_so_often_and_windows_without_stairs_do_not() -> None:
    stairway_map = StairwayMap(Config(), method="stairmap", views_per_place=4)
    for index in range(9):
        stairway_map.add_points(seen(POSES[0], index), POSES[0])
    assert len(stairway_map.viewpoints) == 4
    nothing = Detection(stamp_ns=99, observations=(), rejections=())
    stairway_map.add_points(nothing, POSES[5])
    assert len(stairway_map.viewpoints) == 4


def test_each_window_is_published_with_its_stamp() -> None:
    published: list[tuple[int, int]] = []
    live = LiveMap(
        lambda: StairwayMap(Config(), method="stairmap", views_per_place=10),
        lambda answer, stamp_ns: published.append((len(answer.stairways), stamp_ns)),
    )
    for index, pose in enumerate(POSES):
        live._map._next_query = 0.0  # on a busy machine, too
        live.take_points(seen(pose, START_NS + index), pose, np.eye(4))
    assert [stamp for _, stamp in published] == [START_NS + index for index in range(len(POSES))]
    assert published[-1][0] == 1


def test_a_robot_with_a_lidar_and_no_camera_is_told_floors_masks_and_obstacles() -> None:
    """It was told the stairs, and that the ground is free all around them."""
    live = LiveMap(
        lambda: StairwayMap(Config(), method="stairmap", views_per_place=10), lambda answer, stamp_ns: None
    )
    for index, pose in enumerate(POSES):
        live.take_points(seen(pose, START_NS + index), pose, None)
        now = live.state()
        points = obstacle_points(now.answer, (), now.detection, now.map_from_camera)
        assert len(points) > 20, "not from the first window on"
    live._map._next_query = 0.0
    now = live.state()
    answer = answer_floors(now.answer, now.way, None, FloorAnswer())
    assert answer.floors is not None
    assert [floor.height for floor in answer.floors.floors] == pytest.approx(
        [FLIGHT.base[2], top_of(FLIGHT)[2]], abs=0.03
    )
    assert find_current_level(answer, now.map_from_camera[:3, 3]) == 0
    for level, ahead in ((0, FLIGHT.base + 0.2 * FLIGHT.forward), (1, top_of(FLIGHT) + 0.2 * FLIGHT.forward)):
        assert answer.masks[level].value_at(ahead) == 100


def test_a_lidar_beside_a_camera_does_not_move_the_floors_also_after_a_restart() -> None:
    stairway_map = StairwayMap(Config(), method="stairmap", views_per_place=10)
    ground = make_rectangle((-8, -4), (8, 4), 0.0)
    for index in range(6):
        pose = pose_looking((-5.0 + 0.2 * index, 0.0, 0.5), down=0.4)
        image = frame_of([ground], pose, has_up=False)
        frame = stairway_map.frame(image.depth, image.camera)
        stairway_map.add(frame, stairway_map.detect(frame, pose), index, pose)
    for index, pose in enumerate(POSES):
        stairway_map.add_points(seen(pose, START_NS + index), pose)
    restored = StairwayMap(Config(), method="stairmap", views_per_place=10)
    restored.restore(stairway_map.snapshot())
    for each in (stairway_map, restored):
        assert each.trajectory is not None
        assert each.trajectory.map_from_camera[:, 2, 3] == pytest.approx([0.5] * 6)
