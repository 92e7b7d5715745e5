"""Nosings as segments in space: how far each step reaches to either side, and whether its end was seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.ramps import MAX_RAMP, SHARP, find_crossings
from stairmap.detection.refinement import RefinedLattice
from stairmap.geometry import cross

MAX_BRIDGE = 0.20
"""Gaps in a step up to this width, m, are bridged: balusters, a foot, a bag."""

LOOK_OUTWARD = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.10, 0.125, 0.15])
"""How far past an end it is looked, m: stringers and rails are thinner than the last."""

MAX_RAMP_OFFSET = 0.08
"""How near to a step's end, m, its outermost pixel in a row must lie to show how sharp the end is."""

MIN_RAMP_DROP = 0.08
"""Smallest share by which inverse depth falls there."""

MIN_RAMP_ROWS = 8
"""Fewest rows on a side that tell how sharp ends are."""

MIN_RAMP = 0.75
"""Ends are moved outward where they lie more than this many pixels past the last one on the steps."""


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
    left_bounded, left_is_free = _is_bounded(image, lattice, left, side=1)
    right_bounded, right_is_free = _is_bounded(image, lattice, right, side=-1)
    # Where a sensor smooths, the last pixels before something farther lie no more on the step.
    ramp = min(_measure_ramp(image, lattice, left, side=1), _measure_ramp(image, lattice, right, side=-1))
    if ramp > MIN_RAMP:
        lost = ramp / image.camera.fx * (lattice.distance + np.arange(num_nosings) * lattice.run)
        left, right = left + lost * left_is_free, right - lost * right_is_free
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
    sign = -1.0 if cross(lattice.up, lattice.forward)[0] < 0 else 1.0
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


def _column_step(lattice: RefinedLattice, side: int) -> int:
    """Which way columns count towards a side (+1 left, -1 right) of the stairs."""
    return -side if cross(lattice.up, lattice.forward)[0] < 0 else side


def _measure_ramp(
    image: InverseDepthImage, lattice: RefinedLattice, ends: Float64Array, *, side: int
) -> float:
    """How many pixels past the steps' own their ends lie on one side (+1 left, -1 right) beyond a sharp edge.

    A side face that recedes looks like a ramp too, but is seen on one side only: the smaller of both
    sides is the sensor's.
    """
    members, pixels = lattice.members, lattice.pixels
    index = members.index.clip(0, len(ends) - 1)
    with np.errstate(invalid="ignore"):
        near_end = np.abs(ends[index] - pixels.left) < MAX_RAMP_OFFSET
    chosen = np.flatnonzero((members.tread | members.riser) & near_end)
    column_step = _column_step(lattice, side)
    # The outermost pixel of each row of each step.
    order = np.lexsort((column_step * pixels.column[chosen], pixels.row[chosen], index[chosen]))
    chosen = chosen[order]
    is_last = np.append((np.diff(pixels.row[chosen]) != 0) | (np.diff(index[chosen]) != 0), True)
    last = chosen[is_last[: len(chosen)]]
    columns = pixels.column[last, None] + column_step * np.arange(MAX_RAMP + 1)
    in_image = (columns >= 0) & (columns < image.camera.width)
    q = image.inverse_depth[pixels.row[last, None], np.clip(columns, 0, image.camera.width - 1)]
    below = np.where(in_image & (q > 0), 1.0 - q / q[:, :1], np.nan).astype(np.float64)
    is_jump = np.nan_to_num(below).max(axis=1) > MIN_RAMP_DROP
    if np.count_nonzero(is_jump) < MIN_RAMP_ROWS:
        return 0.0
    return float(np.median(find_crossings(below[is_jump]))) - SHARP


def _is_bounded(
    image: InverseDepthImage, lattice: RefinedLattice, ends: Float64Array, *, side: int
) -> tuple[Mask, Mask]:
    """Tell for each step whether its end on one side (+1 left, -1 right) was seen, and whether free before
    something farther rather than at a wall.

    The pixels near an end look outward along their row. An end was seen when something farther
    follows, or a wall that stands at the end. It was not when the image ends there, when
    something nearer hides it, or when that is a stringer or a rail, past which one sees farther again.
    """
    members, pixels = lattice.members, lattice.pixels
    num_nosings = len(ends)
    with np.errstate(invalid="ignore"):
        inward = side * (ends[members.index.clip(0, num_nosings - 1)] - pixels.left)
        near_end = (inward > -0.02) & (inward < 0.05)
    chosen = np.flatnonzero((members.tread | members.riser) & near_end)
    index = members.index[chosen]
    camera = image.camera
    left_axis = cross(lattice.up, lattice.forward)
    column_step = _column_step(lattice, side)
    distance = pixels.forward[chosen, None]
    outward = np.maximum(inward[chosen, None], 0) + LOOK_OUTWARD
    offset = np.ceil(outward / distance * camera.fx).astype(np.int64) + np.arange(len(LOOK_OUTWARD))
    column = pixels.column[chosen, None] + column_step * offset
    row = pixels.row[chosen, None]
    in_image = (column >= 0) & (column < camera.width)
    q = image.inverse_depth[row, np.clip(column, 0, camera.width - 1)] * in_image
    own = image.inverse_depth[row, pixels.column[chosen, None]]
    tolerance = (0.06 + 0.01 * distance**2) / distance
    is_nearer, is_farther = q > own * (1 + tolerance), (q > 0) & (q < own * (1 - tolerance))
    t = (
        left_axis[0] * (column - camera.cx) / camera.fx
        + left_axis[1] * (row - camera.cy) / camera.fy
        + left_axis[2]
    ) / np.where(q > 0, q, 1.0)
    past_end = side * (t - ends[index][:, None])
    is_wall = is_nearer & (past_end > -0.05) & (past_end < 0.10)

    never = len(LOOK_OUTWARD)
    first_nearer, first_farther, first_outside = (
        np.where(seen.any(axis=1), np.argmax(seen, axis=1), never)
        for seen in (is_nearer, is_farther, ~in_image)
    )
    seen_farther = (first_farther < first_nearer) & (first_farther < never)
    hidden = (first_nearer < never) & ~seen_farther
    at_wall = hidden & (first_farther == never) & (is_wall.sum(axis=1) > 0.5 * is_nearer.sum(axis=1))
    cut = ~seen_farther & ~hidden & (first_outside < never)
    bounded = np.bincount(index[seen_farther | at_wall], minlength=num_nosings)
    unbounded = np.bincount(index[(hidden & ~at_wall) | cut], minlength=num_nosings)
    free = np.bincount(index[seen_farther], minlength=num_nosings)
    return np.asarray((bounded > 2 * unbounded) & (bounded >= 3)), np.asarray(2 * free > bounded)
