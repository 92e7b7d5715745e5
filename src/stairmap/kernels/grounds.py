"""Fit the plane of the ground to the rays of a frame, and find where it ends and something lower follows."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_length

Ground: TypeAlias = tuple[Float64Array, Float32Array, Float32Array, Mask]
"""Plane, and of each ray where it crosses the plane and how high above it what it met lies; what is seen."""


class GroundCamera(NamedTuple):
    """Focal lengths and centre of the image, pixels; rays with less depth for each metre forward than
    ``least_depth`` look aside of it."""

    fx: float
    fy: float
    cx: float
    cy: float
    least_depth: float


class GroundLimits(NamedTuple):
    """What a ground may be, and how its plane is fitted.

    ``low``, ``high``: heights of the camera above it, m, which are counted in bins of ``height_bin`` over the
    ``near_rows`` steepest measured rays of each bearing; ``is_known`` where the camera's height is known, so
    that fewer rays will do than ``min_share`` of them. Every ``row_step``-th row and ``column_step``-th
    column up to ``max_range``, m, within ``first_limit`` of the level, m, and ``first_per_metre``, may be
    fitted: within ``noise`` and ``noise_per_metre`` of the plane, ``reach_growth`` times as far each round.
    ``steadiness``: weight of a level plane; ``least_distance``: nearer rays weigh no more, m. What is seen
    is counted in ``num_bins`` bins of ``range_bin`` m.
    """

    low: float
    high: float
    height_bin: float
    near_rows: int
    is_known: bool
    min_share: float
    row_step: int
    column_step: int
    max_range: float
    reach_growth: float
    first_limit: float
    first_per_metre: float
    noise: float
    noise_per_metre: float
    steadiness: float
    least_distance: float
    num_bins: int
    range_bin: float


class LedgeLimits(NamedTuple):
    """What an edge of the ground is.

    A ray is on the ground within ``noise`` and ``noise_per_metre`` up to ``max_range``, below it by more than
    ``min_depth``, or ``far_depth`` and ``depth_per_metre``, m. Of ``persistence`` measured rays from the edge
    on ``min_below`` are, of ``last_ground`` before it ``min_last_ground`` are on the ground, and at most
    ``max_mixed`` lie between. ``max_gap``, ``max_distance``: of the edge, m. About it, up to ``rows_behind``,
    the two largest steps down make ``min_step_share`` of the fall, or all falls more steeply than
    ``min_fall``. ``max_shift``: how far past the last ground the edge lies at most, m.
    """

    noise: float
    noise_per_metre: float
    max_range: float
    min_depth: float
    far_depth: float
    depth_per_metre: float
    persistence: int
    min_below: int
    last_ground: int
    min_last_ground: int
    max_mixed: int
    max_gap: float
    max_distance: float
    rows_behind: int
    min_step_share: float
    min_fall: float
    max_shift: float


def fit_ground(
    inverse_depth: Float32Array,
    axes: Float64Array,
    slope: Float64Array,
    bearing: Float64Array,
    camera: GroundCamera,
    limits: GroundLimits,
) -> Ground:
    """Find the plane that the steepest rays meet, and tell all rays by it.

    Heights are fitted over forward and lateral distance with the weight of a metre's distance: near ground
    tells the height, far ground the tilt. Each round reaches farther, for rays on the plane of the last one.

    Parameters
    ----------
    inverse_depth
        (H, W) float32 image, 1/m, 0 where nothing was measured.
    axes
        (3, 3) rows forward, up and left.
    slope, bearing
        (R,) heights gained, ascending and all below 0, and (C,) metres to the left, for each metre forward.
    camera
        Whose image it is.
    limits
        What the ground may be.

    Returns
    -------
    plane
        (3,) slope along, slope across and height of the camera; (0,) where there is none.
    crossing
        (R, C) float32 forward distance at which each ray crosses the plane, m; infinite for those that do
        not. Of no rows where there is no plane.
    height
        (R, C) float32 height of what each ray met above the plane, m; NaN where nothing was measured.
    is_seen
        (C, num_bins) whether the plane was seen along a bearing in each bin of forward distance.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(inverse_depth, "inverse_depth", np.float32, 2)
    check_array(axes, "axes", np.float64, 2)
    check_array(slope, "slope", np.float64, 1)
    check_array(bearing, "bearing", np.float64, 1)
    check_length(axes, "axes", 3)
    check_length(axes, "axes", 3, 1)
    limits = GroundLimits(*limits)
    _check_ground_limits(limits)
    nothing = np.zeros((0, len(bearing)), dtype=np.float32)
    none = np.zeros(0), nothing, nothing, np.zeros((len(bearing), limits.num_bins), dtype=bool)
    climb, across = slope.astype(np.float32), bearing.astype(np.float32)
    inverse = _sample_nearest(inverse_depth, axes, climb, across, GroundCamera(*camera))
    valid = inverse > 0
    distance = np.where(valid, np.float32(1.0) / np.where(valid, inverse, np.float32(1)), np.float32(np.nan))
    height = climb[:, None] * distance
    first = _first_height(height, valid, limits)
    if first is None:
        return none
    plane = _fit_plane(distance, height, across, first, limits)
    if plane is None:
        return none
    along, aside, below = (np.float32(value) for value in plane)
    lean = np.float32(1.0 / np.sqrt(1.0 + plane[0] * plane[0] + plane[1] * plane[1]))
    grade = along + aside * across[None, :]
    fall = grade - climb[:, None]
    noise, per_metre, farthest = (
        np.float32(value) for value in (limits.noise, limits.noise_per_metre, limits.max_range)
    )
    is_falling = fall > np.float32(1e-6)
    crossing = np.where(is_falling, below / np.where(is_falling, fall, np.float32(1)), np.float32(np.inf))
    above = (height + below - distance * grade) * lean
    tolerance = noise + per_metre * np.minimum(crossing, farthest)
    with np.errstate(invalid="ignore"):
        seen = (np.abs(above) < tolerance) & (crossing < np.float32(limits.num_bins * limits.range_bin))
        seen &= crossing >= 0
    is_seen = none[3]
    rows, columns = np.nonzero(seen)
    place = (crossing[rows, columns] / np.float32(limits.range_bin)).astype(np.int64)
    is_seen[columns, np.minimum(place, limits.num_bins - 1)] = True
    return plane, crossing, above, is_seen


