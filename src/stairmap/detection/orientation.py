"""Which way is up, and which ways a stairway may head, from the normals of one frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Vector
from stairmap.detection.inverse_depth import SurfaceNormals
from stairmap.geometry import angle_between, cross, normalized

MAX_PEAKS = 6
"""Peaks of the heading histogram that are looked at."""

UPRIGHT_WEIGHT = 0.1
"""Weight of an upright normal against a level one: floors are level, but risers lean and doors stand ajar."""

HEADING_BINS = 72
"""Bins of the heading histogram: 5 degrees each."""

MAX_RESIDUAL = 1.5
"""Normals whose plane fits worse than this many times the frame's noise do not tell up."""

PLANE_RESIDUAL = 0.0005
"""A plane that fits better than this, 1/m, is one however small the frame's noise is."""

MIN_LEVEL_SHARE = 0.02
"""Smallest share of level normals that can turn up."""

FULL_TURN_SHARE = 0.2
"""Share of level normals that may turn up by all that is allowed: a few narrow treads may all lean."""

GIVEN_UP_STD = np.radians(2.0)
"""Standard deviation of an up of which nothing else is known, rad: IMUs were 3 to 4 degrees off."""

POSE_UP_STD = np.radians(0.4)
"""Standard deviation of the up of a pose, rad: SLAM with an IMU holds roll and pitch to 0.3 to 0.5°."""

LEVEL_NORMAL_STD, NORMALS_PER_SAMPLE = np.radians(1.5), 15.0
"""Standard deviation of one independent normal, rad; so many normals count as one, for windows overlap."""

GROUNDS = ((0.85, np.radians(0.15)), (0.15, np.radians(1.2)))
"""Floors and treads: how many are level and how many slope, and by how much (standard deviation), rad. Ramps
and outdoor ground drain with 1 to 4 percent."""

UPRIGHT_STD = np.radians(1.0)
"""How far walls and risers of one view are from upright as a whole, rad: risers lean, doors stand ajar."""

LEVEL_LIMIT_DEG = 5.0
"""Normals within this of an up count as level by it where two are compared, degrees."""


class CorrectedUp(NamedTuple):
    """Up as a (3,) unit vector, camera frame, the standard deviation of its direction, rad, and the (3,)
    normal of floor and treads, which differs where the ground slopes."""

    up: Vector
    std: float
    ground: Vector


def correct_up(
    surfaces: SurfaceNormals, up: Vector, *, max_correction: float, std: float = GIVEN_UP_STD
) -> CorrectedUp:
    """Weigh a given up against floor, treads, walls and risers.

    Each normal within 15 degrees of up is one of level surfaces, each within 10 degrees of level one of
    upright surfaces; three rounds with tighter limits. Where these disagree with the given up, either it is
    wrong, or the ground slopes: both are weighed by how common they are, and walls and risers have their say.

    Parameters
    ----------
    surfaces
        Normals of the frame.
    up
        (3,) unit vector, camera frame, a few degrees off at most.
    max_correction
        Largest turn, rad, where level surfaces take ``FULL_TURN_SHARE`` of the normals, less in proportion
        where they take less; a larger one is not made at all.
    std
        Standard deviation of the given up, rad.

    Returns
    -------
    Up, its standard deviation (``std`` where it stays as given), and the ground's normal.
    """
    # Where a window straddles an edge, or a sensor rounds it, the plane fits badly and leans. A sensor that
    # smooths makes slopes of narrow treads that fit well, but between neighbours that are not parallel.
    is_plane = surfaces.residual <= max(MAX_RESIDUAL * surfaces.noise, PLANE_RESIDUAL)
    normals, is_inner = surfaces.normals[is_plane], surfaces.is_inner[is_plane]
    ground = up
    for level_limit, upright_limit in ((15.0, 10.0), (9.0, 8.0), (5.0, 6.0)):
        along = normals @ ground.astype(np.float32)
        level = is_inner & (along < -np.cos(np.radians(level_limit)))
        upright = np.abs(along) < np.sin(np.radians(upright_limit))
        if np.count_nonzero(level) < max(MIN_LEVEL_SHARE * len(normals), 10):
            return CorrectedUp(up, std, up)
        ground = _mean_up(normals[level], normals[upright])
    share = np.count_nonzero(level) / len(normals)
    if np.arccos(np.clip(ground @ up, -1, 1)) > max_correction * min(1.0, share / FULL_TURN_SHARE):
        return CorrectedUp(up, std, up)
    first = normalized(np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0]))
    basis = np.stack([first, cross(up, first)])
    walls = normals[upright].astype(np.float64)
    information = (walls @ basis.T).T @ (walls @ basis.T) / (LEVEL_NORMAL_STD**2 * NORMALS_PER_SAMPLE)
    pull = -(walls @ basis.T).T @ (walls @ up) / (LEVEL_NORMAL_STD**2 * NORMALS_PER_SAMPLE)
    # What all of them share does not average out.
    known = 1.0 / (1.0 + np.trace(information) * UPRIGHT_STD**2)
    noise = LEVEL_NORMAL_STD**2 * NORMALS_PER_SAMPLE / np.count_nonzero(level)
    mean, variance = _weigh_grounds(basis @ ground, noise, (known * information, known * pull), std)
    return CorrectedUp(normalized(up + mean @ basis), float(np.sqrt(variance)), ground)


