from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from stairmap.arrays import Float64Array, Points, Transform, Vector
from stairmap.geometry import (
    angle_between,
    cross,
    fit_plane,
    fit_plane_ransac,
    normalized,
    plane_distances,
    solve_three,
    weighted_median,
    wrapped_angle,
)
from stairmap.transforms import transform_points
from value_strategies import directions, no_deadline, transforms


def points_of_plane(normal: Vector, offset: float, num: int = 60, seed: int = 0) -> Points:
    """Points within about 2 m of the plane's nearest point to the origin."""
    random = np.random.default_rng(seed)
    points = random.uniform(-2, 2, (num, 3))
    return np.asarray(points - (points @ normal + offset)[:, None] * normal)


@pytest.mark.parametrize("vector", [[0.0, 0.0, 0.0], [np.nan, 1.0, 0.0], [np.inf, 0.0, 0.0]])
def test_direction_without_finite_length_is_refused(vector: list[float]) -> None:
    with pytest.raises(ValueError, match="finite length above zero"):
        normalized(vector)


def test_normalized_keeps_the_direction() -> None:
    np.testing.assert_allclose(normalized([3.0, 0.0, -4.0]), [0.6, 0.0, -0.8])


@given(directions(), directions())
def test_cross_is_the_cross_product(first: Vector, second: Vector) -> None:
    np.testing.assert_allclose(cross(first, second), np.cross(first, second), atol=1e-15)


def test_tiny_angles_are_not_rounded_to_zero() -> None:
    assert angle_between([1.0, 0.0, 0.0], [1.0, 1e-9, 0.0]) == pytest.approx(1e-9)


@no_deadline
@given(directions(), st.floats(0, np.pi))
def test_angle_between_a_vector_and_its_rotation_is_the_rotations_angle(vector: Vector, angle: float) -> None:
    other = np.eye(3)[np.argmin(np.abs(vector))]
    axis = normalized(np.cross(vector, other))
    turned = Rotation.from_rotvec(angle * axis).apply(vector)
    assert angle_between(3.0 * vector, 0.5 * turned) == pytest.approx(angle, abs=1e-9)


@no_deadline
@given(st.floats(-100, 100))
def test_wrapped_angle_differs_by_whole_turns(angle: float) -> None:
    wrapped = wrapped_angle(angle)
    assert -np.pi <= wrapped < np.pi
    turns = (angle - wrapped) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_distance_from_a_plane_is_positive_on_the_side_of_its_normal() -> None:
    plane = np.array([0.0, 0.0, 1.0, -2.0])
    np.testing.assert_allclose(
        plane_distances(plane, np.array([[5.0, 5.0, 3.0], [0.0, 0.0, 0.0]])), [1.0, -2.0]
    )


@no_deadline
@given(directions(), st.floats(-5, 5))
def test_plane_through_points_of_a_plane_is_that_plane(normal: Vector, offset: float) -> None:
    assume(abs(normal[2]) > 1e-3)
    plane = fit_plane(points_of_plane(normal, offset))
    assert plane is not None
    sign = np.sign(normal[2])
    np.testing.assert_allclose(plane, np.append(sign * normal, sign * offset), atol=1e-9)


@no_deadline
@given(directions(), transforms())
def test_fitted_plane_moves_with_its_points(normal: Vector, transform: Transform) -> None:
    points = points_of_plane(normal, 0.5) + np.random.default_rng(1).normal(0, 0.01, (60, 3))
    before, after = fit_plane(points), fit_plane(transform_points(transform, points))
    assert before is not None
    assert after is not None
    np.testing.assert_allclose(np.cross(transform[:3, :3] @ before[:3], after[:3]), 0, atol=1e-6)
    np.testing.assert_allclose(
        np.abs(plane_distances(after, transform_points(transform, points))),
        np.abs(plane_distances(before, points)),
        atol=1e-6,
    )


