"""Find nosings in the scans of an elevation: convex corners where a near surface ends.

Going up a scan, a nosing is where the surface seen so far ends: either something farther follows (a jump), or
a surface that leans back (a crease, the corner of a riser and its tread). Nothing is asked of what lies
beneath, so fronts of slabs, edges of treads seen from above and the tops of risers are all found alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation

MIN_JUMP = 0.10
"""Smallest distance along a ray between the two sides of a jump, m: half of the smallest run."""

JUMP_ROWS = (2, 3, 5, 7)
"""How many rows past an edge something farther must begin: a sensor that smooths makes a ramp of a few."""

NOISE_JUMP = 5.0
"""A jump is larger than this many standard deviations of inverse distance."""

MIN_NOTHING_ROWS = 8
"""An edge before nothing at all counts as a jump where so many rows hold no measurement."""

MIN_CORNER = np.radians(40.0)
"""Smallest angle between the surfaces below and above a crease: worn and sloping risers keep half of 90°."""

MAX_CORNER_STD = np.radians(14.0)
"""Largest standard deviation of a crease's angle."""

MAX_CREASE_GAP = 0.07
"""Largest forward distance between the surfaces that meet at a crease, m: the overhang of a nosing."""

WINDOW_HEIGHT = 0.06
"""Height of the piece of a scan to which a line is fitted on each side of a crease, m: a third of a rise."""

MIN_WINDOW, MAX_WINDOW = 3, 10
"""Bounds of the same, rows."""


MAX_PAIR_STRIPS = 3
"""Corners of one edge are compared over so many strips at most."""

PAIR_HEIGHT, PAIR_HEIGHT_ROWS = 0.012, 1.5
"""Corners of one edge lie within this height of each other, m, and so many rows: level edges only."""

MAX_EDGE_TURN = np.radians(65.0)
"""An edge that is turned more against the heading is seen almost end on, rad."""

TURN_BINS = 36
"""Bins of 5 degrees in which the directions of edges are counted."""

MIN_PAIRS = 5
"""Fewest pairs of corners that tell a heading."""

