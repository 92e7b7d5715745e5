"""The lattice of nosings: nosing k lies at (s0 + k·run, z0 + k·rise) with integer k.

A step that was not seen leaves a gap in k and changes nothing else, which is where the
report's average over adjacent clusters fails (docs/method.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.config import EnvelopeConfig

MAX_MISSED = 2
"""How many steps in a row may be missed between two that found a lattice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NosingGroups:
    """Nosings of neighbouring scans that are one edge.

    Attributes
    ----------
    distance, height
        (N,) mean s and z, m.
    strips
        (N, num_strips) in which strips each was seen.
    """

    distance: Float64Array
    height: Float64Array
    strips: Mask

    def __len__(self) -> int:
        return len(self.distance)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """A lattice of nosings in one frame, in the vertical plane along its heading, m.

    Attributes
    ----------
    distance, height
        s and z of nosing 0, the lowest one seen.
    run
        Positive where the stairs ascend away from the camera, negative where they descend.
    rise
        Always positive.
    indices
        (M,) indices of the nosings found, ascending, the first 0.
    strips
        (num_strips,) where nosings were found.
    """

    distance: float
    height: float
    run: float
    rise: float
    indices: IntArray
    strips: Mask


def group_nosings(nosings: Float64Array, *, num_strips: int, noise: float) -> NosingGroups:
    """Join nosings of neighbouring strips that lie close together.

    Parameters
    ----------
    nosings
        (N, 3) distance s, height z (m) and strip.
    num_strips
        Number of strips of the elevation.
    noise
        Standard deviation of inverse distance in a strip, 1/m.
    """
    if len(nosings) == 0:
        return NosingGroups(distance=np.zeros(0), height=np.zeros(0), strips=np.zeros((0, num_strips), bool))
    distance, height, strip = nosings.T
    tolerance = 0.035 + 2.0 * noise * distance**2
    close = (
        (np.abs(distance[:, None] - distance) < np.minimum(tolerance, 0.09))
        & (np.abs(height[:, None] - height) < np.minimum(tolerance, 0.05))
        & (np.abs(strip[:, None] - strip) <= 2)
    )
    label = _connected(close)
    count = int(label.max()) + 1
    size = np.bincount(label, minlength=count)
    strips = np.zeros((count, num_strips), dtype=bool)
    strips[label, strip.astype(np.int64)] = True
    keep = strips.sum(axis=1) >= 2
    return NosingGroups(
        distance=(np.bincount(label, distance, count) / size)[keep],
        height=(np.bincount(label, height, count) / size)[keep],
        strips=strips[keep],
    )


def nearest_indices(
    nosings: Float64Array, distance: float, height: float, run: float, rise: float, *, max_along: float
) -> IntArray:
    """Return which nosing of a lattice each of some points lies at.

    Parameters
    ----------
    nosings
        (N, 3) points of which s and z, m, are looked at.
    distance, height, run, rise
        The lattice, m.
    max_along
        How far from the nosing a point lies at most along s, in runs; along z it is 0.3 rises.

    Returns
    -------
    (N,) indices; -1 for points at none, or before the first.
    """
    s, z = nosings[:, 0] - distance, nosings[:, 1] - height
    index = np.rint((s * run + z * rise) / (run**2 + rise**2))
    near = (np.abs(s - index * run) < max_along * abs(run)) & (np.abs(z - index * rise) < 0.3 * rise)
    return np.where(near, np.maximum(index, -1), -1).astype(np.int64)


def _connected(close: Mask) -> IntArray:
    """Number the connected components of a symmetric (N, N) relation; returns (N,).

    As ``scipy.sparse.csgraph.connected_components``, which takes three times as long for some ten nosings.
    """
    label = np.arange(len(close))
    while True:
        lowest = np.where(close, label, len(close)).min(axis=1)
        lowest = lowest[lowest]
        if np.array_equal(lowest, label):
            break
        label = lowest
    return np.asarray(np.unique(label, return_inverse=True)[1])


def find_lattices(
    groups: NosingGroups,
    envelope: EnvelopeConfig,
    *,
    view_sign: int,
    noise: float,
    max_lattices: int = 3,
) -> list[Lattice]:
    """Search the lattices that explain most nosings, best first.

    Every pair of groups that overlap laterally is tried as neighbours, and as having one or
    two missed steps between them. A hypothesis scores the strips of the nosings on it, one
    nosing per index, less half a nosing for each gap. A group serves one lattice only.

    Parameters
    ----------
    groups
        Nosings.
    envelope
        Dimensions a stairway may have; they are widened by a tenth here, since a pair of
        nosings measures less well than the lattice that follows.
    view_sign
        +1: stairs that ascend away from the camera; -1: that descend away from it.
    noise
        Standard deviation of inverse distance in a strip, 1/m.
    max_lattices
        How many are returned at most.
    """
    found: list[Lattice] = []
    free = np.ones(len(groups), dtype=bool)
    while len(found) < max_lattices:
        lattice, used = _find_best(groups, free, envelope, view_sign, noise)
        if lattice is None:
            break
        found.append(lattice)
        free &= ~used
    return found


