"""Rigid transforms as (4, 4) arrays.

A transform is named by both of its coordinate frames, destination first:
``map_from_camera`` takes points of the camera frame into the map, and equal
neighbours cancel: ``map_from_flight = map_from_camera @ camera_from_flight``.
Quaternions appear only at file and message borders, as ``quat_xyzw``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Float64Array, IntArray, Mask, Points, Transform, Vector, readonly
from stairmap.errors import TrajectoryError

MAX_SHEAR = 1e-3
"""Largest deviation of a rotation's columns from unit and perpendicular ones, 1.

Matrices that were printed with four decimals, or multiplied ten thousand times in float32, stay below it;
at 4 m it moves a point by 2 mm.
"""

MAX_COORDINATE = 1e7
"""Largest coordinate, m: UTM northings end there, and nothing on Earth is farther from its centre."""


def check_pose(map_from_camera: ArrayLike) -> Transform:
    """Return a pose as a read-only (4, 4) array if it is a rigid transform.

    Raises
    ------
    TrajectoryError
        If it has another shape, a value that is not finite, no rotation or a place beyond any map; the
        message says which.
    """
    pose = readonly(map_from_camera)
    if pose.shape != (4, 4):
        raise TrajectoryError(f"expected a pose of shape (4, 4), map_from_camera, got {pose.shape}")
    flaw = find_pose_flaw(pose[None])
    if flaw is not None:
        raise TrajectoryError(f"expected a rigid transform map_from_camera, got one with {flaw[1]}")
    return pose


def find_pose_flaw(poses: Float64Array) -> tuple[int, str] | None:
    """Return the index of the first of (N, 4, 4) poses that is not rigid, and what is wrong with it."""
    finite: Mask = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    # What is not finite would only warn below.
    known = np.where(finite[:, None, None], poses, np.eye(4))
    rotations = known[:, :3, :3]
    shears = np.abs(np.swapaxes(rotations, 1, 2) @ rotations - np.eye(3)).max(axis=(1, 2), initial=0.0)
    flaws = (
        (~finite, "a value that is not finite"),
        (np.abs(known[:, 3] - [0, 0, 0, 1]).max(axis=1, initial=0.0) > 0, "a last row that is not 0 0 0 1"),
        (shears > MAX_SHEAR, "a rotation whose columns are not perpendicular and of length 1"),
        (np.linalg.det(rotations) < 0, "a reflection in the place of its rotation"),
        (
            np.abs(known[:, :3, 3]).max(axis=1, initial=0.0) > MAX_COORDINATE,
            f"a place more than {MAX_COORDINATE:g} m from the map's origin",
        ),
    )
    is_bad = np.any([mask for mask, _ in flaws], axis=0)
    if not is_bad.any():
        return None
    index = int(np.argmax(is_bad))
    return index, next(text for mask, text in flaws if mask[index])


def transform_points(destination_from_source: Transform, points: Points) -> Points:
    """Express points in another coordinate frame.

    Parameters
    ----------
    destination_from_source
        (4, 4) rigid transform.
    points
        (..., 3) points in the source frame, in metres.

    Returns
    -------
    (..., 3) points in the destination frame, in metres.
    """
    rotation, translation = destination_from_source[:3, :3], destination_from_source[:3, 3]
    return points @ rotation.T + translation


def transform_from_parts(rotation: ArrayLike, translation: ArrayLike) -> Transform:
    """Build a transform from a (3, 3) rotation matrix and a (3,) translation in metres."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform


def invert_transform(destination_from_source: Transform) -> Transform:
    """Return ``source_from_destination`` for a (4, 4) rigid transform."""
    rotation = destination_from_source[:3, :3].T
    return transform_from_parts(rotation, -rotation @ destination_from_source[:3, 3])


def invert_transforms(destination_from_source: Float64Array) -> Float64Array:
    """Return (N, 4, 4) inverses of (N, 4, 4) rigid transforms."""
    inverse = np.tile(np.eye(4), (len(destination_from_source), 1, 1))
    inverse[:, :3, :3] = np.swapaxes(destination_from_source[:, :3, :3], 1, 2)
    inverse[:, :3, 3] = -np.einsum("nij,nj->ni", inverse[:, :3, :3], destination_from_source[:, :3, 3])
    return inverse


