"""Windows of sweeps in the node's map; no ROS in here."""

from __future__ import annotations

import numpy as np

from ideal_observations import assert_is_flight, make_flight, observe, poses_before
from stairmap.arrays import Transform
from stairmap.config import Config
from stairmap.detection.observation import Detection
from stairmap_ros.live_map import LiveMap
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
        live.take_points(seen(pose, START_NS + index), pose, np.eye(4))
    assert [stamp for _, stamp in published] == [START_NS + index for index in range(len(POSES))]
    assert published[-1][0] == 1
