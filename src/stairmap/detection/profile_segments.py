"""Treads and risers in side elevations: runs of rows with one inclination."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float32Array, IntArray, Mask
from stairmap.detection.elevation import Elevation

MIN_HALF_WINDOW, MAX_HALF_WINDOW = 0.020, 0.045
"""Bounds of half the window's height in which an inclination is fitted, m: up to a third of a usual riser."""

MIN_HALF_ROWS, MAX_HALF_ROWS = 2, 9
"""The same in rows."""

INCLINATION_STD = 0.14
"""Standard deviation that the window's height is chosen for, rad: a third of the labels' tolerance."""

NOTHING, TREAD, RISER = 0, 1, 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileSegments:
    """Straight pieces of the scans of an elevation, ordered by strip, then from low rays to high ones.

    All arrays are (N,). Distances are forward (s) and up (z) from the camera, m.

    Attributes
    ----------
    kind
        ``TREAD`` or ``RISER``.
    strip
        Strip of the elevation.
    first_row, last_row
        Lowest and highest row, as image rows: the first has the larger number.
    distance, height
        Mean s and z.
    near, far
        Smallest and largest s.
    low, high
        Smallest and largest z.
    num_rows
        Rows that make it.
    """

    kind: IntArray
    strip: IntArray
    first_row: IntArray
    last_row: IntArray
    distance: Float32Array
    height: Float32Array
    near: Float32Array
    far: Float32Array
    low: Float32Array
    high: Float32Array
    num_rows: IntArray

    def __len__(self) -> int:
        return len(self.kind)


def label_cells(elevation: Elevation, *, noise: float) -> NDArray[np.int8]:
    """Label each cell of an elevation as tread, riser or neither by its inclination in its scan.

    In a window of rows Q is fitted as a line in tau. With s = 1/Q and z = tau/Q the
    surface's inclination is atan2(Q - tau·Q', -Q'): 0 for a tread, 90 degrees for a riser.
    The window is as low as the noise allows: a slope over n rows has the standard deviation
    noise · sqrt(12 / n^3) per row.

    Parameters
    ----------
    elevation
        Scans.
    noise
        Standard deviation of inverse distance of one cell, 1/m.

    Returns
    -------
    (rows, strips) of ``NOTHING``, ``TREAD`` and ``RISER``.
    """
    q = elevation.inverse_distance
    num_rows, num_strips = q.shape
    tau = elevation.slope[:, None] - elevation.slope.mean()
    weight = (q > 0).astype(np.float64)
    density = elevation.row_density
    spread = 2.0 * noise * density / (INCLINATION_STD * np.maximum(q, np.float32(1e-6)))
    half = 0.5 * np.cbrt(12.0 * spread**2)
    half = np.clip(half, MIN_HALF_WINDOW * density * q, MAX_HALF_WINDOW * density * q)
    half = np.clip(np.rint(half), MIN_HALF_ROWS, MAX_HALF_ROWS).astype(np.int64)
    moments = np.stack([weight, weight * tau, weight * tau**2, q, q * tau])
    sums = np.zeros((5, num_rows + 2 * MAX_HALF_ROWS + 1, num_strips))
    np.cumsum(moments, axis=1, out=sums[:, MAX_HALF_ROWS + 1 : MAX_HALF_ROWS + 1 + num_rows])
    sums[:, MAX_HALF_ROWS + 1 + num_rows :] = sums[:, MAX_HALF_ROWS + num_rows, None]
    center = np.arange(num_rows * num_strips).reshape(num_rows, num_strips) + MAX_HALF_ROWS * num_strips
    sums = sums.reshape(5, -1)
    above, below = center + (half + 1) * num_strips, center - half * num_strips
    count, tau1, tau2, q1, q_tau = sums.take(above, axis=1) - sums.take(below, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_tau, mean_q = tau1 / count, q1 / count
        slope = (q_tau / count - mean_tau * mean_q) / (tau2 / count - mean_tau**2)
        inclination = np.degrees(np.arctan2(mean_q - elevation.slope[:, None] * slope, -slope)) % 180.0
    usable = (q > 0) & (count >= 0.7 * (2 * half + 1)) & np.isfinite(inclination)
    labels = np.zeros(q.shape, dtype=np.int8)
    labels[usable & (np.abs(inclination - 90.0) < 28.0)] = RISER
    # What is level above the camera is a ceiling, or the line of sight along a jump.
    is_below = elevation.slope[:, None] < -0.01
    labels[usable & is_below & (np.abs((inclination + 90.0) % 180.0 - 90.0) < 20.0)] = TREAD
    return labels


def find_segments(elevation: Elevation, labels: NDArray[np.int8], *, noise: float) -> ProfileSegments:
    """Join neighbouring cells of one label and one surface into segments.

    A segment ends where the label changes or where the distance (riser) or the height
    (tread) jumps by more than 40 mm and four times the noise.

    Parameters
    ----------
    elevation, labels
        Scans and their labels.
    noise
        Standard deviation of inverse distance of one cell, 1/m.
    """
    q = elevation.inverse_distance
    with np.errstate(divide="ignore"):
        distance = np.where(q > 0, 1.0 / q, np.float32(0))
    height = elevation.slope[:, None] * distance
    # Strip after strip, each from its lowest ray up.
    flat = [np.ascontiguousarray(values[::-1].T).ravel() for values in (labels, distance, height)]
    flat_labels, flat_distance, flat_height = flat
    num_rows = q.shape[0]
    index = np.arange(len(flat_labels))
    limit = 0.04 + 4.0 * noise * flat_distance**2
    value = np.where(flat_labels == RISER, flat_distance, flat_height)
    new = np.ones(len(index), dtype=bool)
    new[1:] = (
        (flat_labels[1:] != flat_labels[:-1])
        | (index[1:] % num_rows == 0)
        | (np.abs(value[1:] - value[:-1]) > limit[1:])
    )
    starts = np.flatnonzero(new)
    ends = np.append(starts[1:], len(index)) - 1
    kind = flat_labels[starts]
    length = ends - starts + 1
    keep = (kind != NOTHING) & (length >= 2)

    def reduced(function: np.ufunc, values: Float32Array) -> Float32Array:
        return np.asarray(function.reduceat(values, starts)[keep])

    starts_kept, ends_kept, count = starts[keep], ends[keep], length[keep]
    return ProfileSegments(
        kind=kind[keep].astype(np.int64),
        strip=starts_kept // num_rows,
        first_row=num_rows - 1 - starts_kept % num_rows,
        last_row=num_rows - 1 - ends_kept % num_rows,
        distance=reduced(np.add, flat_distance) / count,
        height=reduced(np.add, flat_height) / count,
        near=reduced(np.minimum, flat_distance),
        far=reduced(np.maximum, flat_distance),
        low=reduced(np.minimum, flat_height),
        high=reduced(np.maximum, flat_height),
        num_rows=count,
    )


def is_kind(segments: ProfileSegments, kind: int) -> Mask:
    """Return (N,) whether each segment is of a kind."""
    return np.asarray(segments.kind == kind)
