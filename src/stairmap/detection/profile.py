"""Say what each ray of a frame must see of a stairway: which step, which surface, at what distance.

A stairway is described by its section along the direction of ascent: s forward, z up, from the camera. A ray
of slope tau = z / s meets the surface that is nearest. In inverse forward distance Q = 1/s every flat surface
is a straight line in tau, Q = a + b·tau: a riser is constant, a level tread is tau / z. So what is seen of
stairs is a row of straight pieces, with a jump where a nosing hides what is behind it and a kink where two
surfaces meet. Stairs that ascend or descend, with closed or open risers, with or without overhang, are
values of one profile.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask, readonly

MIN_FORWARD = 0.1
"""What lies nearer than this is beside or behind the camera, m."""

USUAL_THICKNESS = 0.035
"""Thickness of a tread's front where nothing tells it, m: boards and stone treads are 20 to 50 mm thick."""

BEHIND_SHARE = 0.5
"""What is seen past an edge of which nothing is known lies farther than the edge by this share of a run."""

MIN_SHIFTED_JUMP = 0.02
"""A sensor shifts an edge outward where inverse distance jumps by more than this share."""

EDGE_PLACE_STD = 0.5
"""A row shows what lies somewhere within it: standard deviation of an edge's place, rows."""

MAX_OFFSET, NEAR_OFFSET = 6.0, 3.0
"""A border is felt over so many widths of the kernel; its other side counts as seen over so many."""

LOGISTIC_WIDTH = 0.55
"""Scale of the logistic function that is nearest to a Gaussian's integral, in its standard deviations."""