def rotation_from_quat(quat_xyzw: ArrayLike) -> Float64Array:
    """Turn unit quaternions into rotation matrices.

    Parameters
    ----------
    quat_xyzw
        (..., 4) quaternions, scalar last. They are normalised first.

    Returns
    -------
    (..., 3, 3) rotation matrices.
    """
    quat = np.asarray(quat_xyzw, dtype=np.float64)
    x, y, z, w = np.moveaxis(quat / np.linalg.norm(quat, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quat_from_rotation(rotation: ArrayLike) -> Float64Array:
    """Turn one (3, 3) rotation matrix into a (4,) unit quaternion, scalar last and not negative.

    The largest of the four components is computed first (Shepperd 1978), so
    the result is accurate for every rotation.
    """
    matrix = np.asarray(rotation, dtype=np.float64)
    diagonal = np.diag(matrix)
    squares = np.array([*(1 + 2 * diagonal - diagonal.sum()), 1 + diagonal.sum()])
    largest = int(np.argmax(squares))
    quat = np.empty(4)
    if largest == 3:
        quat[:3] = [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
        quat[3] = squares[3]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        quat[i] = squares[largest]
        quat[j] = matrix[j, i] + matrix[i, j]
        quat[k] = matrix[k, i] + matrix[i, k]
        quat[3] = matrix[k, j] - matrix[j, k]
    quat /= np.linalg.norm(quat)
    return np.asarray(quat if quat[3] >= 0 else -quat)


def rotation_from_vector(rotation_vector: ArrayLike) -> Float64Array:
    """Turn a (3,) rotation vector (axis times angle, rad) into a (3, 3) matrix (Rodrigues)."""
    vector = np.asarray(rotation_vector, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    cross = np.array([[0, -vector[2], vector[1]], [vector[2], 0, -vector[0]], [-vector[1], vector[0], 0]])
    if angle < 1e-12:
        return np.asarray(np.eye(3) + cross)
    return np.asarray(
        np.eye(3) + np.sin(angle) / angle * cross + (1 - np.cos(angle)) / angle**2 * cross @ cross
    )


def vector_from_rotation(rotation: ArrayLike) -> Vector:
    """Return the (3,) rotation vector (axis times angle, rad, at most pi) of a (3, 3) matrix."""
    vector: Vector = _rotation_vectors(np.asarray(rotation, dtype=np.float64)[None])[0]
    return vector


def rotation_between(source: Vector, destination: Vector) -> Float64Array:
    """Return the smallest rotation that takes one (3,) unit vector onto another.

    For opposite vectors the axis is any one perpendicular to them.
    """
    cross = np.cross(source, destination)
    sine, cosine = float(np.linalg.norm(cross)), float(source @ destination)
    if sine < 1e-12:
        if cosine > 0:
            return np.eye(3)
        other = np.eye(3)[int(np.argmin(np.abs(source)))]
        axis = np.cross(source, other)
        return rotation_from_vector(np.pi * axis / np.linalg.norm(axis))
    return rotation_from_vector(cross / sine * np.arctan2(sine, cosine))


def interpolate_poses(stamps_ns: IntArray, poses: Float64Array, wanted_ns: IntArray) -> Float64Array:
    """Interpolate poses at given times: translations linearly, rotations by slerp.

    Parameters
    ----------
    stamps_ns
        (N,) strictly increasing stamps, in nanoseconds.
    poses
        (N, 4, 4) transforms at these stamps.
    wanted_ns
        (M,) stamps within the first and last of ``stamps_ns``.

    Returns
    -------
    (M, 4, 4) transforms.
    """
    if len(stamps_ns) == 1:
        return np.repeat(poses, len(wanted_ns), axis=0)
    after = np.clip(np.searchsorted(stamps_ns, wanted_ns), 1, len(stamps_ns) - 1)
    before = after - 1
    span = (stamps_ns[after] - stamps_ns[before]).astype(np.float64)
    fraction = ((wanted_ns - stamps_ns[before]) / span)[:, None]
    result = np.tile(np.eye(4), (len(wanted_ns), 1, 1))
    start, end = poses[before], poses[after]
    result[:, :3, 3] = start[:, :3, 3] * (1 - fraction) + end[:, :3, 3] * fraction
    relative = np.swapaxes(start[:, :3, :3], 1, 2) @ end[:, :3, :3]
    vectors = _rotation_vectors(relative) * fraction
    result[:, :3, :3] = start[:, :3, :3] @ _rotations(vectors)
    return result


def spread_corrections(stamps_ns: IntArray, corrections: Float64Array, wanted_ns: IntArray) -> Float64Array:
    """Tell corrections of poses at any time from those at some times.

    Parameters
    ----------
    stamps_ns
        (N,) strictly increasing stamps, at least one, in nanoseconds.
    corrections
        (N, 4, 4) ``corrected_map_from_map`` at these stamps.
    wanted_ns
        (M,) stamps.

    Returns
    -------
    (M, 4, 4) corrections: between two stamps interpolated, before the first and after the last the nearest.
    """
    return interpolate_poses(stamps_ns, corrections, np.clip(wanted_ns, stamps_ns[0], stamps_ns[-1]))


def _rotation_vectors(rotations: Float64Array) -> Float64Array:
    """(N, 3) rotation vectors of (N, 3, 3) rotations."""
    vectors = 0.5 * np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(vectors, axis=1)
    angle = np.arctan2(sine, (np.trace(rotations, axis1=1, axis2=2) - 1.0) / 2.0)
    vectors *= np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
    # Near half a turn the antisymmetric part vanishes, and only the quaternion tells the axis.
    for index in np.flatnonzero(angle > 3.0):
        quat = quat_from_rotation(rotations[index])
        axis_length = float(np.linalg.norm(quat[:3]))
        vectors[index] = quat[:3] / axis_length * 2 * np.arctan2(axis_length, quat[3])
    return np.asarray(vectors)


def _rotations(vectors: Float64Array) -> Float64Array:
    """(N, 3, 3) rotations of (N, 3) rotation vectors."""
    angle = np.linalg.norm(vectors, axis=1)
    sine_half = np.sinc(angle / (2 * np.pi)) / 2
    quats = np.concatenate([vectors * sine_half[:, None], np.cos(angle / 2)[:, None]], axis=1)
    return rotation_from_quat(quats)