PEAK_REACH = np.radians(7.0)
"""Pairs within this of the commonest direction give it, rad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Corners:
    """Convex corners of single scans; all arrays are (N,).

    Attributes
    ----------
    distance, height
        s and z, m.
    strip
        Strip of the elevation.
    is_jump
        Whether something farther follows, rather than a surface that leans back.
    is_end
        Whether nothing at all was measured behind it.
    """

    distance: Float64Array
    height: Float64Array
    strip: IntArray
    is_jump: Mask
    is_end: Mask

    def __len__(self) -> int:
        return len(self.distance)


def find_corners(elevation: Elevation, *, noise: float) -> Corners:
    """Find the convex corners of all scans.

    Parameters
    ----------
    elevation
        The scans.
    noise
        Standard deviation of inverse distance of one cell, 1/m.
    """
    jumps = _find_jumps(elevation, noise)
    creases = _find_creases(elevation, noise)
    return Corners(
        distance=np.concatenate([jumps[0], creases[0]]),
        height=np.concatenate([jumps[1], creases[1]]),
        strip=np.concatenate([jumps[2], creases[2]]).astype(np.int64),
        is_jump=np.arange(len(jumps[0]) + len(creases[0])) < len(jumps[0]),
        is_end=np.concatenate([jumps[3], np.zeros(len(creases[0]), dtype=bool)]),
    )


def find_turns(elevation: Elevation, corners: Corners, *, max_turns: int) -> list[float]:
    """Find how far level edges are turned against an elevation's heading.

    Corners in neighbouring scans at one height are of one edge. The direction from one to the other, seen
    from above, is that of the edge; stairs have many edges of one direction.

    Parameters
    ----------
    elevation, corners
        Scans and their corners.
    max_turns
        How many directions are returned at most.

    Returns
    -------
    Angles by which the heading must be turned to the left to stand square to the edges, rad, the commonest
    first.
    """
    # Where measurements end, at the sensor's range or a shiny floor, there is no edge.
    known = ~corners.is_end
    s, z, strip = corners.distance[known], corners.height[known], corners.strip[known]
    t = elevation.bearing[strip] * s
    first, second = np.nonzero(
        (strip[:, None] < strip) & (strip - strip[:, None] <= MAX_PAIR_STRIPS)
        & (np.abs(z[:, None] - z) < PAIR_HEIGHT + PAIR_HEIGHT_ROWS * elevation.grid.row_size * s)
    )  # fmt: skip
    across = t[first] - t[second]
    angle = -np.arctan2(s[first] - s[second], across)
    usable = (np.abs(angle) < MAX_EDGE_TURN) & (across > 0)
    angle, across = angle[usable], across[usable]
    bins = np.floor((angle + np.pi / 2) * (TURN_BINS / np.pi)).astype(np.int64)
    counts = np.bincount(bins, minlength=TURN_BINS).astype(np.float64)
    smooth = counts + 0.5 * (np.roll(counts, 1) + np.roll(counts, -1))
    turns: list[float] = []
    for peak in np.argsort(-smooth):
        center = (peak + 0.5) * np.pi / TURN_BINS - np.pi / 2
        near = np.abs(angle - center) < PEAK_REACH
        if len(turns) >= max_turns or np.count_nonzero(near) < MIN_PAIRS:
            break
        turn = _weighted_median(angle[near], across[near])
        if all(abs(turn - other) > 1.5 * PEAK_REACH for other in turns):
            turns.append(turn)
    return turns


def _weighted_median(values: Float64Array, weights: Float64Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, 0.5 * total[-1])]])


def _find_jumps(elevation: Elevation, noise: float) -> tuple[Float64Array, Float64Array, IntArray, Mask]:
    """Distances, heights and strips of edges that something farther follows, and which nothing follows."""
    q, slope = elevation.inverse_distance, elevation.slope
    num_rows = len(slope)
    padded = np.concatenate([q, np.zeros((max(JUMP_ROWS) + 1, q.shape[1]))])
    slopes = np.append(slope, slope[-1] + elevation.grid.row_size * np.arange(1, max(JUMP_ROWS) + 2))
    is_measured = q > 0
    distance = 1.0 / np.where(is_measured, q, 1.0)
    # What an upright surface and a level one would show above: farther than both is a jump.
    ratio = np.where(slope < 0, 1.0 / np.minimum(slope, -1e-6), 0.0)
    # Along a ray that looks down, a jump is longer than forward.
    min_jump = (MIN_JUMP / np.sqrt(1.0 + slope**2))[:, None]
    is_edge = np.zeros(q.shape, dtype=bool)
    for rows in JUMP_ROWS:
        above = padded[rows : rows + num_rows]
        level = np.where(slope < 0, slopes[rows : rows + num_rows] * ratio, 1.0)[:, None]
        expected = q * np.minimum(level, 1.0)
        threshold = np.minimum(expected / (1.0 + min_jump * expected), expected - NOISE_JUMP * noise)
        is_edge |= (above > 0) & (above < threshold)
    is_edge &= is_measured
    counts = np.cumsum(np.concatenate([np.zeros((1, q.shape[1]), np.int64), is_measured]), axis=0)
    end = np.minimum(np.arange(num_rows) + 1 + MIN_NOTHING_ROWS, num_rows)
    is_last = (counts[end] - counts[1:] == 0) & ((end - np.arange(num_rows)) > MIN_NOTHING_ROWS)[:, None]
    is_last &= is_measured & ~is_edge
    is_edge |= is_last
    # Of neighbouring rows that all see the jump ahead, the edge is the one before the steepest fall.
    fall = np.where(is_edge, q - padded[1 : num_rows + 1], 0.0)
    first, strips = np.nonzero(is_edge & ~np.concatenate([np.zeros((1, q.shape[1]), bool), is_edge[:-1]]))
    run_length = _run_lengths(is_edge, first, strips)
    window = first[:, None] + np.arange(max(JUMP_ROWS))
    inside = np.arange(max(JUMP_ROWS)) < run_length[:, None]
    steepest = np.argmax(np.where(inside, fall[window.clip(0, num_rows - 1), strips[:, None]], -1.0), axis=1)
    edge = first + steepest
    at = np.minimum(
        slope[edge] + (0.5 - elevation.grid.edge_shift) * elevation.grid.row_size, slopes[edge + 1]
    )
    # The surface is followed to the edge at the distance it has where it is still itself.
    s = distance[first, strips]
    is_level = slope[edge] < -0.02
    deeper = np.where(is_level, s * slope[first] / np.minimum(at, -0.01), s)
    own = distance[edge, strips]
    s = np.where(np.abs(own - s) <= np.abs(own - deeper), s, np.minimum(deeper, own + 0.05))
    return s, s * at, strips, is_last[edge, strips]


def _run_lengths(mask: Mask, rows: IntArray, strips: IntArray) -> IntArray:
    """How many cells of a (R, S) mask are set on end from some cells upward."""
    flat = np.concatenate([mask, np.zeros((1, mask.shape[1]), bool)]).T.ravel()
    gaps = np.flatnonzero(~flat)
    start = strips * (mask.shape[0] + 1) + rows
    return np.asarray(gaps[np.searchsorted(gaps, start)] - start)


def _find_creases(elevation: Elevation, noise: float) -> tuple[Float64Array, Float64Array, IntArray]:
    """Distances, heights and strips of corners between two surfaces, the upper one leaning back."""
    q, slope = elevation.inverse_distance, elevation.slope
    num_rows, num_strips = q.shape
    tau = slope - slope.mean()
    weight = (q > 0).astype(np.float64)
    moments = np.stack([weight, weight * tau[:, None], weight * (tau**2)[:, None], q, q * tau[:, None]])
    sums = np.zeros((5, num_rows + 2 * MAX_WINDOW + 1, num_strips))
    np.cumsum(moments, axis=1, out=sums[:, MAX_WINDOW + 1 : MAX_WINDOW + 1 + num_rows])
    sums[:, MAX_WINDOW + 1 + num_rows :] = sums[:, MAX_WINDOW + num_rows, None]
    sums = sums.reshape(5, -1)
    window = np.clip(np.rint(WINDOW_HEIGHT / elevation.grid.row_size * q), MIN_WINDOW, MAX_WINDOW).astype(
        np.int64
    )
    # The border lies above row i: the window below ends with it, the one above begins with the next row.
    border = (np.arange(num_rows)[:, None] + MAX_WINDOW + 1) * num_strips + np.arange(num_strips)
    at_border = sums.take(border, axis=1)
    below = at_border - sums.take(border - window * num_strips, axis=1)
    above = sums.take(border + window * num_strips, axis=1) - at_border
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (_fit_lines(part) for part in (below, above))
        at = tau[:, None] + 0.5 * elevation.grid.row_size
        here = slope[:, None] + 0.5 * elevation.grid.row_size
        q_low, q_high = low[0] + low[1] * at, high[0] + high[1] * at
        # s = 1/Q and z = tau/Q: a surface's inclination is 0 for a tread, 90 degrees for a riser.
        lean_low = np.arctan2(q_low - here * low[1], -low[1])
        lean_high = np.arctan2(q_high - here * high[1], -high[1])
        corner = lean_low - lean_high
        corner = (corner + np.pi) % (2 * np.pi) - np.pi
        angle_std = noise * np.sqrt(12.0 / window**3) / elevation.grid.row_size / np.maximum(q_low, 1e-6)
        gap = 1.0 / q_high - 1.0 / q_low
        tau_meet = np.clip(
            (high[0] - low[0]) / (low[1] - high[1]),
            at - window * elevation.grid.row_size,
            at + window * elevation.grid.row_size,
        )
        q_meet = low[0] + low[1] * tau_meet
    usable = (below[0] > 0.7 * window) & (above[0] > 0.7 * window) & (q_low > 0) & (q_high > 0) & (q_meet > 0)
    usable &= np.isfinite(corner) & np.isfinite(q_meet) & (np.abs(gap) < MAX_CREASE_GAP)
    usable &= (corner > MIN_CORNER) & (corner < np.pi - MIN_CORNER) & (angle_std < MAX_CORNER_STD)
    # A tread's front side faces the camera, its top is seen from above.
    usable &= (lean_low > np.radians(30.0)) & (lean_low < np.radians(150.0)) & (lean_high > np.radians(-30.0))
    strength = np.where(usable, corner, 0.0)
    is_peak = usable & (strength >= _shifted_max(strength, window.max(initial=MIN_WINDOW) // 2))
    rows, strips = np.nonzero(is_peak)
    s = 1.0 / q_meet[rows, strips]
    return s, s * (tau_meet[rows, strips] + slope.mean()), strips


def _fit_lines(moments: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Offset and slope of least-squares lines from their (5, ...) sums of 1, x, x², y and xy."""
    count, x, xx, y, xy = moments
    slope = (count * xy - x * y) / (count * xx - x * x)
    return (y - slope * x) / count, slope


def _shifted_max(values: Float64Array, reach: int) -> Float64Array:
    """Largest value among the rows up to ``reach`` above and below each."""
    result = values.copy()
    for step in range(1, reach + 1):
        result[step:] = np.maximum(result[step:], values[:-step])
        result[:-step] = np.maximum(result[:-step], values[step:])
    return result
