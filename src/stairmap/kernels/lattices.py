"""Join corners of neighbouring scans, and search the lattices on which what was joined lies."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length, check_strips

Nosings: TypeAlias = tuple[Float64Array, Float64Array, Mask]
"""(N,) distance and height of each nosing, m, and (N, S) in which strips it was seen."""

Lattices: TypeAlias = tuple[Float64Array, Mask, Mask]
"""(L, 5) distance, height, run, rise and score, (L, K) which indices were found, (L, S) in which strips."""


class JoinLimits(NamedTuple):
    """What corners of one edge are.

    They lie within ``reach`` of each other, and farther by ``noise`` times the square of their distance, m,
    but never farther than ``max_distance`` and ``max_height``, and at most ``max_gap`` strips apart. An edge
    is seen in ``min_strips`` at least.
    """

    reach: float
    noise: float
    max_distance: float
    max_height: float
    max_gap: int
    min_strips: int


class LatticeLimits(NamedTuple):
    """What a pair of nosings must be to suggest a lattice, and what lies on it.

    ``min_rise`` to ``max_pitch``: dimensions, m and rad. ``max_steps``: so many steps apart a pair may be.
    ``min_shared``: strips in which both are seen. ``max_distance``, ``max_height``: farthest from its place
    that a nosing lies on a lattice, m; ``noise`` of inverse distance adds to it, 1/m, by ``max_spread`` at
    most, and ``growth`` for each step from the pair. ``max_index``: steps that are counted. ``max_size``:
    most strips of a nosing that are. ``gap_cost``: of a step that is missed, in scores of a typical nosing;
    ``max_gap``: so many may be missed on end.
    """

    min_rise: float
    max_rise: float
    min_run: float
    max_run: float
    min_pitch: float
    max_pitch: float
    max_steps: int
    min_shared: int
    max_distance: float
    max_height: float
    noise: float
    max_spread: float
    growth: float
    max_index: int
    max_size: int
    gap_cost: float
    max_gap: int


def join_corners(
    corners: tuple[Float64Array, Float64Array, IntArray], num_strips: int, limits: JoinLimits
) -> Nosings:
    """Join the corners that hang together.

    Parameters
    ----------
    corners
        (N,) distance, height and strip of each, m.
    num_strips
        Number of strips.
    limits
        What hangs together; the farther reach of two counts.

    Returns
    -------
    distance, height
        (M,) means of each group, m, in the order of their first corners.
    strips
        (M, num_strips) in which strips each was seen.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    distance, height, strip = check_arrays(corners, "corners", (np.float64, np.float64, np.int64))
    check_strips(strip, "corners[2]", num_strips)
    limits = JoinLimits(*limits)
    if len(distance) == 0:
        return np.zeros(0), np.zeros(0), np.zeros((0, num_strips), dtype=bool)
    reach = limits.reach + limits.noise * distance**2
    along, upward = np.minimum(reach, limits.max_distance), np.minimum(reach, limits.max_height)
    close = (
        (np.abs(distance[:, None] - distance) < along)
        & (np.abs(height[:, None] - height) < upward)
        & (np.abs(strip[:, None] - strip) <= limits.max_gap)
    )
    label = _label_connected(close | close.T)
    size = np.bincount(label)
    strips = np.zeros((len(size), num_strips), dtype=bool)
    strips[label, strip] = True
    keep = strips.sum(axis=1) >= limits.min_strips
    mean_distance, mean_height = (np.bincount(label, values) / size for values in (distance, height))
    return mean_distance[keep], mean_height[keep], strips[keep]


def _label_connected(close: Mask) -> IntArray:
    """(N,) numbers of the sets that hang together, counted in the order of their first members."""
    first = np.arange(len(close))
    while True:
        # Each takes the earliest of its neighbours, and what that one has found.
        earlier = np.where(close, first, len(close)).min(axis=1)
        earlier = np.minimum(earlier, first)
        earlier = earlier[earlier]
        if np.array_equal(earlier, first):
            return np.asarray(np.unique(first, return_inverse=True)[1], dtype=np.int64)
        first = earlier


