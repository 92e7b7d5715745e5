from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from stairmap.arrays import Float64Array, Points, Transform, Vector
from stairmap.errors import TrajectoryError
from stairmap.transforms import (
    check_pose,
    find_pose_flaw,
    interpolate_poses,
    invert_transform,
    invert_transforms,
    quat_from_rotation,
    rotation_between,
    rotation_from_quat,
    rotation_from_vector,
    spread_corrections,
    transform_from_parts,
    transform_points,
)
from value_strategies import directions, no_deadline, point_clouds, quaternions, transforms, vectors

QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""About z, x onto y."""


def test_transform_rotates_first_and_then_moves() -> None:
    transform = transform_from_parts(QUARTER_TURN, [10.0, 0.0, 0.0])
    np.testing.assert_allclose(transform_points(transform, np.array([1.0, 2.0, 3.0])), [8.0, 1.0, 3.0])


def test_transform_keeps_the_shape_of_the_points() -> None:
    assert transform_points(np.eye(4), np.zeros((4, 5, 3))).shape == (4, 5, 3)
    assert transform_points(np.eye(4), np.zeros((0, 3))).shape == (0, 3)


@no_deadline
@given(transforms(), point_clouds(min_size=1))
def test_inverse_transform_undoes_the_transform(transform: Transform, points: Points) -> None:
    back = transform_points(invert_transform(transform), transform_points(transform, points))
    np.testing.assert_allclose(back, points, atol=1e-10)


@no_deadline
@given(transforms(), transforms(), point_clouds(min_size=1))
def test_product_of_transforms_is_one_after_the_other(
    first: Transform, second: Transform, points: Points
) -> None:
    np.testing.assert_allclose(
        transform_points(second @ first, points),
        transform_points(second, transform_points(first, points)),
        atol=1e-10,
    )


@no_deadline
@given(quaternions())
def test_rotation_of_a_quaternion_is_the_one_scipy_gives(quat: Float64Array) -> None:
    np.testing.assert_allclose(rotation_from_quat(quat), Rotation.from_quat(quat).as_matrix(), atol=1e-12)


def test_scalar_part_of_a_quaternion_comes_last() -> None:
    half = np.sqrt(0.5)
    np.testing.assert_allclose(rotation_from_quat([0.0, 0.0, half, half]), QUARTER_TURN, atol=1e-15)


def test_quaternion_is_normalised_before_use() -> None:
    np.testing.assert_allclose(rotation_from_quat([0.0, 0.0, 3.0, 3.0]), QUARTER_TURN, atol=1e-15)


def test_many_quaternions_are_turned_at_once() -> None:
    quats = np.array([[[0.0, 0, 0, 1], [0, 0, 1, 1]], [[1, 0, 0, 0], [0, 1, 0, 0]]])
    rotations = rotation_from_quat(quats)
    assert rotations.shape == (2, 2, 3, 3)
    np.testing.assert_allclose(rotations[0, 1], QUARTER_TURN, atol=1e-15)
    np.testing.assert_allclose(rotations[1, 0], np.diag([1.0, -1, -1]), atol=1e-15)


@no_deadline
@given(quaternions())
def test_quaternion_survives_the_way_over_the_matrix_up_to_its_sign(quat: Float64Array) -> None:
    back = quat_from_rotation(rotation_from_quat(quat))
    assert back[3] >= 0
    assert min(np.abs(back - quat).max(), np.abs(back + quat).max()) < 1e-9


@pytest.mark.parametrize("axis", range(3))
def test_half_turn_has_an_exact_quaternion(axis: int) -> None:
    expected = np.zeros(4)
    expected[axis] = 1.0
    diagonal = np.full(3, -1.0)
    diagonal[axis] = 1.0
    np.testing.assert_allclose(np.abs(quat_from_rotation(np.diag(diagonal))), expected, atol=1e-12)


@no_deadline
@given(vectors(limit=6.0))
def test_rotation_of_a_vector_is_the_one_scipy_gives(vector: Vector) -> None:
    expected = Rotation.from_rotvec(vector).as_matrix()
    np.testing.assert_allclose(rotation_from_vector(vector), expected, atol=1e-9)


def test_tiny_rotation_vector_is_not_lost() -> None:
    assert rotation_from_vector([0.0, 0.0, 1e-13])[1, 0] == pytest.approx(1e-13)


@no_deadline
@given(directions(), directions())
def test_rotation_between_takes_one_direction_onto_the_other_by_the_smallest_angle(
    source: Vector, destination: Vector
) -> None:
    rotation = rotation_between(source, destination)
    np.testing.assert_allclose(rotation @ source, destination, atol=1e-9)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    angle = np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))
    assert angle == pytest.approx(np.arccos(np.clip(source @ destination, -1, 1)), abs=1e-6)


@no_deadline
@given(directions())
def test_rotation_between_opposite_directions_is_a_half_turn(source: Vector) -> None:
    rotation = rotation_between(source, -source)
    np.testing.assert_allclose(rotation @ source, -source, atol=1e-9)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@no_deadline
@given(st.lists(transforms(), min_size=2, max_size=5), st.data())
def test_interpolated_poses_are_linear_in_place_and_slerped_in_rotation(
    poses: list[Transform], data: st.DataObject
) -> None:
    gaps = data.draw(st.lists(st.integers(1, 10**9), min_size=len(poses), max_size=len(poses)))
    stamps = 1_700_000_000_000_000_000 + np.cumsum(gaps)
    wanted = np.array([data.draw(st.integers(int(stamps[0]), int(stamps[-1])))])
    since_start, at = (stamps - stamps[0]).astype(float), (wanted - stamps[0]).astype(float)
    pose = interpolate_poses(stamps, np.array(poses), wanted)[0]
    translations = np.array(poses)[:, :3, 3]
    expected = [np.interp(at, since_start, translations[:, axis])[0] for axis in range(3)]
    np.testing.assert_allclose(pose[:3, 3], expected, atol=1e-6)
    turns = [a[:3, :3].T @ b[:3, :3] for a, b in pairwise(poses)]
    if all(np.trace(turn) > -0.99 for turn in turns):  # a half turn has two ways
        slerp = Slerp(since_start, Rotation.from_matrix(np.array(poses)[:, :3, :3]))
        np.testing.assert_allclose(pose[:3, :3], slerp(at).as_matrix()[0], atol=1e-6)
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)


def test_pose_between_two_is_half_the_way_and_half_the_turn() -> None:
    poses = np.array([np.eye(4), transform_from_parts(QUARTER_TURN, [2.0, 0.0, -4.0])])
    pose = interpolate_poses(np.array([0, 10]), poses, np.array([5]))[0]
    np.testing.assert_allclose(pose[:3, 3], [1.0, 0.0, -2.0])
    np.testing.assert_allclose(pose[:3, :3], Rotation.from_euler("z", 45, degrees=True).as_matrix())


def test_single_pose_is_repeated() -> None:
    pose = transform_from_parts(QUARTER_TURN, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(
        interpolate_poses(np.array([7]), pose[None], np.array([7, 7])), [pose, pose]
    )


def test_nanoseconds_of_todays_clock_are_told_apart() -> None:
    start = 1_700_000_000_000_000_000
    poses = np.array([np.eye(4), transform_from_parts(np.eye(3), [100.0, 0.0, 0.0])])
    pose = interpolate_poses(np.array([start, start + 100]), poses, np.array([start + 1]))[0]
    assert pose[0, 3] == pytest.approx(1.0)


def test_inverses_of_many_are_those_of_each() -> None:
    rotations = [rotation_from_vector([0.1 * k, -0.4, 0.3 * k]) for k in range(4)]
    poses = np.array([transform_from_parts(r, [k, -1.0, 2.0]) for k, r in enumerate(rotations)])
    np.testing.assert_allclose(poses @ invert_transforms(poses), np.tile(np.eye(4), (4, 1, 1)), atol=1e-12)
    assert invert_transforms(np.zeros((0, 4, 4))).shape == (0, 4, 4)


def test_corrections_are_interpolated_and_beyond_their_ends_kept() -> None:
    corrections = np.array([transform_from_parts(np.eye(3), [x, 0.0, 0.0]) for x in (1.0, 3.0)])
    wanted = np.array([0, 100, 150, 200, 999])
    spread = spread_corrections(np.array([100, 200]), corrections, wanted)
    np.testing.assert_allclose(spread[:, 0, 3], [1.0, 1.0, 2.0, 3.0, 3.0])
    single = spread_corrections(np.array([100]), corrections[:1], wanted)
    np.testing.assert_allclose(single[:, 0, 3], 1.0)


def test_the_first_pose_that_is_none_is_named() -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    assert find_pose_flaw(poses) is None
    assert find_pose_flaw(poses[:0]) is None
    poses[3, 0, 3] = np.nan
    poses[4, :3, :3] *= 2
    assert find_pose_flaw(poses) == (3, "a value that is not finite")
    poses[3, 0, 3] = 0.0
    assert find_pose_flaw(poses) == (4, "a rotation whose columns are not perpendicular and of length 1")


def test_a_pose_is_checked_up_to_its_limits() -> None:
    near = np.eye(4)
    near[1, 3] = -1e7
    assert not check_pose(near).flags.writeable
    near[1, 3] = -1.1e7
    with pytest.raises(TrajectoryError, match="a place more than"):
        check_pose(near)
    sheared = np.eye(4)
    sheared[0, 1] = 0.9e-3
    check_pose(sheared)
    sheared[0, 1] = 1.1e-3
    with pytest.raises(TrajectoryError, match="not perpendicular"):
        check_pose(sheared)


def test_tiniest_rotation_vector_turns_in_its_own_sense() -> None:
    turned = rotation_from_vector([0.0, 0.0, 1e-13]) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(turned, [1.0, 1e-13, 0.0], rtol=1e-6, atol=0)


def test_as_many_poses_come_back_as_were_wanted() -> None:
    poses = np.tile(np.eye(4), (2, 1, 1))
    wanted = interpolate_poses(np.array([0, 10]), poses, np.array([0, 5, 10]))
    np.testing.assert_allclose(wanted, np.tile(np.eye(4), (3, 1, 1)))
