from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stairmap.arrays import Float64Array, Points
from stairmap.delmerico2013.edge_cloud import (
    CLUSTER_RADIUS,
    VOXEL_SIZE,
    downsample,
    find_clusters,
    remove_statistical_outliers,
)
from value_strategies import no_deadline, point_clouds


def random_points(num: int, size: float, seed: int = 0) -> Points:
    return np.random.default_rng(seed).uniform(-size, size, (num, 3))


def clusters_of(labels: Float64Array) -> set[frozenset[int]]:
    return {frozenset(np.flatnonzero(labels == label).tolist()) for label in set(labels.tolist())}


def test_each_voxel_keeps_the_centroid_of_its_points() -> None:
    points = np.array(
        [[0.001, 0.002, 0.003], [0.003, 0.004, 0.009], [0.011, 0.002, 0.003], [-0.001, 0.0, 0.0]]
    )
    expected = [[-0.001, 0.0, 0.0], [0.002, 0.003, 0.006], [0.011, 0.002, 0.003]]
    np.testing.assert_allclose(downsample(points), expected)


def test_downsampling_twice_changes_nothing_more() -> None:
    once = downsample(random_points(2000, 0.05))
    assert len(once) <= 1000
    np.testing.assert_allclose(downsample(once), once)


@no_deadline
@given(point_clouds())
def test_downsampled_points_have_a_voxel_each(points: Points) -> None:
    kept = downsample(points)
    voxels = {tuple(voxel) for voxel in np.floor(points / VOXEL_SIZE).astype(int).tolist()}
    assert len(kept) == len(voxels)


def test_point_far_from_all_others_is_an_outlier() -> None:
    cloud = random_points(300, 0.1)
    kept = remove_statistical_outliers(np.concatenate([cloud, [[2.0, 0.0, 0.0]]]))
    assert kept.max() < 0.1
    assert len(kept) > 200


def test_points_within_a_deviation_of_the_mean_spacing_are_kept() -> None:
    # The corners of a cube are equally far from each other as a set: no spread, no outlier.
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
    assert len(remove_statistical_outliers(corners)) == 8


def test_ends_of_an_edge_are_trimmed_which_is_one_reason_for_narrow_models() -> None:
    # At an end all 50 neighbours lie to one side, so their mean distance is larger than in the middle.
    edge = np.stack([np.arange(200) * 0.01, np.zeros(200), np.zeros(200)], axis=1)
    kept = remove_statistical_outliers(edge)
    assert 0.05 < kept[:, 0].min() < 0.20
    assert 0.05 < edge[-1, 0] - kept[:, 0].max() < 0.20


def test_clouds_of_few_points_are_cleaned_without_trouble() -> None:
    for num in range(4):
        assert len(remove_statistical_outliers(random_points(num, 0.1))) <= num
    assert len(find_clusters(np.empty((0, 2)))) == 0


@no_deadline
@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=1, max_size=40, unique=True))
def test_clusters_are_those_of_single_linkage(cells: list[tuple[int, int]]) -> None:
    # Points 11 mm apart: linked along a row or diagonal, not over a free place between them.
    points = np.array(cells) * 0.011
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    reached = distances <= CLUSTER_RADIUS
    for _ in range(len(points)):
        reached = reached | ((reached.astype(int) @ reached.astype(int)) > 0)
    expected = {frozenset(np.flatnonzero(row).tolist()) for row in reached}
    assert clusters_of(find_clusters(points)) == expected


def test_thousands_of_points_of_one_edge_are_one_cluster() -> None:
    random = np.random.default_rng(0)
    points = np.concatenate([random.normal(0, 0.01, (5000, 2)), random.normal([0.2, 0.1], 0.01, (5000, 2))])
    labels = find_clusters(points)
    sizes = np.sort(np.bincount(labels))
    assert sizes[-2:].min() > 4900
