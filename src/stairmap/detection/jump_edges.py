"""Nosings seen as jumps of depth: where a surface ends and a farther one begins.

Above the camera a riser ends against the next riser, whose tread is hidden. Seen from
the upper floor a tread ends against the lower one. With open risers a tread begins in
front of whatever is seen beneath it.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation
from stairmap.detection.profile_segments import RISER, TREAD, ProfileSegments
from stairmap.detection.ramps import MAX_RAMP, find_crossings

MIN_JUMP = 0.10
"""Smallest forward distance between the two sides of a jump, m: half of the smallest run."""


def find_riser_tops(elevation: Elevation, segments: ProfileSegments, in_crease: IntArray) -> Float64Array:
    """Find the upper ends of risers that end against something farther.

    The riser is followed upward, past the rows where the inclination window already
    straddles the jump, for as long as its distance stays the same.

    Parameters
    ----------
    elevation, segments
        Scans and their segments.
    in_crease
        Risers that end in a crease, which need no jump.

    Returns
    -------
    (N, 3) distance s, height z (m) and strip of each nosing.
    """
    is_candidate = segments.kind == RISER
    is_candidate[in_crease] = False
    chosen = np.flatnonzero(is_candidate)
    distance, strip = segments.distance[chosen], segments.strip[chosen]
    top = _extend(elevation, segments.last_row[chosen], strip, distance, along_slope=False)
    farther = _is_farther(elevation, top, strip, distance, step=-1) & (top >= 2)
    top, strip, distance = top[farther], strip[farther], distance[farther]
    surface = np.repeat(1.0 / distance[:, None], MAX_RAMP + 1, axis=1)
    rows = _find_crossings(elevation, top, strip, surface)
    height = (elevation.slope[top] + rows / elevation.row_density) * distance
    return np.stack([distance, height, strip], axis=1).astype(np.float64)


def find_tread_fronts(
    elevation: Elevation, segments: ProfileSegments, in_crease: IntArray, *, view_sign: int
) -> Float64Array:
    """Find the front ends of treads without a visible riser.

    Parameters
    ----------
    elevation, segments
        Scans and their segments.
    in_crease
        Treads that begin at a crease, which need no jump.
    view_sign
        +1: the near end of a tread is its front (stairs that ascend away from the camera);
        -1: the far end is (stairs that descend away from it).

    Returns
    -------
    (N, 3) distance s, height z (m) and strip of each nosing.
    """
    is_candidate = segments.kind == TREAD
    is_candidate[in_crease] = False
    chosen = np.flatnonzero(is_candidate)
    height, strip = segments.height[chosen], segments.strip[chosen]
    if view_sign > 0:
        end = _extend(elevation, segments.first_row[chosen], strip, height, along_slope=True, step=1)
    else:
        end = _extend(elevation, segments.last_row[chosen], strip, height, along_slope=True)
    distance = _divide(height, elevation.slope[end])
    farther = _is_farther(elevation, end, strip, distance, step=view_sign) & (distance > 0.2)
    end, strip, height, distance = end[farther], strip[farther], height[farther], distance[farther]
    if view_sign < 0:
        # Seen from below, the rows that follow may show the front of the tread's slab, which is no ramp.
        surface = _slopes_beyond(elevation, end) / height[:, None]
        rows = _find_crossings(elevation, end, strip, surface)
        distance = _divide(height, (elevation.slope[end] + rows / elevation.row_density).astype(np.float32))
    return np.stack([distance, height, strip], axis=1).astype(np.float64)


def _divide(height: Float32Array, slope: Float32Array) -> Float32Array:
    """Forward distance of heights seen under slopes, m; 0 near the horizon."""
    with np.errstate(divide="ignore"):
        return np.where(np.abs(slope) > 1e-3, height / slope, np.float32(0))


def _is_farther(
    elevation: Elevation, rows: IntArray, strips: IntArray, distance: Float32Array, *, step: int
) -> Mask:
    """Whether something farther by ``MIN_JUMP`` begins two to five rows past an end.

    A few rows may still show the edge's own thickness: the front of an open tread.
    """
    num_rows = len(elevation.slope)
    beyond = rows[:, None] + step * np.arange(2, 6)
    q = elevation.inverse_distance[np.clip(beyond, 0, num_rows - 1), strips[:, None]]
    limit = 1.0 / (np.maximum(distance, 1e-3) + MIN_JUMP)
    return np.asarray(((q > 0) & (q < limit[:, None]) & (beyond >= 0) & (beyond < num_rows)).any(axis=1))


def _slopes_beyond(elevation: Elevation, rows: IntArray) -> Float32Array:
    """(N, MAX_RAMP + 1) slopes of rows and of those above them."""
    beyond = rows[:, None] - np.arange(MAX_RAMP + 1)
    return np.asarray(elevation.slope[np.clip(beyond, 0, len(elevation.slope) - 1)])


def _find_crossings(
    elevation: Elevation, rows: IntArray, strips: IntArray, surface: Float32Array
) -> Float64Array:
    """How many rows above the last one on a surface its edge lies.

    Parameters
    ----------
    elevation
        Scans.
    rows, strips
        (N,) last cells on the surface.
    surface
        (N, MAX_RAMP + 1) inverse distance of the surface in that row and those above it, 1/m.
    """
    num_rows = len(elevation.slope)
    beyond = rows[:, None] - np.arange(MAX_RAMP + 1)
    q = elevation.inverse_distance[np.clip(beyond, 0, num_rows - 1), strips[:, None]]
    below = np.where((q > 0) & (beyond >= 0) & (beyond < num_rows), surface - q, np.nan)
    return find_crossings(below) - elevation.edge_shift


def _extend(
    elevation: Elevation,
    rows: IntArray,
    strips: IntArray,
    value: Float32Array,
    *,
    along_slope: bool,
    step: int = -1,
    max_rows: int = 12,
) -> IntArray:
    """Move rows on while the cell there still lies on the segment's surface; returns the last that does.

    ``along_slope``: the surface is a tread at height ``value``; otherwise a riser at distance ``value``.
    """
    num_rows = len(elevation.slope)
    following = np.clip(rows[:, None] + step * np.arange(1, max_rows + 1), 0, num_rows - 1)
    q = elevation.inverse_distance[following, strips[:, None]]
    expected = elevation.slope[following] / value[:, None] if along_slope else 1.0 / value[:, None]
    # |1/q - 1/expected| < 30 mm, and for treads the same in height, without dividing by zero.
    tolerance = 0.03 / np.abs(elevation.slope[following]).clip(0.05) if along_slope else 0.03
    continues = (q > 0) & (np.abs(q - expected) < tolerance * q * np.abs(expected))
    num_more = np.argmin(np.append(continues, np.zeros((len(rows), 1), bool), axis=1), axis=1)
    return np.asarray(np.clip(rows + step * num_more, 0, num_rows - 1))
