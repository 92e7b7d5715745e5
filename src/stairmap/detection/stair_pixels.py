"""The pixels of one stairway: which tread or riser of the lattice each belongs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.geometry import cross

STRAIGHT_DOWN = -100.0
"""Slope under which nothing is seen."""

BAND_MARGIN = 0.15
"""Share of what shows of a riser or tread that is left out at either end of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StairPixels:
    """Measured pixels of an image region in a stairway's axes.

    All arrays are (N,): s forward, z up, t to the left seen up the stairs, m, from the camera.

    Attributes
    ----------
    forward, height, left
        s, z and t.
    row, column
        Where they lie in the working image.
    """

    forward: Float32Array
    height: Float32Array
    left: Float32Array
    row: IntArray
    column: IntArray

    def __len__(self) -> int:
        return len(self.forward)

    def rotated(self, tilt: float, roll: float, turn: float) -> StairPixels:
        """Return the pixels in axes turned by small angles, rad (first order).

        The new up is up + tilt·forward + roll·left, the new forward is forward - tilt·up + turn·left.
        """
        s, z, t = self.forward, self.height, self.left
        tilt32, roll32, turn32 = np.float32(tilt), np.float32(roll), np.float32(turn)
        return StairPixels(
            forward=s - tilt32 * z + turn32 * t,
            height=z + tilt32 * s + roll32 * t,
            left=t - roll32 * z - turn32 * s,
            row=self.row,
            column=self.column,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Membership:
    """Which surface of a lattice each pixel lies on.

    Attributes
    ----------
    tread, riser
        (N,) whether it lies on one.
    index
        (N,) index of the nosing that ends that riser or begins that tread.
    inside
        (N,) whether it lies inside the solid stairs, where nothing can be seen: evidence against them.
    """

    tread: Mask
    riser: Mask
    index: IntArray
    inside: Mask

    def from_step(self, first: int) -> Membership:
        """Return the same without the treads and risers of nosings below ``first``."""
        is_kept = self.index >= first
        return Membership(
            tread=self.tread & is_kept, riser=self.riser & is_kept, index=self.index, inside=self.inside
        )


def gather_pixels(
    image: InverseDepthImage, up: Vector, forward: Vector, *, columns: tuple[int, int], row_step: int = 1
) -> StairPixels:
    """Express the measured pixels of some columns in the axes of a stairway.

    Parameters
    ----------
    image
        Inverse depth.
    up, forward
        (3,) perpendicular unit vectors, camera frame.
    columns
        First column and one past the last.
    row_step
        Take every ``row_step``-th row only. Columns are all taken: widths are measured along them.
    """
    camera = image.camera
    first, last = max(columns[0], 0), min(columns[1], camera.width)
    region = image.inverse_depth[::row_step, first:last]
    row, column = np.nonzero(region)
    depth = 1.0 / region[row, column]
    row, column = row * row_step, column + first
    x = ((column - camera.cx) / camera.fx).astype(np.float32) * depth
    y = ((row - camera.cy) / camera.fy).astype(np.float32) * depth
    left = cross(up, forward)

    def along(axis: Vector) -> Float32Array:
        a, b, c = axis.astype(np.float32)
        return np.asarray(a * x + b * y + c * depth)

    return StairPixels(forward=along(forward), height=along(up), left=along(left), row=row, column=column)


def find_members(
    pixels: StairPixels,
    *,
    distance: float,
    height: float,
    run: float,
    rise: float,
    noise: float,
    num_nosings: int,
    slab_thickness: float | None = None,
) -> Membership:
    """Assign pixels to the treads and risers of a lattice.

    A pixel belongs to the surface that its ray meets first, if it lies near it. Which one that is does
    not depend on the measured depth, so noise and a sensor's smoothing do not choose pixels that err one
    way. Near nosings, inner corners and where another step begins to hide it, a pixel belongs to none.

    Parameters
    ----------
    pixels
        Pixels in the stairway's axes.
    distance, height, run, rise
        The lattice, m; ``run`` negative where the stairs descend away from the camera.
    noise
        Standard deviation of inverse depth of a pixel, 1/m.
    num_nosings
        Nosings 0 to ``num_nosings - 1`` have pixels.
    slab_thickness
        Where risers are open, all that is seen of them: the fronts of slabs up to so many m thick, which are
        too thin to leave anything out near their edges.
    """
    x = (pixels.forward - np.float32(distance)) / np.float32(run)
    y = (pixels.height - np.float32(height)) / np.float32(rise)
    spread = np.float32(noise) * pixels.forward**2
    slope = pixels.height / np.maximum(pixels.forward, np.float32(0.1))
    if run > 0:
        bands = _ascending_bands(distance, height, run, rise, num_nosings, slab_thickness)
    else:
        bands = _descending_bands(distance, height, run, rise, num_nosings)
    # Bands stand in the order of their slopes; those that are hidden are empty.
    place = np.searchsorted(bands[:, 0], slope, side="right") - 1
    low, high, is_tread_band, band_index = bands[np.maximum(place, 0)].T
    on_band = (place >= 0) & (slope > low) & (slope < high)
    index = band_index.astype(np.int64)
    tread = on_band & (is_tread_band > 0)
    riser = on_band & (is_tread_band == 0)
    tread_error = np.abs(y - band_index.astype(np.float32)) * np.float32(rise)
    riser_error = np.abs(x - band_index.astype(np.float32)) * np.float32(abs(run))
    tread &= tread_error < np.minimum(0.012 + 3.0 * np.abs(slope) * spread, 0.3 * rise)
    if slab_thickness is None:
        # A floor's pixels at a riser's distance lie on no riser.
        riser &= np.abs(band_index.astype(np.float32) - y - 0.5) < 0.5 - BAND_MARGIN
    riser &= riser_error < np.minimum(0.015 + 3.0 * spread, 0.3 * abs(run))
    riser_index = np.ceil(y)
    depth_inside = np.minimum((np.floor(x) - y) * rise, (x - riser_index) * abs(run))
    within = (x > 0) & (y < num_nosings - 1)
    inside = within & ~tread & ~riser & (depth_inside > 0.03 + 3.0 * np.minimum(spread, 0.05))
    index = np.where(tread | riser, index, riser_index.astype(np.int64))
    return Membership(tread=tread, riser=riser, index=index, inside=inside)


def _nosing_slopes(distance: Float64Array, height: Float64Array) -> Float64Array:
    """Slopes of the lines of sight to nosings in the order in which they are seen from below; those beside or
    behind the camera lie straight down."""
    slope = np.where(distance > 0.1, height / np.maximum(distance, 0.1), STRAIGHT_DOWN)
    return np.asarray(np.maximum.accumulate(slope))


def shown_riser_heights(
    distance: float, height: float, run: float, rise: float, num_nosings: int
) -> Float64Array:
    """(num_nosings,) how much of the height of each riser of ascending stairs has pixels, m: what the step
    below it does not hide, less the margins."""
    risers = _ascending_bands(distance, height, run, rise, num_nosings, None)[0::2]
    s = np.maximum(distance + np.arange(num_nosings) * run, 0.1)
    return np.asarray(np.maximum(risers[:, 1] - risers[:, 0], 0.0) * s)


def _ascending_bands(
    distance: float, height: float, run: float, rise: float, num_nosings: int, slab_thickness: float | None
) -> Float64Array:
    """Slopes under which stairs that ascend show their surfaces.

    Returns
    -------
    (2 * num_nosings, 4) lowest and highest slope z/s of each riser and tread from below, whether it is a
    tread, and the index of its nosing; ``BAND_MARGIN`` is left out at either end.
    """
    index = np.arange(-1.0, num_nosings + 1)
    s, z = distance + index * run, height + index * rise
    nosing = _nosing_slopes(s, z)
    s = np.maximum(s, 0.1)
    # A tread shows from its nosing to the foot of the next riser, if that is not hidden behind it.
    foot = np.maximum(nosing[:-1], z[:-1] / s[1:])
    riser_margin = BAND_MARGIN * (nosing[1:-1] - foot[:-1])
    tread_margin = BAND_MARGIN * (foot[1:] - nosing[1:-1])
    risers = [foot[:-1] + riser_margin, nosing[1:-1] - riser_margin]
    if slab_thickness is not None:
        risers = [nosing[1:-1] - slab_thickness / s[1:-1], nosing[1:-1]]
    treads = [nosing[1:-1] + tread_margin, foot[1:] - tread_margin]
    bands = np.empty((2 * num_nosings, 4))
    bands[0::2] = np.stack([*risers, np.zeros(num_nosings), index[1:-1]], axis=1)
    bands[1::2] = np.stack([*treads, np.ones(num_nosings), index[1:-1]], axis=1)
    bands[:, 0] = np.maximum.accumulate(bands[:, 0])
    return bands


def _descending_bands(
    distance: float, height: float, run: float, rise: float, num_nosings: int
) -> Float64Array:
    """The same of stairs that descend, whose risers face away: (num_nosings, 4), the nearest tread first."""
    index = np.arange(num_nosings, -1.0, -1.0)
    nosing = _nosing_slopes(distance + index * run, height + index * rise)
    # Of each tread shows what the nosing above and before it leaves.
    margin = BAND_MARGIN * np.diff(nosing)
    tread = np.ones(num_nosings)
    return np.stack([nosing[:-1] + margin, nosing[1:] - margin, tread, index[1:]], axis=1)