def _check_ground_limits(limits: GroundLimits) -> None:
    if limits.row_step < 1 or limits.column_step < 1 or limits.num_bins < 1:
        raise ValueError("limits: expected steps and a number of bins above 0, got others")
    if not (limits.height_bin > 0 and 0 <= limits.low <= limits.high < 1e4 * limits.height_bin):
        raise ValueError("limits: expected bins above 0 and heights of at most 10,000 of them, got others")
    if not (limits.reach_growth > 1.0 and limits.least_distance > 0.0):
        raise ValueError("limits: expected a reach that grows from a distance above 0, got others")


def _sample_nearest(
    image: Float32Array, axes: Float64Array, climb: Float32Array, across: Float32Array, camera: GroundCamera
) -> Float32Array:
    """(R, C) inverse forward distance of the pixel nearest to each ray, 1/m; 0 where none is."""
    fx, fy, cx, cy, least = (np.float32(value) for value in camera)
    forward, up, left = axes.astype(np.float32)
    ray = [climb[:, None] * up[i] + (forward[i] + left[i] * across) for i in range(3)]
    inverse = np.float32(1.0) / np.maximum(ray[2], least)
    map_u, map_v = np.rint(ray[0] * inverse * fx + cx), np.rint(ray[1] * inverse * fy + cy)
    height, width = image.shape
    is_inside = (map_u >= 0) & (map_u < width) & (map_v >= 0) & (map_v < height) & (ray[2] > least)
    row, column = (np.where(is_inside, place, 0).astype(np.int64) for place in (map_v, map_u))
    if image.size == 0:
        return np.zeros(is_inside.shape, dtype=np.float32)
    return np.where(is_inside, image[row, column] * ray[2], np.float32(0))


