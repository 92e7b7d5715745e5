"""Nosings as segments in space: how far each step reaches to either side, and whether its end was seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.refinement import RefinedLattice

MAX_BRIDGE = 0.20
"""Gaps in a step up to this width, m, are bridged: balusters, a foot, a bag."""

END_OFFSETS = (2, 4, 7, 11)
"""How many pixels beyond an end are looked at, in this order, until one is valid: a projector's shadow
hides the first few."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepExtents:
    """Lateral extents of each step, m to the left of the camera's sagittal plane; all (num_nosings,).

    Attributes
    ----------
    left, right
        Ends of the step; NaN where it was not seen.
    left_bounded, right_bounded
        Whether the step's own end was seen there, not the image's border or an occlusion.
    """

    left: Float64Array
    right: Float64Array
    left_bounded: Mask
    right_bounded: Mask


def measure_extents(image: InverseDepthImage, lattice: RefinedLattice) -> StepExtents:
    """Measure how far each step reaches to either side.

    The lateral footprints of a step's pixels are summed over t in bins a little wider than a
    pixel; the step ends where the sum falls to half of its median. A pixel on a side wall has
    no footprint along t, so walls add nothing.
    """
    num_nosings = len(lattice.nosings.num_tread_pixels)
    member = lattice.members.tread | lattice.members.riser
    index = lattice.members.index[member]
    t = lattice.pixels.left[member].astype(np.float64)
    footprint = _footprints(lattice, 1.5 / image.camera.fx)[member]
    left, right = np.full(num_nosings, np.nan), np.full(num_nosings, np.nan)
    if len(t):
        typical = lattice.distance + 0.5 * num_nosings * lattice.run
        bin_width = max(0.012, 1.3 * max(typical, 0.3) / image.camera.fx)
        start = float(t.min()) - 2 * bin_width
        num_bins = int((float(t.max()) - start) / bin_width) + 3
        cell = ((t - start) / bin_width).astype(np.int64)
        total = np.bincount(index * num_bins + cell, footprint, minlength=num_nosings * num_bins)
        counts = np.asarray(total.reshape(num_nosings, num_bins), dtype=np.float64)
        smooth, plateau = _plateaus(counts)
        enough = (np.bincount(index, minlength=num_nosings) >= 6) & (plateau > 0)
        for nosing in np.flatnonzero(enough):
            ends = _find_ends(smooth[nosing], float(plateau[nosing]), round(MAX_BRIDGE / bin_width))
            if ends is not None:
                right[nosing], left[nosing] = start + bin_width * ends[0], start + bin_width * ends[1]
    left_bounded = _is_bounded(image, lattice, left, side=1)
    right_bounded = _is_bounded(image, lattice, right, side=-1)
    return StepExtents(left=left, right=right, left_bounded=left_bounded, right_bounded=right_bounded)


def _footprints(lattice: RefinedLattice, limit: float) -> Float64Array:
    """Lateral distance that each pixel stands for, from its neighbours in the row, m; may be negative.

    ``limit`` times the pixel's distance bounds it: what lies behind an edge has no share in it.
    """
    pixels = lattice.pixels
    following = np.append(np.diff(pixels.left), 0.0)
    adjacent = np.append((np.diff(pixels.row) == 0) & (np.diff(pixels.column) == 1), False)
    forward_step = np.where(adjacent, following, 0.0)
    backward_step = np.append(0.0, forward_step[:-1])
    both = adjacent & np.append(False, adjacent[:-1])
    steps = np.where(both, 0.5 * (forward_step + backward_step), forward_step + backward_step)
    sign = -1.0 if np.cross(lattice.up, lattice.forward)[0] < 0 else 1.0
    bound = limit * pixels.forward
    return np.asarray(np.clip(sign * steps, -bound, bound), dtype=np.float64)


