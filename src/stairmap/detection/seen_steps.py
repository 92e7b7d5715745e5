"""Which steps of a lattice were seen: not what a floor, a landing or a wall looks like from afar."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import IntArray, Mask
from stairmap.detection.edge_lines import StepExtents
from stairmap.detection.refinement import RefinedLattice
from stairmap.detection.stair_pixels import shown_riser_heights

MAX_ABOVE = 0.6
"""A riser with more than this share of the pixels that a wall would have between 0.2 and 0.8 of a rise above
its nosing is one."""

SIDE_MARGIN = 0.05
"""How far inside a step's ends it is looked what goes on before it, m."""

MAX_STRAY = 0.045
"""Largest distance of a riser from the lattice beyond a pixel's noise, m: four times STEP_IRREGULARITY and
the overhang of a nosing."""


def choose_nosings(lattice: RefinedLattice, extents: StepExtents, turned: Mask) -> IntArray:
    """Return the indices of the nosings that were seen, ascending.

    A nosing needs its riser, or its tread with a jump at its front; a floor or landing is
    a tread without either, a wall behind it a riser without an end, or off the lattice. Steps must
    overlap the widest one by a third of its width and not be ``turned`` against the others. Above a
    missed step the stairs go on only if something hides it; where one looks through it they end.
    """
    nosings = lattice.nosings
    is_front = np.isfinite(nosings.distance) & (nosings.num_tread_pixels > 0)
    width = extents.left - extents.right
    is_front &= ~_goes_on_in_front(lattice, extents)
    strays = _strays(lattice)
    seen = (
        ~_goes_on_above(lattice)
        & ~strays
        & nosings.is_seen
        & ((nosings.num_riser_pixels >= 8) | is_front)
        & np.isfinite(width)
    )
    if not seen.any():
        return np.zeros(0, dtype=np.int64)
    weight = np.where(seen, nosings.num_riser_pixels + nosings.num_tread_pixels, 0)
    first, last = lattice.found
    if seen[first : last + 1].any():
        # A wall at the distance of a step that was only tried would outweigh the stairs.
        weight[:first], weight[last + 1 :] = 0, 0
    main = int(np.argmax(weight * np.nan_to_num(width)))
    overlap = np.minimum(extents.left, extents.left[main]) - np.maximum(extents.right, extents.right[main])
    with np.errstate(invalid="ignore"):
        seen &= overlap > 0.33 * width[main]
    seen &= ~turned
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


def _goes_on_in_front(lattice: RefinedLattice, extents: StepExtents) -> Mask:
    """(num_nosings,) whether a tread's level goes on in front of its nosing, as a floor does.

    Walls beside the stairs have pixels at every level.
    """
    x = (lattice.pixels.forward - np.float32(lattice.distance)) / np.float32(lattice.run)
    y = (lattice.pixels.height - np.float32(lattice.height)) / np.float32(lattice.rise)
    index = np.rint(y).astype(np.int64)
    num_nosings = len(lattice.nosings.num_tread_pixels)
    inside = (index >= 0) & (index < num_nosings) & (np.abs(y - index) < 0.15)
    inside &= (index - x > 0.15) & (index - x < 0.8)
    own = index.clip(0, num_nosings - 1)
    with np.errstate(invalid="ignore"):
        inside &= (lattice.pixels.left < extents.left[own] - SIDE_MARGIN) & (
            lattice.pixels.left > extents.right[own] + SIDE_MARGIN
        )
    in_front = np.bincount(index[inside], minlength=num_nosings) * lattice.row_step
    return np.asarray(in_front > 0.3 * lattice.nosings.num_tread_pixels)


def _strays(lattice: RefinedLattice) -> Mask:
    """(num_nosings,) whether a riser stands off the lattice by more than stairs and noise explain."""
    measured = lattice.nosings.distance
    expected = lattice.distance + np.arange(len(measured)) * lattice.run
    with np.errstate(invalid="ignore"):
        is_off = np.abs(measured - expected) > MAX_STRAY + lattice.noise * expected**2
    return np.asarray(is_off & ~lattice.nosings.distance_is_end)


def _goes_on_above(lattice: RefinedLattice) -> Mask:
    """(num_nosings,) whether a riser's surface goes on above its nosing, as a wall does."""
    x = (lattice.pixels.forward - np.float32(lattice.distance)) / np.float32(lattice.run)
    y = (lattice.pixels.height - np.float32(lattice.height)) / np.float32(lattice.rise)
    index = np.rint(x).astype(np.int64)
    num_nosings = len(lattice.nosings.num_riser_pixels)
    spread = lattice.noise * lattice.pixels.forward**2
    near = np.abs(x - index) * abs(lattice.run) < np.minimum(0.015 + 3.0 * spread, 0.3 * abs(lattice.run))
    above = (index >= 0) & (index < num_nosings) & near & (y - index > 0.2) & (y - index < 0.8)
    num_above = np.bincount(index[above], minlength=num_nosings) * lattice.row_step
    num_riser = lattice.nosings.num_riser_pixels
    if lattice.run < 0:
        return np.zeros(num_nosings, dtype=bool)
    shown = shown_riser_heights(lattice.distance, lattice.height, lattice.run, lattice.rise, num_nosings)
    # As many pixels in each millimetre of height above the nosing as below it make a wall.
    of_a_wall = num_riser * (0.8 - 0.2) * lattice.rise / np.maximum(shown, 0.05 * lattice.rise)
    return np.asarray((num_riser > 0) & (num_above > MAX_ABOVE * of_a_wall))
