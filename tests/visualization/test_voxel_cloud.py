"""A cloud of the map in bounded memory."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.visualization.voxel_cloud import VoxelCloud


def test_each_voxel_keeps_the_first_point_seen_in_it():
    cloud = VoxelCloud(0.1, 100)
    first = cloud.add(np.array([[0.01, 0.01, 0.01], [0.02, 0.02, 0.02], [-0.01, 0.0, 0.0]]))
    again = cloud.add(np.array([[0.03, 0.03, 0.03], [0.35, 0.0, 0.0]]))
    assert sorted(map(tuple, first)) == [(-0.01, 0.0, 0.0), (0.01, 0.01, 0.01)]
    assert again.tolist() == [[0.35, 0.0, 0.0]]
    assert len(cloud.points) == 3


def test_number_of_points_stays_bounded_and_voxels_grow_instead():
    generator = np.random.default_rng(0)
    cloud = VoxelCloud(0.05, 1000)
    for _ in range(20):
        cloud.add(generator.uniform(-10, 10, (2000, 3)))
        assert len(cloud.points) <= 1000
    assert cloud.voxel_size > 0.05
    assert np.ptp(cloud.points, axis=0) == pytest.approx([20, 20, 20], abs=4)


def test_points_that_are_not_finite_are_left_out():
    cloud = VoxelCloud(0.1, 100)
    assert cloud.add(np.array([[np.nan, 0, 0], [0, np.inf, 0], [1, 2, 3]])).tolist() == [[1, 2, 3]]
    assert cloud.add(np.empty((0, 3))).shape == (0, 3)


def test_map_far_from_its_origin_keeps_its_points_apart():
    cloud = VoxelCloud(0.05, 100)
    far = np.array([[30_000.0, -20_000.0, 100.0], [30_000.3, -20_000.0, 100.0]])
    assert len(cloud.add(far)) == 2