def _mean_up(level: Float32Array, upright: Float32Array) -> Vector:
    """Up that minimises |u + n|^2 over level normals and (u·n)^2 over upright ones."""
    scatter = np.asarray(upright.T @ upright, dtype=np.float64)
    matrix = len(level) * np.eye(3) + UPRIGHT_WEIGHT * scatter
    return normalized(np.linalg.solve(matrix, -level.sum(axis=0, dtype=np.float64)))


def _weigh_grounds(
    ground: Float64Array, noise: float, walls: tuple[Float64Array, Float64Array], std: float
) -> tuple[Float64Array, float]:
    """How far up is from the given one, and the variance of that.

    Parameters
    ----------
    ground
        (2,) turn of the ground's normal from the given up, rad.
    noise
        Variance of it, rad^2.
    walls
        (2, 2) information of upright surfaces on the same turn of up, and its product with their estimate.
    std
        Standard deviation of the given up, rad.
    """
    weights, means, variances = [], [], []
    for share, slope in GROUNDS:
        variance = noise + slope**2
        information = np.eye(2) / std**2 + np.eye(2) / variance + walls[0]
        pull = ground / variance + walls[1]
        mean = np.linalg.solve(information, pull)
        # Log of the evidence, less what both grounds have in common.
        log = 0.5 * (pull @ mean - ground @ ground / variance) - np.log(variance)
        weights.append(np.log(share) + log - 0.5 * np.log(np.linalg.det(information)))
        means.append(mean)
        variances.append(0.5 * np.trace(np.linalg.inv(information)))
    weight = np.exp(np.array(weights) - max(weights))
    weight /= weight.sum()
    mean = weight @ np.array(means)
    spread = 0.5 * np.sum((np.array(means) - mean) ** 2, axis=1)
    return mean, float(weight @ (np.array(variances) + spread))


def estimate_up(surfaces: SurfaceNormals) -> Vector | None:
    """Find up from the floor when nothing else tells it.

    The floor is the largest set of parallel normals within 60 degrees of the image's
    upward direction that face the camera from below it. It takes 10 % of the frame, or
    3 % within 35 degrees of that direction, as with treads and no floor in view.

    Returns
    -------
    (3,) unit vector, camera frame; ``None`` when too little of the frame agrees.
    """
    normals, points = surfaces.normals, surfaces.points
    candidates = normals[(normals[:, 1] > 0.5) & (np.einsum("ij,ij->i", normals, points) > 0.1)]
    if len(candidates) < max(0.03 * len(normals), 30):
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
        share = 0.03 if -up[1] > np.cos(np.radians(35)) else 0.1
        if np.count_nonzero(near) < max(share * len(normals), 30):
            return None
        up = -normalized(candidates[near].sum(axis=0, dtype=np.float64))
    return up