def _find_best(
    groups: NosingGroups, free: Mask, envelope: EnvelopeConfig, view_sign: int, noise: float
) -> tuple[Lattice | None, Mask]:
    none = (None, np.zeros(len(groups), dtype=bool))
    if np.count_nonzero(free) < 2:
        return none
    distance, height = groups.distance, groups.height
    overlap = groups.strips.astype(np.int64) @ groups.strips.T.astype(np.int64)
    lower, upper = np.nonzero(
        (height[None, :] - height[:, None] > 0.8 * envelope.min_rise)
        & (overlap >= 2)
        & free[:, None]
        & free[None, :]
    )
    steps = np.arange(1, MAX_MISSED + 2)
    run = ((distance[upper] - distance[lower])[:, None] / steps).ravel()
    rise = ((height[upper] - height[lower])[:, None] / steps).ravel()
    anchor = np.repeat(lower, len(steps))
    pitch = np.degrees(np.arctan2(rise, np.abs(run)))
    allowed = (
        (rise > 0.9 * envelope.min_rise)
        & (rise < 1.1 * envelope.max_rise)
        & (view_sign * run > 0.9 * envelope.min_run)
        & (view_sign * run < 1.1 * envelope.max_run)
        & (pitch > envelope.min_pitch_deg - 3.0)
        & (pitch < envelope.max_pitch_deg + 3.0)
    )
    if not allowed.any():
        return none
    run, rise, anchor = run[allowed], rise[allowed], anchor[allowed]
    along_s = distance[None, :] - distance[anchor][:, None]
    along_z = height[None, :] - height[anchor][:, None]
    index = np.rint((along_s * run[:, None] + along_z * rise[:, None]) / (run**2 + rise**2)[:, None])
    spread = np.minimum(2.0 * noise * distance**2, 0.05)
    # The error of a pair's run and rise grows with the index away from it.
    growth = 1.0 + 0.15 * np.abs(index)
    fits = (
        (np.abs(along_s - index * run[:, None]) < (0.035 + spread) * growth)
        & (np.abs(along_z - index * rise[:, None]) < (0.025 + 0.5 * spread) * np.minimum(growth, 2.0))
        & free[None, :]
        & (overlap[anchor] >= 1)
        & (np.abs(index) < 32)
    )
    size = np.minimum(groups.strips.sum(axis=1), 12).astype(np.float64)
    best_per_index = np.zeros((len(run), 64))
    rows, columns = np.nonzero(fits)
    np.maximum.at(best_per_index, (rows, (index[rows, columns] + 32).astype(np.int64)), size[columns])
    present = best_per_index > 0
    first = np.argmax(present, axis=1)
    last = 63 - np.argmax(present[:, ::-1], axis=1)
    num_present = present.sum(axis=1)
    num_gaps = last - first + 1 - num_present
    typical = best_per_index.sum(axis=1) / num_present
    score = best_per_index.sum(axis=1) - 0.5 * num_gaps * typical
    best = int(np.argmax(score))
    if num_present[best] < 2:
        return none
    inliers = fits[best]
    indices = np.unique(index[best, inliers]).astype(np.int64)
    k = index[best, inliers]
    weight = groups.strips[inliers].sum(axis=1).astype(np.float64)
    best_run, start_s = _fit_line(k, distance[inliers], weight, float(run[best]))
    best_rise, start_z = _fit_line(k, height[inliers], weight, float(rise[best]))
    lowest = int(indices[0])
    lattice = Lattice(
        distance=start_s + lowest * best_run,
        height=start_z + lowest * best_rise,
        run=best_run,
        rise=best_rise,
        indices=indices - lowest,
        strips=groups.strips[inliers].any(axis=0),
    )
    return lattice, inliers


def _fit_line(
    index: Float64Array, value: Float64Array, weight: Float64Array, fallback: float
) -> tuple[float, float]:
    """Weighted line value = start + index * step; the step falls back where only one index is there."""
    mean_index = float(np.average(index, weights=weight))
    mean_value = float(np.average(value, weights=weight))
    spread = float(np.average((index - mean_index) ** 2, weights=weight))
    if spread < 1e-9:
        return fallback, mean_value - mean_index * fallback
    step = float(np.average((index - mean_index) * (value - mean_value), weights=weight)) / spread
    return step, mean_value - mean_index * step
