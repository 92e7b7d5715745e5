"""The pixels of one stairway: which tread or riser of the lattice each belongs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, IntArray, Mask, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.geometry import cross


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

    A pixel belongs to the surface that its ray reaches with the smaller correction of its
    distance. Near nosings and inner corners, where a wrong choice would bias the fit, it belongs
    to neither.

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
    tread_index = np.floor(x)
    riser_index = np.ceil(y)
    tread_error = np.abs(y - tread_index) * np.float32(rise)
    riser_error = np.abs(x - riser_index) * np.float32(abs(run))
    slope = np.abs(pixels.height) / np.maximum(pixels.forward, np.float32(0.1))
    prefer_tread = tread_error < riser_error * np.maximum(slope, np.float32(0.05))
    margin_x = np.minimum(0.10 + spread / np.float32(abs(run)), 0.3)
    margin_y = np.minimum(0.10 + slope * spread / np.float32(rise), 0.3)
    tread_phase, riser_phase = x - tread_index, riser_index - y
    if slab_thickness is None:
        is_on_height = np.abs(riser_phase - 0.5) < 0.5 - margin_y
    else:
        is_on_height = riser_phase < slab_thickness / rise
    tread = (
        prefer_tread
        & (tread_error < np.minimum(0.012 + 3.0 * slope * spread, 0.3 * rise))
        & (np.abs(tread_phase - 0.5) < 0.5 - margin_x)
        & (tread_index >= 0)
        & (tread_index < num_nosings)
    )
    riser = (
        ~prefer_tread
        & (riser_error < np.minimum(0.015 + 3.0 * spread, 0.3 * abs(run)))
        & is_on_height
        & (riser_index >= 0)
        & (riser_index < num_nosings)
    )
    depth_inside = np.minimum((tread_index - y) * rise, (x - riser_index) * abs(run))
    within = (x > 0) & (y < num_nosings - 1)
    inside = within & ~tread & ~riser & (depth_inside > 0.03 + 3.0 * np.minimum(spread, 0.05))
    index = np.where(tread, tread_index, riser_index).astype(np.int64)
    return Membership(tread=tread, riser=riser, index=index, inside=inside)
