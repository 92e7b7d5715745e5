"""Join corners of neighbouring scans, and score lattices of what was joined."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length

LatticeScore: TypeAlias = tuple[float, float, int, float, int]
"""Run, rise, anchor, score and number of indices; the anchor is -1 where there is no lattice."""


class LatticeLimits(NamedTuple):
    """What a pair of nosings must be to suggest a lattice, and what lies on it.

    ``min_rise`` to ``max_pitch``: dimensions, m and rad. ``max_steps``: so many steps apart a pair may be.
    ``min_shared``: strips in which both are seen. ``max_distance``, ``max_height``: farthest from its place
    that a nosing lies on a lattice, m; ``noise`` of inverse distance adds to it, 1/m, by ``max_spread`` at
    most, and ``growth`` for each step from the pair. ``max_index``: steps that are counted. ``gap_cost``: of
    a step that is missed, in scores of a typical nosing.
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
    gap_cost: float


def label_close(
    corners: tuple[Float64Array, Float64Array, IntArray],
    reach: tuple[Float64Array, Float64Array],
    max_gap: int,
) -> IntArray:
    """Number the groups of corners that hang together.

    Parameters
    ----------
    corners
        (N,) distance, height and strip of each, m.
    reach
        (N,) how far others may lie off in distance and in height, m; the farther reach of two counts.
    max_gap
        Most strips between two.

    Returns
    -------
    (N,) number of each corner's group, counted in the order of their first corners.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    distance, height, strip = check_arrays(corners, "corners", (np.float64, np.float64, np.int64))
    reaches = check_arrays(reach, "reach", (np.float64, np.float64))
    check_length(reaches[0], "reach[0]", len(distance))
    if len(distance) == 0:
        return np.zeros(0, dtype=np.int64)
    close = (
        (np.abs(distance[:, None] - distance) < reaches[0])
        & (np.abs(height[:, None] - height) < reaches[1])
        & (np.abs(strip[:, None] - strip) <= max_gap)
    )
    labels = connected_components(csr_matrix(close), directed=False)[1]
    return np.asarray(labels, dtype=np.int64)


def lattice_indices(
    along: tuple[Float64Array, Float64Array], step: tuple[float | Float64Array, float | Float64Array]
) -> Float64Array:
    """Return the whole number of steps (run, rise) that comes nearest to places (s, z) from an anchor."""
    (s, z), (run, rise) = along, step
    return np.asarray(np.rint((s * run + z * rise) / (run**2 + rise**2)))


def score_lattices(
    places: tuple[Float64Array, Float64Array, Float64Array],
    strips: Mask,
    free: Mask,
    limits: LatticeLimits,
) -> LatticeScore:
    """Score the lattices that pairs of nosings suggest, and return the best.

    Every pair that is seen in the same strips is tried as neighbours, and as having missed steps between
    them. A lattice scores the sizes of the nosings on it, the largest one for each index, less a share of a
    typical one for each gap.

    Parameters
    ----------
    places
        (N,) distance and height of each nosing, m, and its size.
    strips
        (N, S) in which strips each was seen.
    free
        (N,) which of them may be used.
    limits
        What suggests a lattice, and what lies on it.

    Returns
    -------
    Its run and rise, m, the nosing with index 0, its score, and how many indices it has.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    distance, height, size = check_arrays(places, "places", (np.float64,) * 3)
    check_array(strips, "strips", np.bool_, 2)
    check_array(free, "free", np.bool_, 1)
    check_length(strips, "strips", len(distance))
    check_length(free, "free", len(distance))
    limits = LatticeLimits(*limits)
    none = (0.0, 0.0, -1, 0.0, 0)
    if len(distance) == 0:
        return none
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


def find_members(
    places: tuple[Float64Array, Float64Array],
    lattice: tuple[float, float, int],
    limits: LatticeLimits,
) -> tuple[Mask, Float64Array]:
    """Return which of (N,) nosings lie on a lattice of run, rise and anchor, and the index of each."""
    run, rise, anchor = lattice
    step = np.array([run]), np.array([rise]), np.array([anchor])
    fits, index = _members(*places, step, limits)
    return fits[0], index[0]


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