class Surface(IntEnum):
    """The surfaces of a step; ``BEHIND`` is what is seen past an edge, farther than it but unknown."""

    RISER = 0
    UNDERSIDE = 1
    FRONT = 2
    TREAD = 3
    BEHIND = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class StairProfile:
    """The section of a stairway along its direction of ascent, seen from the camera, m.

    Attributes
    ----------
    distance, height
        s and z of nosing 0, the lowest.
    run, rise
        Distances from one nosing to the next. ``run`` is positive where the stairs ascend away from the
        camera, negative where they descend; ``rise`` is always positive.
    num_steps
        Number of nosings. The level before the first step, a floor, is tread -1.
    overhang
        How far nosings stand before the foot of their own riser's plane.
    thickness
        Height of a tread's front, the lip over the riser or the face of a slab.
    is_open
        Whether the risers are open: slabs with nothing between them.
    rake
        How far a riser leans back downward, m per m.
    ground, slope
        How much the ground climbs in the direction of ascent, and treads more than the ground, m per m.
    offsets
        (2 * num_steps + 1,) how far each nosing lies off the regular place forward, then each tread off the
        regular height from tread -1 on, m.
    """

    distance: float
    height: float
    run: float
    rise: float
    num_steps: int
    overhang: float = 0.0
    thickness: float = USUAL_THICKNESS
    is_open: bool = False
    rake: float = 0.0
    ground: float = 0.0
    slope: float = 0.0
    offsets: Float64Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        offsets = self.offsets if len(self.offsets) else np.zeros(2 * self.num_steps + 1)
        object.__setattr__(self, "offsets", readonly(offsets))

    @property
    def direction(self) -> float:
        """+1 where the stairs ascend away from the camera, -1 where they descend."""
        return 1.0 if self.run > 0 else -1.0

    @property
    def nosing_distances(self) -> Float64Array:
        """(num_steps,) s of each nosing, m."""
        own = self.offsets[: self.num_steps]
        return np.asarray(self.distance + self.run * np.arange(self.num_steps) + own)

    @property
    def tread_heights(self) -> Float64Array:
        """(num_steps + 1,) z of each tread at its nosing, from tread -1, the floor, on, m."""
        own = self.offsets[self.num_steps :]
        return np.asarray(self.height + self.rise * np.arange(-1, self.num_steps) + own)

    def with_steps(self, below: int, above: int) -> StairProfile:
        """Return the profile with more regular steps below and above; negative numbers cut some off."""
        num_steps = self.num_steps + below + above
        distances, heights = self.offsets[: self.num_steps], self.offsets[self.num_steps :]
        kept = np.arange(-below, self.num_steps + above)
        inside = (kept >= 0) & (kept < self.num_steps)
        own_s = np.where(inside, distances[kept.clip(0, self.num_steps - 1)], 0.0)
        # The level below the first step is kept as a level where steps are cut off, or where none are added.
        levels = np.arange(-below, self.num_steps + above + 1)
        known = (levels >= (0 if below <= 0 else 1)) & (levels <= self.num_steps)
        own_z = np.where(known, heights[levels.clip(0, self.num_steps)], 0.0)
        return replace(
            self,
            distance=self.distance - below * self.run,
            height=self.height - below * self.rise,
            num_steps=num_steps,
            offsets=np.concatenate([own_s, own_z]),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """The pieces of a profile that are seen, from the lowest rays to the highest.

    Attributes
    ----------
    surface, step
        (P,) which surface of which step each is.
    line
        (P, 2) a and b of its inverse forward distance Q = a + b·tau, 1/m.
    top
        (P,) slope at which it ends and the next one begins.
    line_gradient
        (P, 2, M) derivatives of ``line`` by the profile's shape: the M = 2 * num_steps + 6 values are the
        nosings' distances, the treads' heights from -1 on, overhang, thickness, rake, ground and slope.
    top_gradient
        (P, M) the same of ``top``; zero where two surfaces meet, which follows from their lines.
    """

    surface: IntArray
    step: IntArray
    line: Float64Array
    top: Float64Array
    line_gradient: Float64Array
    top_gradient: Float64Array

    def by(self, chain: Float64Array) -> Outline:
        """Return the outline with its derivatives by other values, given (M, K) those of its own by them."""
        return replace(self, line_gradient=self.line_gradient @ chain, top_gradient=self.top_gradient @ chain)

    @property
    def is_level(self) -> Mask:
        """(P,) whether each piece is level, so that its height is what it tells."""
        return np.asarray((self.surface == Surface.TREAD) | (self.surface == Surface.UNDERSIDE))


def outline_of(profile: StairProfile, *, min_extent: float = 1e-9) -> Outline:
    """Return what is seen of a profile.

    Along the profile, away from the camera, a surface is seen where its rays climb above all that came
    before; only a tread's front stands before what lies beneath it.

    Parameters
    ----------
    profile
        The section of a stairway.
    min_extent
        Level surfaces between upright ones, seen edge-on over a smaller range of slopes than this, are left
        out: a sensor shows a jump there.
    """
    pieces = _Pieces(profile)
    if profile.run > 0:
        pieces.add_ascending()
    else:
        pieces.add_descending()
    return pieces.visible(min_extent)


_RISER, _UNDERSIDE, _FRONT, _TREAD, _BEHIND = (int(surface) for surface in Surface)


class _Pieces:
    """All surfaces of a profile in the order in which a path away from the camera meets them."""

    def __init__(self, profile: StairProfile) -> None:
        n = profile.num_steps
        self.profile = profile
        self.s, self.z = profile.nosing_distances, profile.tread_heights
        shape = (n + 1, 4)
        self.surface = np.tile(np.arange(4), (n + 1, 1))
        self.step = np.tile(np.arange(-1, n)[:, None], (1, 4))
        self.end = np.full(shape, -np.inf)
        self.line = np.zeros((*shape, 2))
        self.line_gradient = np.zeros((*shape, 2, 2 * n + 6))
        self.end_gradient = np.zeros((*shape, 2 * n + 6))
        self.nosing = np.arange(n)
        self.level = n + 1 + np.arange(-1, n)
        self.overhang, self.thickness, self.rake, self.ground, self.slope = range(2 * n + 1, 2 * n + 6)

    def add_ascending(self) -> None:
        """Risers, undersides, fronts and treads of stairs that lead away from the camera upward."""
        profile, s = self.profile, self.s
        z, under = self.z[1:], self.z[1:] - profile.thickness
        seen = s > MIN_FORWARD
        near = np.maximum(s, MIN_FORWARD)
        rows = np.arange(1, len(s) + 1)
        is_above = under > 0
        self._set_line(_FRONT, rows, 1.0 / near, 0.0)
        self.line_gradient[rows, _FRONT, 0, self.nosing] = -1.0 / near**2
        inverse = 1.0 / np.where(is_above, under, 1.0)
        self._set_line(_UNDERSIDE, rows, 0.0, inverse)
        self.line_gradient[rows, _UNDERSIDE, 1, self.level[1:]] = -(inverse**2)
        self.line_gradient[rows, _UNDERSIDE, 1, self.thickness] = inverse**2
        self._add_treads()
        tread_end = np.append(self.z[:-1] / near, self.z[-1] / (near[-1] + profile.run))
        if profile.is_open:
            depth = profile.run + profile.overhang
            self._set_line(_RISER, rows, 1.0 / (near + BEHIND_SHARE * profile.run), 0.0)
            self.surface[rows, _RISER] = _BEHIND
            riser_end = under / (near + depth)
            tread_end[0] = self.z[0] / (near[0] + BEHIND_SHARE * profile.run)
            tread_end[1:] = z / (near + depth)
        else:
            self._add_risers(rows)
            riser = self.line[rows, _RISER]
            riser_end = _crossing(riser, self.line[rows, _UNDERSIDE])
            tread_end[:-1] = _crossing(self.line[:-1, _TREAD], riser)
        # From above, the front's lower edge hides the top of the riser behind it.
        self._set_end(_RISER, rows, np.where(is_above, riser_end, under / near), seen)
        self._set_nosing_slope(rows[~is_above], _RISER, under, thickness=-1.0)
        self._set_end(_UNDERSIDE, rows, under / near, seen & is_above)
        self._set_nosing_slope(rows, _UNDERSIDE, under, thickness=-1.0)
        self._set_end(_FRONT, rows, z / near, seen)
        self._set_nosing_slope(rows, _FRONT, z, thickness=0.0)
        # From high above, it also hides the back of the tread below.
        hides = np.flatnonzero(seen & (under / near < tread_end[:-1]))
        tread_end[hides] = under[hides] / near[hides]
        self._set_end(_TREAD, np.append(0, rows), tread_end, self.z < 0)
        self._set_nosing_slope(rows[hides], _TREAD, under, thickness=-1.0, before=1)

    def add_descending(self) -> None:
        """Treads of stairs that lead away from the camera downward: their risers face away."""
        near = np.maximum(self.s, MIN_FORWARD)
        self._add_treads()
        rows = np.arange(1, len(near) + 1)
        self._set_end(_TREAD, rows, self.z[1:] / near, (self.s > MIN_FORWARD) & (self.z[1:] < 0))
        self._set_nosing_slope(rows, _TREAD, self.z[1:], thickness=0.0)
        floor_end = self.z[:1] / (near[0] - self.profile.run)
        self._set_end(_TREAD, np.zeros(1, dtype=np.int64), floor_end, self.z[:1] < 0)

    def visible(self, min_extent: float) -> Outline:
        """The pieces that nothing hides, and what follows the last one."""
        order = slice(None) if self.profile.run > 0 else slice(None, None, -1)
        end = self.end[order].reshape(-1)
        highest = np.maximum.accumulate(np.concatenate([[-np.inf], end[:-1]]))
        gradient = self.end_gradient[order].reshape(len(end), -1)
        surface = self.surface[order].reshape(-1)
        is_level = (surface == _TREAD) | (surface == _UNDERSIDE)
        is_level &= self.profile.run > 0
        is_seen = end > highest + np.where(is_level, min_extent, 1e-9)
        # A riser then ends where the front before it begins.
        under = np.flatnonzero((surface == _UNDERSIDE) & ~is_seen & np.isfinite(end))
        end[under - 1], gradient[under - 1] = end[under], gradient[under]
        chosen = np.flatnonzero(is_seen)
        num_values = self.end_gradient.shape[-1]
        last = len(self.s) - 1 if self.profile.run > 0 else 0
        surface, line = surface[chosen], self.line[order].reshape(-1, 2)[chosen]
        beyond = [1.0 / (max(self.s[last], MIN_FORWARD) + BEHIND_SHARE * abs(self.profile.run)), 0.0]
        if len(chosen) and surface[-1] == _TREAD:
            # The last level seen goes on for as long as nothing is known of its end.
            beyond = line[-1].tolist()
        return Outline(
            surface=np.append(surface, _BEHIND).astype(np.int64),
            step=np.append(self.step[order].reshape(-1)[chosen], last).astype(np.int64),
            line=np.concatenate([line, [beyond]]),
            top=np.append(end[chosen], np.inf),
            line_gradient=np.concatenate(
                [self.line_gradient[order].reshape(-1, 2, num_values)[chosen], np.zeros((1, 2, num_values))]
            ),
            top_gradient=np.concatenate([gradient[chosen], np.zeros((1, num_values))]),
        )

    def _add_risers(self, rows: IntArray) -> None:
        rake, z = self.profile.rake, self.z[1:]
        foot = np.maximum(self.s + self.profile.overhang + rake * z, 0.5 * MIN_FORWARD)
        self._set_line(_RISER, rows, 1.0 / foot, rake / foot)
        for value, by in ((self.nosing, 1.0), (self.overhang, 1.0), (self.level[1:], rake), (self.rake, z)):
            self.line_gradient[rows, _RISER, 0, value] = -by / foot**2
            self.line_gradient[rows, _RISER, 1, value] = -rake * by / foot**2
        self.line_gradient[rows, _RISER, 1, self.rake] += 1.0 / foot

    def _add_treads(self) -> None:
        """Treads from -1, the floor, on."""
        rows = np.arange(len(self.z))
        profile = self.profile
        climb = profile.direction * (profile.ground + np.where(rows > 0, profile.slope, 0.0))
        # The floor's height is that where one more nosing would be.
        s = np.append(self.s[0] - profile.run, self.s)
        level = self.z - climb * s
        inverse = 1.0 / np.where(np.abs(level) > 1e-3, level, -1e-3)
        offset = -climb * inverse
        self._set_line(_TREAD, rows, offset, inverse)
        tread = _TREAD
        self.line_gradient[rows, tread, 1, self.level] = -(inverse**2)
        self.line_gradient[rows, tread, 0, self.level] = -offset * inverse
        sign = profile.direction
        nosing = np.append(0, self.nosing)
        for value, by, direct in (
            (nosing, -climb, 0.0),
            (self.ground, -sign * s, sign),
            (self.slope, np.where(rows > 0, -sign * s, 0.0), np.where(rows > 0, sign, 0.0)),
        ):
            self.line_gradient[rows, tread, 1, value] = -(inverse**2) * by
            self.line_gradient[rows, tread, 0, value] = -(offset * by + direct) * inverse

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
        s = np.maximum(self.s[step], MIN_FORWARD)
        self.end_gradient[ended, surface, self.level[rows]] = 1.0 / s
        self.end_gradient[ended, surface, self.nosing[step]] = -heights[step] / s**2
        self.end_gradient[ended, surface, self.thickness] = thickness / s


def _crossing(lower: Float64Array, upper: Float64Array) -> Float64Array:
    """(N,) slopes at which (N, 2) lines meet."""
    return np.asarray((upper[:, 0] - lower[:, 0]) / (lower[:, 1] - upper[:, 1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Optics:
    """How a camera shows edges.

    Attributes
    ----------
    row_size
        Height of a row of the image as a slope.
    smoothing
        Standard deviation over which the sensor and a pixel's footprint blend surfaces, rows.
    shift
        How many rows the sensor moves the edges of near surfaces outward.
    """

    row_size: float
    smoothing: float
    shift: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What rays of some slopes must see; all arrays begin with (N,).

    Attributes
    ----------
    slope
        tau of each ray.
    surface, step
        Which surface of which step it meets.
    inverse_distance
        Q, 1/m.
    by_slope
        Its derivative by the slope, 1/m.
    sensitivity
        How much Q changes with a surface that moves along its own normal, 1/m per m.
    edge_spread
        What the place of an edge within its row adds to the standard deviation of Q, 1/m.
    farthest
        Q from which on anything farther agrees as well, 1/m: 0 where the surface itself must be seen.
    gradient
        (N, K + 1) derivatives of Q by the K values of the outline's derivatives, and by the shift of edges;
        (N, 0) where it was not asked for.
    """

    slope: Float64Array
    surface: IntArray
    step: IntArray
    inverse_distance: Float64Array
    by_slope: Float64Array
    sensitivity: Float64Array
    edge_spread: Float64Array
    farthest: Float64Array
    gradient: Float64Array

    def entries(self, slopes: Float64Array) -> IntArray:
        """Return which ray of an evenly spaced prediction is nearest to each of some slopes."""
        if len(self.slope) < 2:
            return np.zeros(slopes.shape, dtype=np.int64)
        spacing = self.slope[1] - self.slope[0]
        place = np.rint((slopes - self.slope[0]) / spacing)
        return np.asarray(np.clip(place, 0, len(self.slope) - 1), dtype=np.int64)

    def expected(self, slopes: Float64Array, entries: IntArray) -> Float64Array:
        """Return Q of rays near some entries: between edges it is straight."""
        return self.inverse_distance[entries] + self.by_slope[entries] * (slopes - self.slope[entries])


ROWS_PER_ENTRY = 0.5
"""Predictions are tabulated at every half row."""


def tabulate(outline: Outline, optics: Optics, low: float, high: float, *, has_gradient: bool) -> Prediction:
    """Predict what rays see at every half row between two slopes."""
    spacing = ROWS_PER_ENTRY * optics.row_size
    slopes = low + spacing * np.arange(max(int((high - low) / spacing) + 2, 1))
    return predict(outline, np.asarray(slopes, dtype=np.float64), optics, has_gradient=has_gradient)


def predict(
    outline: Outline, slopes: Float64Array, optics: Optics, *, has_gradient: bool = True
) -> Prediction:
    """Predict the inverse forward distance that rays measure.

    Parameters
    ----------
    outline
        What is seen of a profile.
    slopes
        (N,) slopes tau of the rays.
    optics
        How the camera shows edges.
    has_gradient
        Whether derivatives are wanted.

    Notes
    -----
    A smoothed row of straight pieces is the pieces plus, at each border, the jump times the kernel's
    integral and the change of slope times its second integral. The kernel is logistic, whose integrals
    have closed forms.
    """
    width = max(optics.smoothing * LOGISTIC_WIDTH, 1e-3) * optics.row_size
    line, top = outline.line, outline.top[:-1]
    jump = (line[1:, 0] - line[:-1, 0]) + (line[1:, 1] - line[:-1, 1]) * top
    at_edge = np.maximum(line[1:, 0] + line[1:, 1] * top, line[:-1, 0] + line[:-1, 1] * top)
    outward = np.where(np.abs(jump) > MIN_SHIFTED_JUMP * at_edge, -np.sign(jump), 0.0) * optics.row_size
    border = top + optics.shift * outward
    piece = np.searchsorted(np.maximum.accumulate(border), slopes, side="right")
    value = line[piece, 0] + line[piece, 1] * slopes
    by_slope = line[piece, 1].copy()
    gradient = np.zeros((len(slopes), 0))
    if has_gradient:
        gradient = np.zeros((len(slopes), outline.top_gradient.shape[1] + 1))
        gradient[:, :-1] = outline.line_gradient[piece, 0] + slopes[:, None] * outline.line_gradient[piece, 1]
    sensitivity = np.where(outline.is_level[piece], np.abs(value * line[piece, 1]), value**2)
    variance = np.zeros(len(slopes))
    is_behind = outline.surface == Surface.BEHIND
    farthest = np.where(is_behind[piece], value, 0.0)
    blend = max(optics.smoothing / EDGE_PLACE_STD - 1.0, 0.0)
    for side in (1, -1) if len(border) else ():
        # The border above the piece, then the one below it; only rays near it feel the neighbour.
        index = piece if side > 0 else piece - 1
        has_border = (index >= 0) & (index < len(border))
        offset = (slopes - border[index.clip(0, len(border) - 1)]) / width
        rows = np.flatnonzero(has_border & (np.abs(offset) < MAX_OFFSET))
        at, x = index[rows], side * offset[rows]
        share = 1.0 / (1.0 + np.exp(-x))
        ramp = np.log1p(np.exp(x))
        kink = line[at + 1, 1] - line[at, 1]
        steepness = jump[at] * share * (1 - share) / width
        value[rows] += side * jump[at] * share + kink * width * ramp
        by_slope[rows] += steepness + side * kink * share
        variance[rows] += (steepness * EDGE_PLACE_STD * optics.row_size) ** 2
        # How far a wide ramp falls is unknown where nothing is known of what lies behind.
        either_behind = is_behind[at] | is_behind[at + 1]
        variance[rows] += either_behind * blend * share * (1 - share) * jump[at] ** 2
        other = at + 1 if side > 0 else at
        limit = line[other, 0] + line[other, 1] * slopes[rows]
        near = is_behind[other] & (np.abs(x) < NEAR_OFFSET)
        farthest[rows] = np.where(near, np.maximum(farthest[rows], limit), farthest[rows])
        if has_gradient:
            change = side * (outline.line_gradient[at + 1] - outline.line_gradient[at])
            gradient[rows, :-1] += share[:, None] * change[:, 0]
            gradient[rows, :-1] += (share * top[at] + side * width * ramp)[:, None] * change[:, 1]
            gradient[rows, :-1] -= steepness[:, None] * outline.top_gradient[at]
            gradient[rows, -1] -= steepness * outward[at]
    return Prediction(
        slope=slopes,
        surface=outline.surface[piece],
        step=outline.step[piece],
        inverse_distance=value,
        by_slope=by_slope,
        sensitivity=sensitivity,
        edge_spread=np.sqrt(variance),
        farthest=farthest,
        gradient=gradient,
    )