def find_up_error(surfaces: SurfaceNormals, up: Vector, *, max_correction: float) -> float | None:
    """How far a given up is from what the floor says, where that is too far to be corrected.

    Parameters
    ----------
    surfaces
        Normals of the frame.
    up
        (3,) unit vector, camera frame.
    max_correction
        Smaller errors than this, rad, are corrected and not worth a word.

    Returns
    -------
    The angle, rad; ``None`` where no floor is seen, where it is near enough, or where as much of the frame
    is level by the up that was given: then that is the floor, and the other one slopes.
    """
    floor_up = estimate_up(surfaces)
    if floor_up is None:
        return None
    angle = angle_between(up, floor_up)
    if angle <= max_correction:
        return None
    limit = -np.cos(np.radians(LEVEL_LIMIT_DEG))
    num_level, num_floor = (
        np.count_nonzero(surfaces.normals @ axis.astype(np.float32) < limit) for axis in (up, floor_up)
    )
    return angle if num_floor > 2 * num_level else None


def level_axes(up: Vector) -> tuple[Vector, Vector]:
    """Return two level unit vectors, camera frame: the viewing direction made level, and left of it."""
    axis = np.array([0.0, 0.0, 1.0]) if abs(up[2]) < 0.95 else np.array([0.0, -1.0, 0.0])
    ahead = normalized(axis - (axis @ up) * up)
    return ahead, cross(up, ahead)


class Heading(NamedTuple):
    """A direction that upright surfaces face away from the camera.

    ``angle`` is counted from the level viewing direction, counter-clockwise seen from above, rad;
    ``num_distances`` is at how many separate distances surfaces stand across it.
    """

    angle: float
    num_distances: int


def find_headings(surfaces: SurfaceNormals, up: Vector, *, max_headings: int) -> list[Heading]:
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
    Headings in descending order of their distances: a wall stands at one, risers at many.
    """
    normals = surfaces.normals
    ahead, left = level_axes(up)
    upright = np.abs(normals @ up.astype(np.float32)) < 0.45
    if np.count_nonzero(upright) < 20:
        return []
    level = normals[upright]
    angles = np.arctan2(level @ left.astype(np.float32), level @ ahead.astype(np.float32))
    bins = ((angles + np.pi) * (HEADING_BINS / (2 * np.pi))).astype(np.int64) % HEADING_BINS
    counts = np.bincount(bins, minlength=HEADING_BINS)
    smooth = np.roll(counts, 1) + 2 * counts + np.roll(counts, -1)
    is_peak = (smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1)) & (smooth > 20)
    points = surfaces.points[upright]
    headings = []
    peaks = np.flatnonzero(is_peak)
    for peak in peaks[np.argsort(-smooth[peaks])][:MAX_PEAKS]:
        center = (peak + 0.5) * 2 * np.pi / HEADING_BINS - np.pi
        offsets = (angles - center + np.pi) % (2 * np.pi) - np.pi
        near = np.abs(offsets) < np.radians(8)
        angle = center + float(np.median(offsets[near]))
        if abs(angle) > np.radians(80):
            continue
        direction = np.cos(angle) * ahead + np.sin(angle) * left
        distances = points[near] @ direction.astype(np.float32)
        histogram = np.bincount(np.clip(distances / 0.08, 0, 100).astype(np.int64))
        headings.append(Heading(angle, int(np.count_nonzero(histogram > 3))))
    headings.sort(key=lambda heading: -heading.num_distances)
    return headings[:max_headings]
