"""Find where the surface seen in a scan ends, or leans back, and compare corners of neighbouring scans."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_arrays, check_length, check_strips

Jumps: TypeAlias = tuple[Float64Array, Float64Array, IntArray, Mask]
"""Distance, height, strip, and whether nothing follows."""

Creases: TypeAlias = tuple[Float64Array, Float64Array, IntArray]
"""Distance, height and strip."""


class JumpLimits(NamedTuple):
    """What counts as a jump.

    ``row_size``: slope between rows; ``edge_shift``: how many rows edges were moved outward. ``min_jump``:
    smallest distance along a ray, m. ``min_difference``: smallest difference of inverse distance, 1/m.
    ``min_nothing_rows``: rows without a measurement that make an edge. ``level_slope``: below this slope the
    surface may be level. ``max_deeper``: a level surface is followed to the edge by no more than this, m.
    """

    row_size: float
    edge_shift: float
    min_jump: float
    min_difference: float
    min_nothing_rows: int
    level_slope: float
    max_deeper: float


class CreaseLimits(NamedTuple):
    """What counts as a crease.

    ``row_size``: slope between rows. ``noise``: of inverse distance, 1/m. ``height``: of the window on each
    side, m, of ``min_window`` to ``max_window`` rows; ``min_share`` of them must be measured. ``max_gap``:
    between the surfaces, m. ``min_corner``, ``max_corner_std``: smallest angle between them and its largest
    standard deviation. ``min_lean``, ``max_lean``: inclination of the lower one, ``min_upper_lean`` of the
    upper one, rad: 0 is level, a quarter turn upright.
    """

    row_size: float
    noise: float
    height: float
    min_window: int
    max_window: int
    min_share: float
    max_gap: float
    min_corner: float
    max_corner_std: float
    min_lean: float
    max_lean: float
    min_upper_lean: float


class TurnLimits(NamedTuple):
    """What corners of one edge are, and how many pairs of them tell a direction.

    They are ``max_strips`` apart at most, so near in height, m and m per metre of distance, and turned by no
    more than ``max_turn``, rad. Directions are counted in ``num_bins`` over half a turn; those within
    ``reach`` of a peak, rad, give it, if they are ``min_pairs`` or more. Peaks lie ``min_apart`` from each
    other, rad.
    """

    max_strips: int
    max_height: float
    max_height_slope: float
    max_turn: float
    num_bins: int
    reach: float
    min_pairs: int
    min_apart: float


def find_jumps(
    inverse_distance: Float64Array, slope: Float64Array, jump_rows: IntArray, limits: JumpLimits
) -> Jumps:
    """Find the edges in scans that something farther follows, or nothing at all.

    Parameters
    ----------
    inverse_distance
        (R, S) inverse forward distance of scans, 1/m, 0 where nothing was measured.
    slope
        (R,) slope of each row, ascending.
    jump_rows
        (J,) how many rows past an edge something farther may begin.
    limits
        What counts as a jump.

    Returns
    -------
    distance, height
        (N,) forward distance and height above the camera of each edge, m.
    strip
        (N,) the scan it is in.
    is_end
        (N,) whether nothing was measured behind it.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_scans(inverse_distance, slope)
    check_array(jump_rows, "jump_rows", np.int64, 1)
    if len(jump_rows) == 0 or jump_rows.min() < 1:
        raise ValueError("jump_rows: expected at least one number, all above 0, got others")
    limits = JumpLimits(*limits)
    q, num_rows, reach = inverse_distance, len(slope), int(jump_rows.max())
    padded = np.concatenate([q, np.zeros((reach + 1, q.shape[1]))])
    slopes = np.append(slope, slope[-1] + limits.row_size * np.arange(1, reach + 2))
    is_measured = q > 0
    distance = 1.0 / np.where(is_measured, q, 1.0)
    # What an upright surface and a level one would show above: farther than both is a jump.
    ratio = np.where(slope < 0, 1.0 / np.minimum(slope, -1e-6), 0.0)
    # Along a ray that looks down, a jump is longer than forward.
    min_jump = (limits.min_jump / np.sqrt(1.0 + slope**2))[:, None]
    is_edge = np.zeros(q.shape, dtype=bool)
    for rows in jump_rows.tolist():
        above = padded[rows : rows + num_rows]
        level = np.where(slope < 0, slopes[rows : rows + num_rows] * ratio, 1.0)[:, None]
        expected = q * np.minimum(level, 1.0)
        threshold = np.minimum(expected / (1.0 + min_jump * expected), expected - limits.min_difference)
        is_edge |= (above > 0) & (above < threshold)
    is_edge &= is_measured
    counts = np.cumsum(np.concatenate([np.zeros((1, q.shape[1]), np.int64), is_measured]), axis=0)
    nothing = limits.min_nothing_rows
    end = np.minimum(np.arange(num_rows) + 1 + nothing, num_rows)
    is_last = (counts[end] - counts[1:] == 0) & ((end - np.arange(num_rows)) > nothing)[:, None]
    is_last &= is_measured & ~is_edge
    is_edge |= is_last
    # Of neighbouring rows that all see the jump ahead, the edge is the one before the steepest fall.
    fall = np.where(is_edge, q - padded[1 : num_rows + 1], 0.0)
    first, strips = np.nonzero(is_edge & ~np.concatenate([np.zeros((1, q.shape[1]), bool), is_edge[:-1]]))
    run_length = _run_lengths(is_edge, first, strips)
    window = first[:, None] + np.arange(reach)
    inside = np.arange(reach) < run_length[:, None]
    falls = np.where(inside, fall[window.clip(0, num_rows - 1), strips[:, None]], -np.inf)
    edge = first + np.argmax(falls, axis=1)
    at = np.minimum(slope[edge] + (0.5 - limits.edge_shift) * limits.row_size, slopes[edge + 1])
    # The surface is followed to the edge at the distance it has where it is still itself.
    s = distance[first, strips]
    is_level = slope[edge] < -limits.level_slope
    deeper = np.where(is_level, s * slope[first] / np.minimum(at, -0.5 * limits.level_slope), s)
    own = distance[edge, strips]
    s = np.where(np.abs(own - s) <= np.abs(own - deeper), s, np.minimum(deeper, own + limits.max_deeper))
    return s, s * at, strips, is_last[edge, strips]


