"""Each nosing of a lattice measured by itself: height from its tread, distance from its riser.

Where the tread is hidden (above the camera) the height is where the riser ends; where there is
no riser (open, or seen from above) the distance is where the tread ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask, Points
from stairmap.detection.lattice import nearest_indices
from stairmap.detection.stair_pixels import Membership, StairPixels, shown_riser_heights

PIXELS_PER_SAMPLE = 12.0
"""Neighbouring pixels err together: so many count as one independent sample."""

MIN_SURFACE_PIXELS = 12
"""Fewest working pixels for a tread or riser to count as seen."""

EDGE_ROW_STD = 0.5
"""Standard deviation of a tread's height that is seen over ``CLEAN_TREAD_ROWS`` rows, working pixels."""

CLEAN_TREAD_ROWS = 5.0
"""The row at a nosing also shows what a sensor makes of edges: over so many rows it is diluted, over fewer
its share grows with the square."""

MIN_UPRIGHTNESS = 0.6
"""Least spread in height of a riser's pixels against their spread in depth beyond the noise, for its distance
to be used."""

MIN_SHOWN = 0.45
"""Share of a riser's height that must show, less the margins, for its distance to be used: of the others too
much is what a sensor makes of the edge before them."""

MIN_TREAD_ROWS = 2.0
"""A tread below the camera seen over fewer rows than this is not measured at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredNosings:
    """The nosings of a lattice, each measured by itself; all arrays (num_nosings,).

    Attributes
    ----------
    distance, height
        s and z, m; NaN where nothing measured it.
    distance_std, height_std
        Their standard deviations, m.
    num_tread_pixels, num_riser_pixels
        Working pixels that lie on its tread and on its riser.
    is_crease
        Whether tread and riser were both seen; otherwise it was seen as a jump.
    height_is_end, distance_is_end
        Whether the height (distance) is where a surface ends rather than where a tread (riser) is.
    """

    distance: Float64Array
    distance_std: Float64Array
    height: Float64Array
    height_std: Float64Array
    num_tread_pixels: IntArray
    num_riser_pixels: IntArray
    is_crease: Mask
    height_is_end: Mask
    distance_is_end: Mask

    @property
    def is_seen(self) -> Mask:
        """(num_nosings,) whether its tread or its riser was seen."""
        return np.asarray((self.num_tread_pixels + self.num_riser_pixels) >= MIN_SURFACE_PIXELS)


def measure_nosings(
    pixels: StairPixels,
    members: Membership,
    ends: Points,
    tread_ends: Points,
    *,
    distance: float,
    height: float,
    run: float,
    rise: float,
    noise: float,
    num_nosings: int,
    row_step: int,
    pixel_size: float,
    is_open: bool,
) -> MeasuredNosings:
    """Measure the nosings of a lattice.

    Parameters
    ----------
    pixels, members
        Pixels in the stairway's axes and where they belong.
    ends
        (M, 3) jumps in single strips: s, z, t, m.
    tread_ends
        The same of treads seen from above, from all pixels; used where there are no jumps.
    distance, height, run, rise
        The lattice, m.
    noise
        Standard deviation of inverse depth of a pixel, 1/m.
    num_nosings
        Nosings 0 to ``num_nosings - 1`` are measured.
    row_step
        Every so many rows were taken.
    pixel_size
        Size of a working pixel at 1 m, m.
    is_open
        Whether the risers are the fronts of slabs, too thin to tell by themselves whether they are upright.
    """
    index = np.arange(num_nosings)
    lattice_s, lattice_z = distance + index * run, height + index * rise
    # By where a pixel should be: by where it is, those that err nearer would weigh more.
    spread = noise * lattice_s[members.index.clip(0, num_nosings - 1)] ** 2
    slope = np.abs(pixels.height) / np.maximum(pixels.forward, 0.1)
    tread_z, tread_std, num_tread = _surface_means(
        pixels.height, members.tread, members.index, spread * slope, num_nosings, row_step
    )
    riser_s, riser_std, num_riser = _surface_means(
        pixels.forward, members.riser, members.index, spread, num_nosings, row_step
    )
    rows_of_tread = -np.abs(run) * lattice_z / np.maximum(lattice_s, 0.1) ** 2 / pixel_size
    tread_z[rows_of_tread < MIN_TREAD_ROWS] = np.nan
    edge = EDGE_ROW_STD * pixel_size * np.maximum(lattice_s, 0.1)
    dilution = CLEAN_TREAD_ROWS / np.maximum(rows_of_tread, MIN_TREAD_ROWS)
    tread_std = np.hypot(tread_std, edge * np.where(dilution > 1.0, dilution**2, dilution))

    owner = nearest_indices(ends, distance, height, run, rise, max_along=0.2)
    owned = ends[owner >= 0]
    owner = owner[owner >= 0]
    pixel = pixel_size * np.maximum(lattice_s, 0.1)
    end_z, end_z_std = _end_medians(owned[:, 1], owner, num_nosings, pixel)
    end_s, end_s_std = _end_medians(owned[:, 0], owner, num_nosings, 2.0 * pixel)
    if len(tread_ends):
        owner = nearest_indices(tread_ends, distance, height, run, rise, max_along=0.2)
        others, others_std = _end_medians(
            tread_ends[owner >= 0, 0], owner[owner >= 0], num_nosings, 2.0 * pixel
        )
        # All strips end in the same rows.
        row_spacing = row_step * pixel_size * lattice_s**2 / np.maximum(np.abs(lattice_z), 0.1)
        others_std = np.hypot(others_std, row_spacing / np.sqrt(12.0))
        is_new = np.isnan(end_s)
        end_s[is_new], end_s_std[is_new] = others[is_new], others_std[is_new]
    if is_open:
        # What lies in front of a slab's front or looks like it, a floor, has no upper end there.
        is_none = np.isnan(end_z)
        riser_s[is_none], num_riser = np.nan, np.where(is_none, 0, num_riser)
    else:
        is_upright = _is_upright(pixels, members, spread, num_nosings)
        # Above the camera too few rows may be left to tell a riser from a slope; below it this is a floor.
        num_riser = np.where(is_upright | (lattice_z > rise), num_riser, 0)
        if run > 0:
            shown = shown_riser_heights(distance, height, run, rise, num_nosings)
            is_upright &= shown > MIN_SHOWN * rise
        riser_s[~is_upright] = np.nan
    is_crease = np.isfinite(tread_z) & np.isfinite(riser_s)
    return MeasuredNosings(
        distance=np.where(np.isfinite(riser_s), riser_s, end_s),
        distance_std=np.where(np.isfinite(riser_s), riser_std, end_s_std),
        height=np.where(np.isfinite(tread_z), tread_z, end_z),
        height_std=np.where(np.isfinite(tread_z), tread_std, end_z_std),
        num_tread_pixels=num_tread,
        num_riser_pixels=num_riser,
        is_crease=is_crease,
        height_is_end=~np.isfinite(tread_z),
        distance_is_end=~np.isfinite(riser_s),
    )


def _surface_means(
    values: Float32Array,
    chosen: Mask,
    index: IntArray,
    spread: Float64Array,
    num_nosings: int,
    row_step: int,
) -> tuple[Float64Array, Float64Array, IntArray]:
    """Weighted mean of each surface, its standard deviation, and its pixels; NaN with too few."""
    index = index[chosen]
    weight = 1.0 / (spread[chosen] ** 2 + 0.002**2)
    count = np.bincount(index, minlength=num_nosings) * row_step
    total = np.bincount(index, weight, num_nosings)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(index, weight * values[chosen], num_nosings) / total
        std = np.sqrt(PIXELS_PER_SAMPLE / (total * row_step))
    mean[count < MIN_SURFACE_PIXELS] = np.nan
    return mean, std, count


def _is_upright(pixels: StairPixels, members: Membership, spread: Float64Array, num_nosings: int) -> Mask:
    """Whether the pixels of each riser extend in height rather than in depth: a floor's do not."""
    index = members.index[members.riser]
    count = np.maximum(np.bincount(index, minlength=num_nosings), 1)
    variances = []
    for values in (pixels.height, pixels.forward):
        chosen = values[members.riser].astype(np.float64)
        mean = np.bincount(index, chosen, num_nosings) / count
        variances.append(np.bincount(index, (chosen - mean[index]) ** 2, num_nosings) / count)
    noise = np.bincount(index, spread[members.riser] ** 2, num_nosings) / count
    return np.asarray(variances[0] > MIN_UPRIGHTNESS**2 * np.maximum(variances[1] - noise, 0.0))


def _end_medians(
    values: Float64Array, owner: IntArray, num_nosings: int, pixel: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Median of the ends of each nosing; a strip's end is known to a third of a pixel."""
    order = np.lexsort((values, owner))
    values, owner = values[order], owner[order]
    first = np.searchsorted(owner, np.arange(num_nosings))
    count = np.searchsorted(owner, np.arange(num_nosings), side="right") - first
    median, std = np.full(num_nosings, np.nan), np.full(num_nosings, np.inf)
    seen = np.flatnonzero(count >= 2)
    low, high = first[seen] + (count[seen] - 1) // 2, first[seen] + count[seen] // 2
    median[seen] = 0.5 * (values[low] + values[high])
    std[seen] = pixel[seen] * (0.2 + 0.4 / np.sqrt(count[seen]))
    return median, std