def lattice_indices(
    along: tuple[Float64Array, Float64Array], step: tuple[float | Float64Array, float | Float64Array]
) -> Float64Array:
    """Return the whole number of steps (run, rise) that comes nearest to places (s, z) from an anchor."""
    (s, z), (run, rise) = along, step
    return np.asarray(np.rint((s * run + z * rise) / (run**2 + rise**2)))


def search_lattices(nosings: Nosings, limits: LatticeLimits, max_lattices: int) -> Lattices:
    """Search the lattices that explain most nosings, best first.

    Every pair that is seen in the same strips is tried as neighbours, and as having missed steps between
    them. A lattice scores the strips of the nosings on it, the largest number for each index, less a share of
    a typical one for each gap. A nosing serves one lattice only.

    Parameters
    ----------
    nosings
        What may lie on them.
    limits
        What suggests a lattice, and what lies on it.
    max_lattices
        How many are returned at most.

    Returns
    -------
    Of each the line through its nosings, which indices were found, counted from the first one, and in which
    strips; K is twice the limit of indices.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    if len(nosings) != 3:
        raise ValueError(f"nosings: expected three arrays, got {len(nosings)}")
    distance = check_array(nosings[0], "nosings[0]", np.float64, 1)
    height = check_array(nosings[1], "nosings[1]", np.float64, 1)
    strips = check_array(nosings[2], "nosings[2]", np.bool_, 2)
    check_length(height, "nosings[1]", len(distance))
    check_length(strips, "nosings[2]", len(distance))
    limits = LatticeLimits(*limits)
    if limits.max_index < 1:
        raise ValueError("limits: expected at least one index, got none")
    free = np.ones(len(distance), dtype=bool)
    size = np.minimum(strips.sum(axis=1), limits.max_size).astype(np.float64)
    numbers: list[tuple[float, float, float, float, float]] = []
    presence: list[Mask] = []
    seen: list[Mask] = []
    while len(numbers) < max_lattices and np.count_nonzero(free) >= 2:
        run, rise, anchor, score, num_present = _best_pair((distance, height, size), strips, free, limits)
        if num_present < 2:
            break
        step = np.array([run]), np.array([rise]), np.array([anchor])
        fits, index = (values[0] for values in _members(distance, height, step, limits))
        inliers = fits & free & (strips & strips[anchor]).any(axis=1)
        part = _largest_part(index, inliers, size, limits)
        if part is not None:
            inliers, score = part
        place = index[inliers].astype(np.int64)
        place -= place.min()
        weight = strips[inliers].sum(axis=1).astype(np.float64)
        best_run, start_s = _fit_line(place, distance[inliers], weight, run)
        best_rise, start_z = _fit_line(place, height[inliers], weight, rise)
        is_present = np.zeros(2 * limits.max_index, dtype=bool)
        is_present[place] = True
        numbers.append((start_s, start_z, best_run, best_rise, score))
        presence.append(is_present)
        seen.append(strips[inliers].any(axis=0))
        free &= ~inliers
    num_strips, num_found = strips.shape[1], len(numbers)
    return (
        np.array(numbers).reshape(num_found, 5),
        np.array(presence, dtype=bool).reshape(num_found, 2 * limits.max_index),
        np.array(seen, dtype=bool).reshape(num_found, num_strips),
    )


def _best_pair(
    places: tuple[Float64Array, Float64Array, Float64Array], strips: Mask, free: Mask, limits: LatticeLimits
) -> tuple[float, float, int, float, int]:
    """Run, rise, anchor, score and number of indices of the best lattice; the anchor is -1 without one."""
    distance, height, size = places
    none = (0.0, 0.0, -1, 0.0, 0)
    overlap = strips.astype(np.int64) @ strips.T.astype(np.int64)
    lower, upper = np.nonzero(
        (height[None, :] - height[:, None] > limits.min_rise)
        & (overlap >= limits.min_shared)
        & free[:, None]
        & free[None, :]
    )
    steps = np.arange(1, limits.max_steps + 1)
    run = ((distance[upper] - distance[lower])[:, None] / steps).ravel()
    rise = ((height[upper] - height[lower])[:, None] / steps).ravel()
    anchor = np.repeat(lower, len(steps))
    pitch = np.arctan2(rise, np.abs(run))
    allowed = (rise > limits.min_rise) & (rise < limits.max_rise)
    allowed &= (np.abs(run) > limits.min_run) & (np.abs(run) < limits.max_run)
    allowed &= (pitch > limits.min_pitch) & (pitch < limits.max_pitch)
    if not allowed.any():
        return none
    run, rise, anchor = run[allowed], rise[allowed], anchor[allowed]
    fits, index = _members(distance, height, (run, rise, anchor), limits)
    fits &= free[None, :] & (overlap[anchor] >= 1)
    most = limits.max_index
    best_per_index = np.zeros((len(run), 2 * most))
    rows, columns = np.nonzero(fits)
    np.maximum.at(best_per_index, (rows, (index[rows, columns] + most).astype(np.int64)), size[columns])
    present = best_per_index > 0
    first = np.argmax(present, axis=1)
    last = 2 * most - 1 - np.argmax(present[:, ::-1], axis=1)
    num_present = present.sum(axis=1)
    total = best_per_index.sum(axis=1)
    num_gaps = last - first + 1 - num_present
    score = total - limits.gap_cost * num_gaps * (total / np.maximum(num_present, 1))
    best = int(np.argmax(score))
    return float(run[best]), float(rise[best]), int(anchor[best]), float(score[best]), int(num_present[best])


def _largest_part(
    index: Float64Array, inliers: Mask, size: Float64Array, limits: LatticeLimits
) -> tuple[Mask, float] | None:
    """Which nosings are of the largest part of a lattice without long gaps, and its score; ``None`` where
    nothing is left out."""
    places = np.unique(index[inliers])
    best = np.array([size[inliers & (index == place)].max() for place in places])
    part = np.cumsum(np.diff(places, prepend=places[0]) > limits.max_gap + 1)
    total = np.bincount(part, best) * (np.bincount(part) > 1)
    if len(total) == 1 or not total.any():
        return None
    chosen = part == int(np.argmax(total))
    num_gaps = places[chosen][-1] - places[chosen][0] + 1 - np.count_nonzero(chosen)
    score = float(best[chosen].sum() - limits.gap_cost * num_gaps * best[chosen].mean())
    return inliers & np.isin(index, places[chosen]), score


def _fit_line(
    index: IntArray, value: Float64Array, weight: Float64Array, fallback: float
) -> tuple[float, float]:
    """Step and start of the weighted line value = start + index * step; the step falls back where only one
    index is there."""
    mean_index = float(np.average(index, weights=weight))
    mean_value = float(np.average(value, weights=weight))
    spread = float(np.average((index - mean_index) ** 2, weights=weight))
    if spread < 1e-9:
        return fallback, mean_value - mean_index * fallback
    step = float(np.average((index - mean_index) * (value - mean_value), weights=weight)) / spread
    return step, mean_value - mean_index * step


def _members(
    distance: Float64Array,
    height: Float64Array,
    lattices: tuple[Float64Array, Float64Array, IntArray],
    limits: LatticeLimits,
) -> tuple[Mask, Float64Array]:
    """(H, N) which nosings lie on which lattices, and their indices."""
    run, rise, anchor = lattices
    along_s = distance[None, :] - distance[anchor][:, None]
    along_z = height[None, :] - height[anchor][:, None]
    index = lattice_indices((along_s, along_z), (run[:, None], rise[:, None]))
    spread = np.minimum(2.0 * limits.noise * distance**2, limits.max_spread)
    growth = 1.0 + limits.growth * np.abs(index)
    fits = (
        (np.abs(along_s - index * run[:, None]) < (limits.max_distance + spread) * growth)
        & (
            np.abs(along_z - index * rise[:, None])
            < (limits.max_height + 0.5 * spread) * np.minimum(growth, 2.0)
        )
        & (np.abs(index) < limits.max_index)
    )
    return fits, index