def _first_height(height: Float32Array, valid: Mask, limits: GroundLimits) -> float | None:
    """Height of the camera above the level surface that the steepest rays meet, m."""
    steepest = valid & (np.cumsum(valid, axis=0) <= limits.near_rows)
    below = -height[steepest]
    inside = below[(below > np.float32(limits.low)) & (below < np.float32(limits.high))]
    if len(inside) == 0:
        return None
    if len(inside) < limits.min_share * len(below) and (
        not limits.is_known or len(inside) < limits.near_rows
    ):
        return None
    size = np.float32(limits.height_bin)
    counts = np.bincount((inside / size).astype(np.int64), minlength=3)
    smooth = counts[:-2] + counts[1:-1] + counts[2:]
    best = int(np.argmax(smooth)) + 1
    middle = np.float32((best + 0.5) * limits.height_bin)
    near = inside[np.abs(inside - middle) < np.float32(1.5 * limits.height_bin)]
    if len(near) == 0 or (not limits.is_known and len(near) < limits.min_share * len(below)):
        return None
    return float(np.median(near.astype(np.float64)))


def _fit_plane(
    distance: Float32Array, height: Float32Array, across: Float32Array, first: float, limits: GroundLimits
) -> Float64Array | None:
    """(3,) slope along, slope across and height of the camera; ``None`` where too few rays are near it."""
    rows_of, columns_of = slice(None, None, limits.row_step), slice(None, None, limits.column_step)
    distance, height, across = distance[rows_of, columns_of], height[rows_of, columns_of], across[columns_of]
    band = np.float32(limits.first_limit) + np.float32(limits.first_per_metre) * distance
    with np.errstate(invalid="ignore"):
        near = (distance < np.float32(limits.max_range)) & (np.abs(height + np.float32(first)) < band)
    rows, columns = np.nonzero(near)
    s = distance[rows, columns].astype(np.float64)
    z = height[rows, columns].astype(np.float64)
    design = np.stack([s, s * across[columns], -np.ones_like(s)], axis=1)
    plane = np.array([0.0, 0.0, first])
    weighted = design / np.maximum(s, limits.least_distance)[:, None] ** 2
    tolerance = limits.noise + limits.noise_per_metre * s
    num_least = max(limits.near_rows, 3)
    if len(s) < num_least:
        return None
    reach = limits.reach_growth * max(
        float(np.partition(s, num_least - 1)[num_least - 1]), limits.least_distance
    )
    while reach < limits.reach_growth * limits.max_range:
        chosen = (np.abs(z - design @ plane) < tolerance) & (s < reach)
        if np.count_nonzero(chosen) < num_least:
            return None
        # A little of the level plane keeps what few rays leave open.
        information = weighted[chosen].T @ design[chosen] + np.diag(
            [limits.steadiness, limits.steadiness, 0.0]
        )
        plane = np.linalg.solve(information, weighted[chosen].T @ z[chosen])
        reach *= limits.reach_growth
    return plane