def _plateaus(counts: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Smooth the (num_nosings, num_bins) counts and return them with the level of a filled bin of each."""
    smooth = 0.5 * counts
    smooth[:, 1:] += 0.25 * counts[:, :-1]
    smooth[:, :-1] += 0.25 * counts[:, 1:]
    descending = -np.sort(-smooth, axis=1)
    rows = np.arange(len(counts))
    num_positive = np.count_nonzero(descending > 0, axis=1)
    high = descending[rows, num_positive // 10]
    num_filled = np.count_nonzero(descending > 0.3 * high[:, None], axis=1)
    return smooth, np.where(num_positive > 0, descending[rows, num_filled // 2], 0.0)


def _find_ends(smooth: Float64Array, plateau: float, max_gap: int) -> tuple[float, float] | None:
    """Ends of the longest run of filled bins, in bins, to a fraction of one."""
    filled = np.flatnonzero(smooth >= 0.5 * plateau)
    if len(filled) < 3:
        return None
    breaks = np.flatnonzero(np.diff(filled) > max_gap + 1)
    starts = filled[np.append(0, breaks + 1)]
    ends = filled[np.append(breaks, len(filled) - 1)]
    longest = int(np.argmax(ends - starts))
    first, last = int(starts[longest]), int(ends[longest])

    def beyond(inner: int, outer: int) -> float:
        inside, outside = smooth[inner], smooth[outer] if 0 <= outer < len(smooth) else 0.0
        return float((inside - 0.5 * plateau) / max(inside - outside, 1e-9))

    # Bin centres are half a bin from their edges; the crossing lies between two centres.
    low = first + 0.5 - min(beyond(first, first - 1), 1.0)
    high = last + 0.5 + min(beyond(last, last + 1), 1.0)
    return low, high


def _is_bounded(
    image: InverseDepthImage, lattice: RefinedLattice, ends: Float64Array, *, side: int
) -> NDArray[np.bool_]:
    """Tell for each step whether its end on one side (+1 left, -1 right) was seen.

    Beyond a seen end lies something farther, or a wall that starts there. Beyond an end that
    was cut lies the image's border, nothing measured, or something nearer.
    """
    members, pixels = lattice.members, lattice.pixels
    num_nosings = len(ends)
    member = members.tread | members.riser
    with np.errstate(invalid="ignore"):
        inward = side * (ends[members.index.clip(0, num_nosings - 1)] - pixels.left)
        chosen = np.flatnonzero(member & (inward > -0.02) & (inward < 0.05))
    if len(chosen) == 0:
        return np.zeros(num_nosings, dtype=bool)
    index = members.index[chosen]
    camera = image.camera
    left_axis = np.cross(lattice.up, lattice.forward)
    column_step = -side if left_axis[0] < 0 else side
    to_end = np.ceil(np.maximum(inward[chosen], 0) / pixels.forward[chosen] * camera.fx).astype(np.int64)
    q = np.zeros(len(chosen), dtype=np.float32)
    column = pixels.column[chosen]
    is_cut = np.zeros(len(chosen), dtype=bool)
    for offset in END_OFFSETS:
        looked_at = pixels.column[chosen] + column_step * (to_end + offset)
        outside = (looked_at < 0) | (looked_at >= camera.width)
        undecided = (q == 0) & ~is_cut
        is_cut |= undecided & outside
        value = image.inverse_depth[pixels.row[chosen], np.clip(looked_at, 0, camera.width - 1)]
        take = undecided & ~outside & (value > 0)
        q[take], column[take] = value[take], looked_at[take]
    known = q > 0
    depth = 1.0 / np.where(known, q, 1.0)
    rays = np.stack(
        [
            (column - camera.cx) / camera.fx,
            (pixels.row[chosen] - camera.cy) / camera.fy,
            np.ones(len(chosen)),
        ],
        axis=1,
    )
    s, z, t = ((rays @ axis) * depth for axis in (lattice.forward, lattice.up, left_axis))
    slope = z / np.maximum(s, 1e-6)
    tread_height = lattice.height + index * lattice.rise
    with np.errstate(divide="ignore", invalid="ignore"):
        on_tread = np.where(np.abs(slope) > 1e-3, tread_height / slope, np.inf)
    expected = np.where(members.tread[chosen], on_tread, lattice.distance + index * lattice.run)
    tolerance = 0.05 + 0.01 * s**2
    beyond = side * (t - ends[index])
    is_farther = known & (s > expected + tolerance)
    is_wall = known & (s < expected) & (beyond > -0.05) & (beyond < 0.10)
    is_occluded = known & ~is_farther & ~is_wall
    bounded = np.bincount(index[is_farther | is_wall], minlength=num_nosings)
    unbounded = np.bincount(index[is_occluded | is_cut], minlength=num_nosings)
    return np.asarray((bounded > 2 * unbounded) & (bounded >= 3))


def choose_nosings(lattice: RefinedLattice, extents: StepExtents) -> IntArray:
    """Return the indices of the nosings that were seen, ascending.

    A nosing needs its riser, or its tread with a jump at its front; a floor or landing is
    a tread without either. Steps must overlap the widest one by a third of its width. Above a missed
    step the stairs go on only if something hides it; where one looks through it they end.
    """
    nosings = lattice.nosings
    is_front = np.isfinite(nosings.distance) & (nosings.num_tread_pixels > 0)
    width = extents.left - extents.right
    seen = nosings.is_seen & ((nosings.num_riser_pixels >= 8) | is_front) & np.isfinite(width)
    if not seen.any():
        return np.zeros(0, dtype=np.int64)
    weight = np.where(seen, nosings.num_riser_pixels + nosings.num_tread_pixels, 0)
    main = int(np.argmax(weight * np.nan_to_num(width)))
    overlap = np.minimum(extents.left, extents.left[main]) - np.maximum(extents.right, extents.right[main])
    with np.errstate(invalid="ignore"):
        seen &= overlap > 0.33 * width[main]
    inside = np.bincount(
        np.clip(lattice.members.index[lattice.members.inside], 0, len(seen) - 1), minlength=len(seen)
    )
    chosen = [main]
    for direction in (1, -1):
        index, missed = main + direction, 0
        while 0 <= index < len(seen) and missed <= 1:
            if seen[index]:
                chosen.append(index)
                missed = 0
            elif inside[index] * lattice.row_step > 0.3 * weight[main] / 4:
                break
            else:
                missed += 1
            index += direction
    return np.array(sorted(chosen), dtype=np.int64)