def _run_lengths(mask: Mask, rows: IntArray, strips: IntArray) -> IntArray:
    """How many cells of a (R, S) mask are set on end from some cells upward."""
    flat = np.concatenate([mask, np.zeros((1, mask.shape[1]), bool)]).T.ravel()
    gaps = np.flatnonzero(~flat)
    start = strips * (mask.shape[0] + 1) + rows
    return np.asarray(gaps[np.searchsorted(gaps, start)] - start)


def find_creases(inverse_distance: Float64Array, slope: Float64Array, limits: CreaseLimits) -> Creases:
    """Find corners between two surfaces in scans, the upper one leaning back.

    Parameters
    ----------
    inverse_distance, slope
        As in ``find_jumps``.
    limits
        What counts as a crease.

    Returns
    -------
    Distance, height and strip, (N,) each, as in ``find_jumps``.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_scans(inverse_distance, slope)
    limits = CreaseLimits(*limits)
    q, row_size, reach = inverse_distance, limits.row_size, limits.max_window
    num_rows, num_strips = q.shape
    tau = slope - slope.mean()
    weight = (q > 0).astype(np.float64)
    moments = np.stack([weight, weight * tau[:, None], weight * (tau**2)[:, None], q, q * tau[:, None]])
    sums = np.zeros((5, num_rows + 2 * reach + 1, num_strips))
    np.cumsum(moments, axis=1, out=sums[:, reach + 1 : reach + 1 + num_rows])
    sums[:, reach + 1 + num_rows :] = sums[:, reach + num_rows, None]
    sums = sums.reshape(5, -1)
    window = np.clip(np.rint(limits.height / row_size * q), limits.min_window, reach).astype(np.int64)
    # The border lies above row i: the window below ends with it, the one above begins with the next row.
    border = (np.arange(num_rows)[:, None] + reach + 1) * num_strips + np.arange(num_strips)
    at_border = sums.take(border, axis=1)
    below = at_border - sums.take(border - window * num_strips, axis=1)
    above = sums.take(border + window * num_strips, axis=1) - at_border
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (_fit_lines(part) for part in (below, above))
        at = tau[:, None] + 0.5 * row_size
        here = slope[:, None] + 0.5 * row_size
        q_low, q_high = low[0] + low[1] * at, high[0] + high[1] * at
        # s = 1/Q and z = tau/Q: a surface's inclination is 0 for a tread, 90 degrees for a riser.
        lean_low = np.arctan2(q_low - here * low[1], -low[1])
        lean_high = np.arctan2(q_high - here * high[1], -high[1])
        corner = lean_low - lean_high
        corner = (corner + np.pi) % (2 * np.pi) - np.pi
        angle_std = limits.noise * np.sqrt(12.0 / window**3) / row_size / np.maximum(q_low, 1e-6)
        gap = 1.0 / q_high - 1.0 / q_low
        meet = (high[0] - low[0]) / (low[1] - high[1])
        tau_meet = np.clip(meet, at - window * row_size, at + window * row_size)
        q_meet = low[0] + low[1] * tau_meet
    enough = limits.min_share * window
    usable = (below[0] > enough) & (above[0] > enough) & (q_low > 0) & (q_high > 0) & (q_meet > 0)
    usable &= np.isfinite(corner) & np.isfinite(q_meet) & (np.abs(gap) < limits.max_gap)
    usable &= (corner > limits.min_corner) & (corner < np.pi - limits.min_corner)
    usable &= angle_std < limits.max_corner_std
    # A tread's front side faces the camera, its top is seen from above.
    usable &= (lean_low > limits.min_lean) & (lean_low < limits.max_lean)
    usable &= lean_high > limits.min_upper_lean
    strength = np.where(usable, corner, 0.0)
    largest = window.max(initial=limits.min_window)
    rows, strips = np.nonzero(usable & (strength >= _shifted_max(strength, largest // 2)))
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


def find_edge_turns(
    corners: tuple[Float64Array, Float64Array, IntArray],
    bearing: Float64Array,
    limits: TurnLimits,
    max_turns: int,
) -> Float64Array:
    """Compare corners of neighbouring scans at one height: those of one edge tell its direction.

    Parameters
    ----------
    corners
        (N,) distance, height and strip of each, m.
    bearing
        (S,) metres to the left for each metre forward of each scan.
    limits
        What counts as one edge, and as a direction of many.
    max_turns
        How many directions are returned at most.

    Returns
    -------
    (T,) angles of edges to the lateral axis, rad, the commonest first.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    s, z, strip = check_arrays(corners, "corners", (np.float64, np.float64, np.int64))
    check_array(bearing, "bearing", np.float64, 1)
    check_strips(strip, "corners[2]", len(bearing))
    limits = TurnLimits(*limits)
    if limits.num_bins < 1:
        raise ValueError("limits: expected at least one bin, got none")
    t = bearing[strip] * s
    first, second = np.nonzero(
        (strip[:, None] < strip) & (strip - strip[:, None] <= limits.max_strips)
        & (np.abs(z[:, None] - z) < limits.max_height + limits.max_height_slope * s)
    )  # fmt: skip
    across = t[first] - t[second]
    angle = -np.arctan2(s[first] - s[second], across)
    usable = (np.abs(angle) < limits.max_turn) & (across > 0)
    angle, across = angle[usable], across[usable]
    size = limits.num_bins
    bins = np.floor((angle + np.pi / 2) * (size / np.pi)).astype(np.int64)
    counts = np.bincount(np.clip(bins, 0, size - 1), minlength=size).astype(np.float64)
    smooth = counts + 0.5 * (np.roll(counts, 1) + np.roll(counts, -1))
    turns: list[float] = []
    for peak in np.argsort(-smooth, kind="stable"):
        center = (peak + 0.5) * np.pi / size - np.pi / 2
        near = np.abs(angle - center) < limits.reach
        if len(turns) >= max_turns or np.count_nonzero(near) < max(limits.min_pairs, 1):
            break
        turn = _weighted_median(angle[near], across[near])
        if all(abs(turn - other) > limits.min_apart for other in turns):
            turns.append(turn)
    return np.array(turns, dtype=np.float64)


def _weighted_median(values: Float64Array, weights: Float64Array) -> float:
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(total, 0.5 * total[-1])]])


def check_scans(inverse_distance: Float64Array, slope: Float64Array) -> None:
    """Refuse what are no scans."""
    check_array(inverse_distance, "inverse_distance", np.float64, 2)
    check_array(slope, "slope", np.float64, 1)
    if inverse_distance.size == 0:
        raise ValueError("inverse_distance: expected at least one cell, got none")
    check_length(slope, "slope", len(inverse_distance))
