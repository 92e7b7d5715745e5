"""Predict what rays of some slopes see of an outline, blended at the borders of its pieces."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.kernels.checks import check_array, check_arrays, check_length
from stairmap.kernels.outlines import OutlineArrays

PredictionArrays: TypeAlias = tuple[
    IntArray,
    IntArray,
    Float64Array,
    Float64Array,
    Float64Array,
    Float64Array,
    Float64Array,
    Float64Array,
]
"""Surface, step, Q, its derivative by the slope, sensitivity, edge spread, farthest, gradient."""


class EdgeOptics(NamedTuple):
    """How borders of pieces are blended.

    ``row_size``: height of a row as a slope. ``width``: scale of the logistic kernel, as a slope. ``shift``:
    how many rows edges of near surfaces move outward. ``place_std``: standard deviation of an edge's place,
    as a slope. ``blend``: variance of what lies behind an edge, in squares of its jump. ``min_shifted_jump``:
    smallest share of Q whose jump is shifted. ``max_offset``, ``near_offset``: over how many widths a border
    is felt, and over how many its other side counts as seen.
    """

    row_size: float
    width: float
    shift: float
    place_std: float
    blend: float
    min_shifted_jump: float
    max_offset: float
    near_offset: float


class PieceKinds(NamedTuple):
    """Numbers of surfaces: of what is unknown behind an edge, and of the two kinds that are level."""

    behind: int
    level: int
    other_level: int


def predict_rays(  # noqa: PLR0915
    outline: OutlineArrays, slopes: Float64Array, edges: EdgeOptics, kinds: PieceKinds, has_gradient: bool
) -> PredictionArrays:
    """Predict the inverse forward distance that rays measure.

    A smoothed row of straight pieces is the pieces plus, at each border, the jump times the kernel's
    integral and the change of slope times its second integral. The kernel is logistic, whose integrals have
    closed forms.

    Parameters
    ----------
    outline
        The pieces, as ``trace_outline`` returns them.
    slopes
        (N,) slopes tau of the rays.
    edges
        How borders are blended.
    kinds
        Which surfaces are unknown, and which level.
    has_gradient
        Whether derivatives are wanted.

    Returns
    -------
    surface, step
        (N,) which surface of which step each ray meets.
    inverse_distance, by_slope
        (N,) Q and its derivative by the slope, 1/m.
    sensitivity
        (N,) how much Q changes with a surface that moves along its own normal, 1/m per m.
    edge_spread
        (N,) what the place of an edge within its row adds to the standard deviation of Q, 1/m.
    farthest
        (N,) Q from which on anything farther agrees as well, 1/m; 0 where the surface itself must be seen.
    gradient
        (N, M + 1) derivatives of Q by the outline's M values and by the shift of edges, or (N, 0).

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    integer, real = np.int64, np.float64
    surface, step, line, tops, line_gradient, top_gradient = check_arrays(
        outline, "outline", (integer, integer, real, real, real, real), (1, 1, 2, 1, 3, 2)
    )
    check_array(slopes, "slopes", real, 1)
    if len(surface) == 0:
        raise ValueError("outline[0]: expected at least one piece, got none")
    check_length(line, "outline[2]", 2, 1)
    check_length(line_gradient, "outline[4]", 2, 1)
    check_length(line_gradient, "outline[4]", top_gradient.shape[1], 2)
    edges, kinds = EdgeOptics(*edges), PieceKinds(*kinds)
    width, top = edges.width, tops[:-1]
    jump = (line[1:, 0] - line[:-1, 0]) + (line[1:, 1] - line[:-1, 1]) * top
    at_edge = np.maximum(line[1:, 0] + line[1:, 1] * top, line[:-1, 0] + line[:-1, 1] * top)
    is_shifted = np.abs(jump) > edges.min_shifted_jump * at_edge
    outward = np.where(is_shifted, -np.sign(jump), 0.0) * edges.row_size
    border = top + edges.shift * outward
    piece = np.searchsorted(np.maximum.accumulate(border), slopes, side="right")
    value = line[piece, 0] + line[piece, 1] * slopes
    by_slope = line[piece, 1].copy()
    gradient = np.zeros((len(slopes), 0))
    if has_gradient:
        gradient = np.zeros((len(slopes), top_gradient.shape[1] + 1))
        gradient[:, :-1] = line_gradient[piece, 0] + slopes[:, None] * line_gradient[piece, 1]
    is_level = (surface == kinds.level) | (surface == kinds.other_level)
    sensitivity = np.where(is_level[piece], np.abs(value * line[piece, 1]), value**2)
    variance = np.zeros(len(slopes))
    is_behind = surface == kinds.behind
    farthest = np.where(is_behind[piece], value, 0.0)
    for side in (1, -1) if len(border) else ():
        # The border above the piece, then the one below it; only rays near it feel the neighbour.
        index = piece if side > 0 else piece - 1
        has_border = (index >= 0) & (index < len(border))
        offset = (slopes - border[index.clip(0, len(border) - 1)]) / width
        rows = np.flatnonzero(has_border & (np.abs(offset) < edges.max_offset))
        at, x = index[rows], side * offset[rows]
        share = 1.0 / (1.0 + np.exp(-x))
        ramp = np.log1p(np.exp(x))
        kink = line[at + 1, 1] - line[at, 1]
        steepness = jump[at] * share * (1 - share) / width
        value[rows] += side * jump[at] * share + kink * width * ramp
        by_slope[rows] += steepness + side * kink * share
        variance[rows] += (steepness * edges.place_std) ** 2
        # How far a wide ramp falls is unknown where nothing is known of what lies behind.
        either_behind = is_behind[at] | is_behind[at + 1]
        variance[rows] += either_behind * edges.blend * share * (1 - share) * jump[at] ** 2
        other = at + 1 if side > 0 else at
        limit = line[other, 0] + line[other, 1] * slopes[rows]
        near = is_behind[other] & (np.abs(x) < edges.near_offset)
        farthest[rows] = np.where(near, np.maximum(farthest[rows], limit), farthest[rows])
        if has_gradient:
            change = side * (line_gradient[at + 1] - line_gradient[at])
            gradient[rows, :-1] += share[:, None] * change[:, 0]
            gradient[rows, :-1] += (share * top[at] + side * width * ramp)[:, None] * change[:, 1]
            gradient[rows, :-1] -= steepness[:, None] * top_gradient[at]
            gradient[rows, -1] -= steepness * outward[at]
    return surface[piece], step[piece], value, by_slope, sensitivity, np.sqrt(variance), farthest, gradient
