"""Which way is up, and which ways a stairway may head, from the normals of one frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, Vector, readonly
from stairmap.detection.inverse_depth import SurfaceNormals
from stairmap.geometry import angle_between, cross, normalized, solve_three
from stairmap.kernels import count_floor_cells, find_facing, sum_normals
from stairmap.kernels.normals import FacingLimits, NormalLimits

MAX_PEAKS = 6
"""Peaks of the heading histogram that are looked at."""

UPRIGHT_WEIGHT = 0.1
"""Weight of an upright normal against a level one: floors are level, but risers lean and doors stand ajar."""

HEADING_BINS = 72
"""Bins of the heading histogram: 5 degrees each."""

PEAK_REACH, MAX_HEADING = np.radians(8.0), np.radians(80.0)
"""Normals within the first of a peak tell its heading; beyond the second nothing is ahead, rad."""

MAX_UPRIGHT, MIN_UPRIGHT = 0.45, 20
"""Largest component along up of an upright normal, 27 degrees, and the fewest of them that tell a heading."""

DISTANCE_BIN, MAX_DISTANCE_BINS, MIN_IN_BIN = 0.08, 100, 3
"""Distances across a heading are counted in bins of this many metres, half of a short run, up to 8 m; more
normals than the last make one a surface's."""

MIN_FLOOR_DOWN, MIN_FLOOR_DISTANCE = 0.5, 0.1
"""Normals of a floor point down the image by this component at least, and lie so far from the camera, m."""

FLOOR_CELLS = 40
"""Cells along each level component of a normal: 3 degrees each."""

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
"""Standard deviation of one independent normal, rad; this many normals count as one, for windows overlap."""

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
    max_residual = max(MAX_RESIDUAL * surfaces.noise, PLANE_RESIDUAL)
    ground = up
    for level_limit, upright_limit in ((15.0, 10.0), (9.0, 8.0), (5.0, 6.0)):
        limits = NormalLimits(
            max_residual, -math.cos(math.radians(level_limit)), math.sin(math.radians(upright_limit))
        )
        num_planes, num_level, level, _, scatter = sum_normals(
            surfaces.normals, surfaces.residual, surfaces.is_inner, ground, limits
        )
        if num_level < max(MIN_LEVEL_SHARE * num_planes, 10):
            return CorrectedUp(up, std, up)
        # Up that minimises |u + n|^2 over level normals and (u·n)^2 over upright ones.
        ground = normalized(solve_three(num_level * _IDENTITY + UPRIGHT_WEIGHT * scatter, -level))
    share = num_level / num_planes
    turn = math.acos(min(max(float(ground @ up), -1.0), 1.0))
    if turn > max_correction * min(1.0, share / FULL_TURN_SHARE):
        return CorrectedUp(up, std, up)
    basis = np.array(level_axes(up))
    projected = basis @ scatter / (LEVEL_NORMAL_STD**2 * NORMALS_PER_SAMPLE)
    information, pull = projected @ basis.T, -projected @ up
    # What all of them share does not average out.
    known = 1.0 / (1.0 + (information[0, 0] + information[1, 1]) * UPRIGHT_STD**2)
    noise = LEVEL_NORMAL_STD**2 * NORMALS_PER_SAMPLE / num_level
    mean, variance = _weigh_grounds(basis @ ground, noise, (known * information, known * pull), std)
    return CorrectedUp(normalized(up + mean @ basis), math.sqrt(variance), ground)


_IDENTITY = readonly(np.eye(3))


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
    # Two by two: written out, as numpy takes a tenth of a millisecond for each inverse.
    (a, b), (_, d) = walls[0].tolist()
    x, y = ground.tolist()
    wall_x, wall_y = walls[1].tolist()
    told = []
    for share, slope in GROUNDS:
        variance = noise + slope**2
        own = 1.0 / std**2 + 1.0 / variance
        first, last = a + own, d + own
        pull_x, pull_y = x / variance + wall_x, y / variance + wall_y
        determinant = first * last - b * b
        mean_x = (last * pull_x - b * pull_y) / determinant
        mean_y = (first * pull_y - b * pull_x) / determinant
        # Less what both grounds have in common; a turn of 15 degrees at most lets no exponential vanish.
        evidence = 0.5 * (pull_x * mean_x + pull_y * mean_y - (x * x + y * y) / variance)
        weight = share * math.exp(evidence) / (variance * math.sqrt(determinant))
        told.append((weight, mean_x, mean_y, 0.5 * (first + last) / determinant))
    total = sum(weight for weight, _, _, _ in told)
    turn_x = sum(weight * mean_x for weight, mean_x, _, _ in told) / total
    turn_y = sum(weight * mean_y for weight, _, mean_y, _ in told) / total
    variance = 0.0
    for weight, mean_x, mean_y, own_variance in told:
        spread = 0.5 * ((mean_x - turn_x) ** 2 + (mean_y - turn_y) ** 2)
        variance += weight * (own_variance + spread) / total
    return np.array([turn_x, turn_y]), variance


def estimate_up(surfaces: SurfaceNormals) -> Vector | None:
    """Find up from the floor when nothing else tells it.

    The floor is the largest set of parallel normals within 60 degrees of the image's
    upward direction that face the camera from below it. It takes 10 % of the frame, or
    3 % within 35 degrees of that direction, as with treads and no floor in view.

    Returns
    -------
    (3,) unit vector, camera frame; ``None`` when too little of the frame agrees.
    """
    normals = surfaces.normals
    candidates, counts = count_floor_cells(
        normals, surfaces.points, MIN_FLOOR_DOWN, MIN_FLOOR_DISTANCE, FLOOR_CELLS
    )
    if len(candidates) < max(0.03 * len(normals), 30):
        return None
    # A histogram over the two level components finds the mode without iteration.
    smooth = counts
    for axis in (0, 1):
        smooth = smooth + np.roll(smooth, 1, axis) + np.roll(smooth, -1, axis)
    best = np.unravel_index(int(np.argmax(smooth)), smooth.shape)
    x, z = (np.array(best) + 0.5) / (FLOOR_CELLS / 2) - 1.0
    up = -normalized([x, np.sqrt(max(1.0 - x * x - z * z, 0.01)), z])
    residual, is_floor = np.zeros(len(candidates), dtype=np.float32), np.ones(len(candidates), dtype=bool)
    for limit in (15.0, 8.0, 5.0):
        level = NormalLimits(max_residual=np.inf, max_level=-math.cos(math.radians(limit)), max_upright=0.0)
        _, num_near, near, _, _ = sum_normals(candidates, residual, is_floor, up, level)
        share = 0.03 if -up[1] > np.cos(np.radians(35)) else 0.1
        if num_near < max(share * len(normals), 30):
            return None
        up = -normalized(near)
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
    limits = FacingLimits(
        max_upright=MAX_UPRIGHT,
        min_count=MIN_UPRIGHT,
        num_bins=HEADING_BINS,
        max_peaks=MAX_PEAKS,
        reach=PEAK_REACH,
        max_angle=MAX_HEADING,
        width=DISTANCE_BIN,
        max_bins=MAX_DISTANCE_BINS,
        min_in_bin=MIN_IN_BIN,
    )
    axes = np.array([up, *level_axes(up)])
    angles, numbers = find_facing(surfaces.normals, surfaces.points, axes, limits)
    headings = [Heading(*found) for found in zip(angles.tolist(), numbers.tolist(), strict=True)]
    headings.sort(key=lambda heading: -heading.num_distances)
    return headings[:max_headings]