def test_fitted_plane_minimises_distances_and_not_heights() -> None:
    # On a nearly vertical plane a fit of heights would lean over.
    random = np.random.default_rng(0)
    points = points_of_plane(normalized([1.0, 0.0, 0.05]), 0.0, num=500) + random.normal(0, 0.05, (500, 3))
    plane = fit_plane(points)
    assert plane is not None
    assert angle_between(plane[:3], [1.0, 0.0, 0.05]) < np.radians(0.5)


@pytest.mark.parametrize(
    "points",
    [np.empty((0, 3)), np.eye(3)[:2], np.outer(np.arange(9.0), [1.0, 2.0, 3.0]), np.ones((5, 3))],
    ids=["none", "two", "one line", "one place"],
)
def test_points_that_span_no_plane_give_none(points: Float64Array) -> None:
    assert fit_plane(points) is None
    assert fit_plane_ransac(points, tolerance=0.01, seed=0) is None


def scene_with_outliers() -> tuple[Vector, Points]:
    normal = normalized([-0.5, 0.1, 0.8])
    random = np.random.default_rng(3)
    inliers = points_of_plane(normal, 0.4, num=300) + random.normal(0, 0.003, (300, 3))
    outliers = random.uniform(-2, 2, (200, 3))
    return normal, np.concatenate([inliers, outliers])


def test_ransac_finds_the_plane_among_outliers_that_mislead_least_squares() -> None:
    normal, points = scene_with_outliers()
    found, mislead = fit_plane_ransac(points, tolerance=0.015, seed=0), fit_plane(points)
    assert found is not None
    assert mislead is not None
    assert angle_between(found[0][:3], normal) < np.radians(0.3)
    assert angle_between(mislead[:3], normal) > np.radians(1)
    assert found[1][:300].mean() > 0.99


def test_ransac_inliers_are_the_points_within_tolerance_of_the_plane_returned() -> None:
    _, points = scene_with_outliers()
    found = fit_plane_ransac(points, tolerance=0.015, seed=0)
    assert found is not None
    np.testing.assert_array_equal(found[1], np.abs(plane_distances(found[0], points)) <= 0.015)


def test_ransac_gives_the_same_plane_for_the_same_seed() -> None:
    _, points = scene_with_outliers()
    first = fit_plane_ransac(points, tolerance=0.015, seed=5)
    second = fit_plane_ransac(points, tolerance=0.015, seed=5)
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first[0], second[0])


@no_deadline
@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=15).filter(lambda values: len(values) % 2 == 1))
def test_weighted_median_with_equal_weights_is_the_median(values: list[float]) -> None:
    assert weighted_median(np.array(values), np.ones(len(values))) == np.median(values)


@no_deadline
@given(st.lists(st.tuples(st.floats(-1e3, 1e3), st.integers(0, 5)), min_size=1, max_size=10))
def test_weight_counts_as_so_many_equal_values(pairs: list[tuple[float, int]]) -> None:
    repeated = sorted(value for value, weight in pairs for _ in range(weight))
    assume(repeated)
    values, weights = np.array(pairs).T
    assert weighted_median(values, weights) == repeated[(len(repeated) - 1) // 2]


def test_weighted_median_needs_some_weight() -> None:
    with pytest.raises(ValueError, match="positive weight"):
        weighted_median(np.array([1.0, 2.0]), np.zeros(2))


def test_three_points_are_enough_for_a_plane_with_outliers_or_without() -> None:
    points = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    fitted = fit_plane_ransac(points, tolerance=0.01, seed=1)
    assert fitted is not None
    np.testing.assert_allclose(fitted[0], [0.0, 0.0, 1.0, -1.0], atol=1e-12)
    assert fitted[1].all()
    assert fit_plane_ransac(points[:2], tolerance=0.01, seed=1) is None


@given(st.integers(0, 2**32 - 1))
def test_three_equations_are_solved_as_numpy_does(seed: int) -> None:
    random = np.random.default_rng(seed)
    square, right = random.normal(size=(3, 3)), random.normal(size=3)
    matrix = square @ square.T + 0.5 * np.eye(3) + 0.1 * np.triu(square)
    assert solve_three(matrix, right) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-9, abs=1e-9)