def find_ledges(
    crossing: Float32Array, height: Float32Array, camera_height: float, limits: LedgeLimits
) -> tuple[IntArray, Float64Array, Float64Array]:
    """Find along which bearings the ground ends at a drop, the nearest one of each.

    Parameters
    ----------
    crossing, height
        (R, C) float32 rays against the ground, as ``fit_ground`` returns them.
    camera_height
        Of the camera above the plane, m.
    limits
        What an edge is.

    Returns
    -------
    column, distance, depth
        (N,) ascending columns, forward distance of the edge in each, m, and how far below the ground the
        first lower thing lies, m.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(crossing, "crossing", np.float32, 2)
    check_array(height, "height", np.float32, 2)
    check_length(height, "height", len(crossing))
    check_length(height, "height", crossing.shape[1], 1)
    limits = LedgeLimits(*limits)
    if min(limits.persistence, limits.last_ground, limits.max_mixed + 1, limits.rows_behind + 1) < 1:
        raise ValueError("limits: expected numbers of rays above 0, got others")
    if crossing.size == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
    rows, is_measured = _packed_rows(np.isfinite(height))
    columns = np.arange(rows.shape[1])
    crossing = crossing[rows, columns]
    height = np.where(is_measured, height[rows, columns], np.float32(np.nan))
    tolerance = np.float32(limits.noise) + np.float32(limits.noise_per_metre) * np.minimum(
        crossing, np.float32(limits.max_range)
    )
    with np.errstate(invalid="ignore"):
        is_ground = is_measured & (np.abs(height) < tolerance)
        deep = np.float32(limits.far_depth) + np.float32(limits.depth_per_metre) * crossing
        is_below = is_measured & (height < -np.maximum(np.float32(limits.min_depth), deep))
    starts = is_below & (_count_ahead(is_below, limits.persistence) >= limits.min_below)
    behind = _count_ahead(is_ground[::-1], limits.last_ground)[::-1]
    ends = is_ground & (behind >= limits.min_last_ground)
    last_ground = np.full(rows.shape, -1, dtype=np.int64)
    for step in range(min(limits.max_mixed + 1, len(rows) - 1), 0, -1):
        earlier = np.arange(len(rows) - step)
        last_ground[step:] = np.where(ends[:-step], earlier[:, None], last_ground[step:])
    before = crossing[np.maximum(last_ground, 0), columns]
    # Infinite where a ray never meets the ground.
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        is_near = crossing - before < np.float32(limits.max_gap)
        is_near &= before < np.float32(limits.max_distance)
        is_edge = starts & (last_ground >= 0) & is_near
        distance = crossing * (np.float32(1.0) - height / np.float32(camera_height))
    column = np.flatnonzero(is_edge.any(axis=0))
    first = np.argmax(is_edge[:, column], axis=0)
    about = first + np.arange(-limits.max_mixed - 1, limits.rows_behind + 1)[:, None]
    about = np.clip(about, 0, len(height) - 1)
    is_sharp = _falls_sharply(height[about, column], distance[about, column], limits)
    column, first = column[is_sharp], first[is_sharp]
    low, high = before[first, column], crossing[first, column]
    place = low + np.minimum(np.float32(0.5) * (high - low), np.float32(limits.max_shift))
    return column, place.astype(np.float64), -height[first, column].astype(np.float64)


def _falls_sharply(height: Float32Array, distance: Float32Array, limits: LedgeLimits) -> Mask:
    """(N,) whether (W, N) rays about an edge fall in one or two steps, or more steeply than a ramp.

    On a ramp seen at a flat angle neighbouring rays may fall by decimetres, but every one does.
    """
    with np.errstate(invalid="ignore"):
        falls = np.nan_to_num(np.maximum(-np.diff(height, axis=0), np.float32(0)))
        total = np.zeros(height.shape[1], dtype=np.float32)
        for fall in falls:
            total = total + fall
        largest = np.sort(falls, axis=0)[-2:].sum(axis=0)
        reach = np.maximum(distance[-1] - distance[0], np.float32(0))
        steep = height[0] - height[-1] > np.float32(limits.min_fall) * reach
    return np.asarray((largest >= np.float32(limits.min_step_share) * total) | steep)


def _packed_rows(measured: Mask) -> tuple[IntArray, Mask]:
    """(R, C) rows of the measured rays of each column, packed to its front, and which entries are some."""
    order = np.argsort(~measured, axis=0, kind="stable")
    return order, np.arange(len(measured))[:, None] < np.count_nonzero(measured, axis=0)


def _count_ahead(mask: Mask, length: int) -> IntArray:
    """How many of ``length`` entries from each on, along the first axis, are true."""
    total = np.zeros((len(mask) + length, mask.shape[1]), dtype=np.int64)
    np.cumsum(mask, axis=0, out=total[1 : len(mask) + 1])
    total[len(mask) + 1 :] = total[len(mask)]
    return total[length : length + len(mask)] - total[: len(mask)]
