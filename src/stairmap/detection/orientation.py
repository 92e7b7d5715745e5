"""Which way is up, and which ways a stairway may head, from the normals of one frame."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, Vector
from stairmap.detection.inverse_depth import SurfaceNormals
from stairmap.geometry import normalized

HEADING_BINS = 72
"""Bins of the heading histogram: 5 degrees each."""


def correct_up(surfaces: SurfaceNormals, up: Vector, *, max_correction: float) -> Vector:
    """Turn a given up so that floor and treads are level and walls and risers upright.

    Each normal within 15 degrees of up pulls up towards itself, each normal within
    10 degrees of level pulls it to be perpendicular; least squares, three rounds with
    tighter limits. Level surfaces need at least 3 % of the normals, or up stays as given.

    Parameters
    ----------
    surfaces
        Normals of the frame.
    up
        (3,) unit vector, camera frame, a few degrees off at most.
    max_correction
        Largest turn, rad; a larger one is not made at all.

    Returns
    -------
    (3,) unit vector, camera frame.
    """
    normals = surfaces.normals
    corrected = up
    for level_limit, upright_limit in ((15.0, 10.0), (9.0, 8.0), (6.0, 6.0)):
        along = normals @ corrected.astype(np.float32)
        level = along < -np.cos(np.radians(level_limit))
        upright = np.abs(along) < np.sin(np.radians(upright_limit))
        if np.count_nonzero(level) < max(0.03 * len(normals), 30):
            return up
        # Minimise |u + n|^2 over level normals and (u·n)^2 over upright ones.
        level_sum = -normals[level].sum(axis=0, dtype=np.float64)
        selected = normals[upright]
        scatter = np.asarray(selected.T @ selected, dtype=np.float64)
        matrix = np.count_nonzero(level) * np.eye(3) + scatter
        corrected = normalized(np.linalg.solve(matrix, level_sum))
    if np.arccos(np.clip(corrected @ up, -1, 1)) > max_correction:
        return up
    return corrected


def estimate_up(surfaces: SurfaceNormals) -> Vector | None:
    """Find up from the floor when nothing else tells it.

    The floor is the largest set of parallel normals within 60 degrees of the image's
    upward direction that face the camera from below it.

    Returns
    -------
    (3,) unit vector, camera frame; ``None`` when less than 10 % of the frame agree.
    """
    normals, points = surfaces.normals, surfaces.points
    candidates = normals[(normals[:, 1] > 0.5) & (np.einsum("ij,ij->i", normals, points) > 0.1)]
    if len(candidates) < max(0.1 * len(normals), 100):
        return None
    # A histogram over the two level components finds the mode without iteration.
    cells = np.floor((candidates[:, [0, 2]] + 1.0) * 20).astype(np.int64)
    counts = np.bincount(cells[:, 0] * 64 + cells[:, 1], minlength=64 * 64).reshape(64, 64)
    smooth = counts.copy()
    for axis in (0, 1):
        smooth = smooth + np.roll(smooth, 1, axis) + np.roll(smooth, -1, axis)
    best = np.unravel_index(int(np.argmax(smooth)), smooth.shape)
    x, z = (np.array(best) + 0.5) / 20 - 1.0
    up = -normalized([x, np.sqrt(max(1.0 - x * x - z * z, 0.01)), z])
    for limit in (15.0, 8.0, 5.0):
        near = candidates @ up.astype(np.float32) < -np.cos(np.radians(limit))
        if np.count_nonzero(near) < max(0.1 * len(normals), 100):
            return None
        up = -normalized(candidates[near].sum(axis=0, dtype=np.float64))
    return up


def level_axes(up: Vector) -> tuple[Vector, Vector]:
    """Return two level unit vectors, camera frame: the viewing direction made level, and left of it."""
    axis = np.array([0.0, 0.0, 1.0]) if abs(up[2]) < 0.95 else np.array([0.0, -1.0, 0.0])
    ahead = normalized(axis - (axis @ up) * up)
    return ahead, np.cross(up, ahead)


def find_headings(surfaces: SurfaceNormals, up: Vector, *, max_headings: int) -> Float64Array:
    """Find the directions in which upright surfaces face away from the camera.

    Parameters
    ----------
    surfaces
        Normals of the frame.
    up
        (3,) unit vector, camera frame.
    max_headings
        How many are returned at most.

    Returns
    -------
    (M,) angles from the level viewing direction, counter-clockwise seen from above, rad,
    in descending order of how many separate distances their surfaces stand at: a wall
    stands at one, risers at many.
    """
    normals = surfaces.normals
    ahead, left = level_axes(up)
    upright = np.abs(normals @ up.astype(np.float32)) < 0.45
    if np.count_nonzero(upright) < 50:
        return np.zeros(0)
    level = normals[upright]
    angles = np.arctan2(level @ left.astype(np.float32), level @ ahead.astype(np.float32))
    bins = ((angles + np.pi) * (HEADING_BINS / (2 * np.pi))).astype(np.int64) % HEADING_BINS
    counts = np.bincount(bins, minlength=HEADING_BINS)
    smooth = np.roll(counts, 1) + 2 * counts + np.roll(counts, -1)
    is_peak = (smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1)) & (smooth > 60)
    points = surfaces.points[upright]
    headings = []
    for peak in np.flatnonzero(is_peak):
        center = (peak + 0.5) * 2 * np.pi / HEADING_BINS - np.pi
        offsets = (angles - center + np.pi) % (2 * np.pi) - np.pi
        near = np.abs(offsets) < np.radians(8)
        angle = center + float(np.median(offsets[near]))
        if abs(angle) > np.radians(80):
            continue
        direction = np.cos(angle) * ahead + np.sin(angle) * left
        distances = points[near] @ direction.astype(np.float32)
        histogram = np.bincount(np.clip(distances / 0.08, 0, 100).astype(np.int64))
        headings.append((np.count_nonzero(histogram > 12), angle))
    headings.sort(reverse=True)
    return np.array([angle for _, angle in headings[:max_headings]])
