"""Planes, lines and robust fits in three dimensions.

A plane is (a, b, c, d) with a unit normal: a·x + b·y + c·z + d = 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Float64Array, Mask, Points, Vector


def normalized(vector: ArrayLike) -> Vector:
    """Return a vector scaled to length one.

    Raises
    ------
    ValueError
        If its length is zero or not finite.
    """
    array = np.asarray(vector, dtype=np.float64)
    length = math.sqrt(array @ array)
    if not math.isfinite(length) or length == 0:
        raise ValueError(f"a direction needs a finite length above zero, got {array.tolist()}")
    return np.asarray(array / length)


def cross(first: Vector, second: Vector) -> Vector:
    """Return the cross product of two (3,) vectors; ``numpy.cross`` takes ten times as long for so little."""
    a, b, c = first.tolist()
    x, y, z = second.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def solve_three(matrix: Float64Array, right: Vector) -> Vector:
    """Solve three linear equations by Cramer's rule; ``numpy.linalg.solve`` takes eight times as long.

    Parameters
    ----------
    matrix
        (3, 3) matrix far from singular, such as a sum of squares and a positive diagonal.
    right
        (3,) right side.
    """
    first, second, third = matrix
    minors = np.array([cross(second, third), cross(third, first), cross(first, second)])
    return np.asarray(right @ minors / (first @ minors[0]))


def angle_between(first: ArrayLike, second: ArrayLike) -> float:
    """Return the angle between two (3,) vectors, 0 to pi rad."""
    a, b = normalized(first), normalized(second)
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def wrapped_angle(angle: float) -> float:
    """Return an angle in rad, wrapped to [-pi, pi)."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def plane_distances(plane: Float64Array, points: Points) -> Float64Array:
    """Return the signed distances (...,) in metres of (..., 3) points from a (4,) plane."""
    return np.asarray(points @ plane[:3] + plane[3])


def fit_plane(points: Points) -> Float64Array | None:
    """Fit a plane to points by total least squares.

    Parameters
    ----------
    points
        (N, 3) points, in metres.

    Returns
    -------
    (4,) plane whose normal has a z that is not negative; ``None`` with fewer than three
    points or when they lie on one line.
    """
    points = np.asarray(points, dtype=np.float64)
    if len(points) < 3:
        return None
    center = points.mean(axis=0)
    offsets = points - center
    eigenvalues, eigenvectors = np.linalg.eigh(offsets.T @ offsets)
    if eigenvalues[1] <= 1e-12 * max(eigenvalues[2], 1e-300):
        return None
    normal = eigenvectors[:, 0] * (1.0 if eigenvectors[2, 0] >= 0 else -1.0)
    return np.append(normal, -normal @ center)


def fit_plane_ransac(
    points: Points, *, tolerance: float, seed: int, num_trials: int = 200
) -> tuple[Float64Array, Mask] | None:
    """Fit a plane to points that hold outliers (RANSAC, Fischler and Bolles 1981).

    All trials are drawn at once; the best is refitted to its inliers by least squares.

    Parameters
    ----------
    points
        (N, 3) points, in metres.
    tolerance
        Largest distance of an inlier, in metres.
    seed
        Seed of the draws: equal input gives equal output.
    num_trials
        How many triples are drawn.

    Returns
    -------
    (4,) plane whose normal has a z that is not negative, and the (N,) mask of its inliers;
    ``None`` when no triple spans a plane.
    """
    points = np.asarray(points, dtype=np.float64)
    if len(points) < 3:
        return None
    random = np.random.default_rng(seed)
    triples = points[random.integers(0, len(points), size=(num_trials, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    usable = lengths > 1e-9
    if not usable.any():
        return None
    normals = normals[usable] / lengths[usable, None]
    offsets = np.einsum("ij,ij->i", normals, triples[usable, 0])
    num_inliers = [
        int(np.count_nonzero(np.abs(points @ normal - offset) <= tolerance))
        for normal, offset in zip(normals, offsets, strict=True)
    ]
    best = int(np.argmax(num_inliers))
    inliers: Mask = np.abs(points @ normals[best] - offsets[best]) <= tolerance
    plane = fit_plane(points[inliers])
    if plane is None:
        return None
    return plane, np.asarray(np.abs(plane_distances(plane, points)) <= tolerance)


def weighted_median(values: Float64Array, weights: Float64Array) -> float:
    """Return the weighted median of (N,) values: half of the weight lies on either side.

    Raises
    ------
    ValueError
        If there is no value with a positive weight.
    """
    values, weights = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    if not (weights > 0).any():
        raise ValueError("a weighted median needs at least one positive weight")
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulative, cumulative[-1] / 2)])
