"""Trace what is seen of a section of stairs: straight pieces in inverse forward distance.

A ray of slope tau sees inverse forward distance Q = a + b·tau on every flat surface.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.kernels.checks import check_array, check_length

RISER, UNDERSIDE, FRONT, TREAD, BEHIND = range(5)
"""Surfaces of a step; the last is what is seen past an edge, farther than it but unknown."""

OutlineArrays: TypeAlias = tuple[IntArray, IntArray, Float64Array, Float64Array, Float64Array, Float64Array]
"""Surface, step, line, top, and the derivatives of line and top: see ``trace_outline``."""


class SectionShape(NamedTuple):
    """What all steps of a section share, in m and m per m."""

    run: float
    overhang: float
    thickness: float
    rake: float
    ground: float
    slope: float


class SectionLimits(NamedTuple):
    """What decides how a section is seen.

    ``min_forward``: what is nearer is beside the camera, m. ``behind_share``: what is seen past an edge lies
    farther by this share of a run. ``min_level``: a level surface nearer to the camera's height counts as so
    far below it, m. ``least_extent``, ``min_extent``: pieces over a smaller range of slopes are left out;
    the second is for level ones of stairs that ascend.
    """

    min_forward: float
    behind_share: float
    min_level: float
    least_extent: float
    min_extent: float


def trace_outline(
    distances: Float64Array, heights: Float64Array, shape: SectionShape, is_open: bool, limits: SectionLimits
) -> OutlineArrays:
    """Trace what is seen of a section of stairs, from the lowest rays to the highest.

    Along the section, away from the camera, a surface is seen where its rays climb above all that came
    before; only a tread's front stands before what lies beneath it.

    Parameters
    ----------
    distances
        (n,) forward distance of each nosing, m; a negative run counts them from the farthest.
    heights
        (n + 1,) height of each tread at its nosing above the camera, the floor's first, m.
    shape
        What all steps share; a positive run ascends away from the camera.
    is_open
        Whether there is nothing between the treads.
    limits
        What decides how it is seen.

    Returns
    -------
    surface, step
        (P,) which surface of which step each piece is.
    line
        (P, 2) a and b of its Q = a + b·tau, 1/m.
    top
        (P,) slope at which it ends and the next one begins; the last one's is infinite.
    line_gradient, top_gradient
        (P, 2, M) and (P, M) their derivatives by the M = 2 n + 6 values: distances, heights, overhang,
        thickness, rake, ground and slope. A top where two surfaces meet has none: it follows from the lines.

    Raises
    ------
    ValueError
        If an array is not as told.
    """
    check_array(distances, "distances", np.float64, 1)
    check_array(heights, "heights", np.float64, 1)
    if len(distances) == 0:
        raise ValueError("distances: expected at least one nosing, got none")
    check_length(heights, "heights", len(distances) + 1)
    pieces = _Pieces(distances, heights, shape, limits)
    if shape.run > 0:
        pieces.add_ascending(is_open)
    else:
        pieces.add_descending()
    return pieces.visible()


class _Pieces:
    """All surfaces of a section in the order in which a path away from the camera meets them."""

    def __init__(
        self, distances: Float64Array, heights: Float64Array, shape: SectionShape, limits: SectionLimits
    ) -> None:
        n = len(distances)
        self.p, self.limits = shape, limits
        self.s, self.z = distances, heights
        size = (n + 1, 4)
        self.surface = np.tile(np.arange(4), (n + 1, 1))
        self.step = np.tile(np.arange(-1, n)[:, None], (1, 4))
        self.end = np.full(size, -np.inf)
        self.line = np.zeros((*size, 2))
        self.line_gradient = np.zeros((*size, 2, 2 * n + 6))
        self.end_gradient = np.zeros((*size, 2 * n + 6))
        self.nosing = np.arange(n)
        self.level = n + 1 + np.arange(-1, n)
        self.overhang, self.thickness, self.rake, self.ground, self.slope = range(2 * n + 1, 2 * n + 6)

    def add_ascending(self, is_open: bool) -> None:
        """Risers, undersides, fronts and treads of stairs that lead away from the camera upward."""
        shape, s = self.p, self.s
        z, under = self.z[1:], self.z[1:] - shape.thickness
        seen = s > self.limits.min_forward
        near = np.maximum(s, self.limits.min_forward)
        rows = np.arange(1, len(s) + 1)
        is_above = under > 0
        self._set_line(FRONT, rows, 1.0 / near, 0.0)
        self.line_gradient[rows, FRONT, 0, self.nosing] = -1.0 / near**2
        inverse = 1.0 / np.where(is_above, under, 1.0)
        self._set_line(UNDERSIDE, rows, 0.0, inverse)
        self.line_gradient[rows, UNDERSIDE, 1, self.level[1:]] = -(inverse**2)
        self.line_gradient[rows, UNDERSIDE, 1, self.thickness] = inverse**2
        self._add_treads()
        tread_end = np.append(self.z[:-1] / near, self.z[-1] / (near[-1] + shape.run))
        if is_open:
            depth = shape.run + shape.overhang
            self._set_line(RISER, rows, 1.0 / (near + self.limits.behind_share * shape.run), 0.0)
            self.surface[rows, RISER] = BEHIND
            riser_end = under / (near + depth)
            tread_end[0] = self.z[0] / (near[0] + self.limits.behind_share * shape.run)
            tread_end[1:] = z / (near + depth)
        else:
            self._add_risers(rows)
            riser = self.line[rows, RISER]
            riser_end = _crossing(riser, self.line[rows, UNDERSIDE])
            tread_end[:-1] = _crossing(self.line[:-1, TREAD], riser)
        # From above, the front's lower edge hides the top of the riser behind it.
        self._set_end(RISER, rows, np.where(is_above, riser_end, under / near), seen)
        self._set_nosing_slope(rows[~is_above], RISER, under, thickness=-1.0)
        self._set_end(UNDERSIDE, rows, under / near, seen & is_above)
        self._set_nosing_slope(rows, UNDERSIDE, under, thickness=-1.0)
        self._set_end(FRONT, rows, z / near, seen)
        self._set_nosing_slope(rows, FRONT, z, thickness=0.0)
        # From high above, it also hides the back of the tread below.
        hides = np.flatnonzero(seen & (under / near < tread_end[:-1]))
        tread_end[hides] = under[hides] / near[hides]
        self._set_end(TREAD, np.append(0, rows), tread_end, self.z < 0)
        self._set_nosing_slope(rows[hides], TREAD, under, thickness=-1.0, before=1)

    def add_descending(self) -> None:
        """Treads of stairs that lead away from the camera downward: their risers face away."""
        near = np.maximum(self.s, self.limits.min_forward)
        self._add_treads()
        rows = np.arange(1, len(near) + 1)
        is_seen = (self.s > self.limits.min_forward) & (self.z[1:] < 0)
        self._set_end(TREAD, rows, self.z[1:] / near, is_seen)
        self._set_nosing_slope(rows, TREAD, self.z[1:], thickness=0.0)
        floor_end = self.z[:1] / (near[0] - self.p.run)
        self._set_end(TREAD, np.zeros(1, dtype=np.int64), floor_end, self.z[:1] < 0)

    def visible(self) -> OutlineArrays:
        """The pieces that nothing hides, and what follows the last one."""
        ascends = self.p.run > 0
        order = slice(None) if ascends else slice(None, None, -1)
        end = self.end[order].reshape(-1)
        highest = np.maximum.accumulate(np.concatenate([[-np.inf], end[:-1]]))
        gradient = self.end_gradient[order].reshape(len(end), -1)
        surface = self.surface[order].reshape(-1)
        is_level = (surface == TREAD) | (surface == UNDERSIDE)
        is_level &= ascends
        is_seen = end > highest + np.where(is_level, self.limits.min_extent, self.limits.least_extent)
        # A riser then ends where the front before it begins.
        under = np.flatnonzero((surface == UNDERSIDE) & ~is_seen & np.isfinite(end))
        end[under - 1], gradient[under - 1] = end[under], gradient[under]
        chosen = np.flatnonzero(is_seen)
        num_values = self.end_gradient.shape[-1]
        last = len(self.s) - 1 if ascends else 0
        surface, line = surface[chosen], self.line[order].reshape(-1, 2)[chosen]
        near = max(self.s[last], self.limits.min_forward)
        beyond = [1.0 / (near + self.limits.behind_share * abs(self.p.run)), 0.0]
        if len(chosen) and surface[-1] == TREAD:
            # The last level seen goes on for as long as nothing is known of its end.
            beyond = line[-1].tolist()
        return (
            np.append(surface, BEHIND).astype(np.int64),
            np.append(self.step[order].reshape(-1)[chosen], last).astype(np.int64),
            np.concatenate([line, [beyond]]),
            np.append(end[chosen], np.inf),
            np.concatenate(
                [self.line_gradient[order].reshape(-1, 2, num_values)[chosen], np.zeros((1, 2, num_values))]
            ),
            np.concatenate([gradient[chosen], np.zeros((1, num_values))]),
        )

    def _add_risers(self, rows: IntArray) -> None:
        rake, z = self.p.rake, self.z[1:]
        foot = np.maximum(self.s + self.p.overhang + rake * z, 0.5 * self.limits.min_forward)
        self._set_line(RISER, rows, 1.0 / foot, rake / foot)
        for value, by in ((self.nosing, 1.0), (self.overhang, 1.0), (self.level[1:], rake), (self.rake, z)):
            self.line_gradient[rows, RISER, 0, value] = -by / foot**2
            self.line_gradient[rows, RISER, 1, value] = -rake * by / foot**2
        self.line_gradient[rows, RISER, 1, self.rake] += 1.0 / foot

    def _add_treads(self) -> None:
        """Treads from -1, the floor, on."""
        rows = np.arange(len(self.z))
        shape = self.p
        sign = 1.0 if shape.run > 0 else -1.0
        climb = sign * (shape.ground + np.where(rows > 0, shape.slope, 0.0))
        # The floor's height is that where one more nosing would be.
        s = np.append(self.s[0] - shape.run, self.s)
        level = self.z - climb * s
        inverse = 1.0 / np.where(np.abs(level) > self.limits.min_level, level, -self.limits.min_level)
        offset = -climb * inverse
        self._set_line(TREAD, rows, offset, inverse)
        self.line_gradient[rows, TREAD, 1, self.level] = -(inverse**2)
        self.line_gradient[rows, TREAD, 0, self.level] = -offset * inverse
        nosing = np.append(0, self.nosing)
        for value, by, direct in (
            (nosing, -climb, 0.0),
            (self.ground, -sign * s, sign),
            (self.slope, np.where(rows > 0, -sign * s, 0.0), np.where(rows > 0, sign, 0.0)),
        ):
            self.line_gradient[rows, TREAD, 1, value] = -(inverse**2) * by
            self.line_gradient[rows, TREAD, 0, value] = -(offset * by + direct) * inverse

    def _set_line(
        self, surface: int, rows: IntArray, a: Float64Array | float, b: Float64Array | float
    ) -> None:
        self.line[rows, surface, 0], self.line[rows, surface, 1] = a, b

    def _set_end(self, surface: int, rows: IntArray, end: Float64Array, seen: Mask) -> None:
        self.end[rows, surface] = np.where(seen, end, -np.inf)

    def _set_nosing_slope(
        self, rows: IntArray, surface: int, heights: Float64Array, *, thickness: float, before: int = 0
    ) -> None:
        """Derivatives of the slope of nosings, or of the lower edge of their fronts, where they end a surface
        of their own row, or of so many rows before."""
        step, ended = rows - 1, rows - before
        s = np.maximum(self.s[step], self.limits.min_forward)
        self.end_gradient[ended, surface, self.level[rows]] = 1.0 / s
        self.end_gradient[ended, surface, self.nosing[step]] = -heights[step] / s**2
        self.end_gradient[ended, surface, self.thickness] = thickness / s


def _crossing(lower: Float64Array, upper: Float64Array) -> Float64Array:
    """(N,) slopes at which (N, 2) lines meet."""
    return np.asarray((upper[:, 0] - lower[:, 0]) / (lower[:, 1] - upper[:, 1]))
