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

from stairmap.arrays import Float64Array, IntArray, readonly
from stairmap.kernels import outlines, predict_rays, trace_outline
from stairmap.kernels.equations import TableArrays, nearest_entries
from stairmap.kernels.outlines import OutlineArrays, SectionLimits, SectionShape
from stairmap.kernels.predictions import EdgeOptics, PieceKinds

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
"""A border is felt over this many widths of the kernel; over the second number of them its other side counts
as seen."""

LOGISTIC_WIDTH = 0.55
"""Scale of the logistic function that is nearest to a Gaussian's integral, in its standard deviations."""


LEAST_LEVEL = 1e-3
"""A level nearer to the camera's height than this is seen edge-on, as one that lies so far below, m."""

LEAST_EXTENT = 1e-9
"""What is seen over a smaller range of slopes is not seen, m per m."""

LEAST_SMOOTHING = 1e-3
"""No sensor shows an edge sharper than over this, rows."""


class Surface(IntEnum):
    """The surfaces of a step; ``BEHIND`` is what is seen past an edge, farther than it but unknown."""

    RISER = outlines.RISER
    UNDERSIDE = outlines.UNDERSIDE
    FRONT = outlines.FRONT
    TREAD = outlines.TREAD
    BEHIND = outlines.BEHIND


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
    def shape(self) -> SectionShape:
        """What all steps share, as kernels take it."""
        return SectionShape(self.run, self.overhang, self.thickness, self.rake, self.ground, self.slope)

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
        offsets = np.zeros(2 * num_steps + 1)
        first, end = max(-below, 0), self.num_steps + min(above, 0)
        offsets[first + below : end + below] = distances[first:end]
        # The level below the first step is kept as a level where steps are cut off, or where none are added.
        first, end = (1 if below > 0 else -below), end + 1
        offsets[num_steps + first + below : num_steps + end + below] = heights[first:end]
        return replace(
            self,
            distance=self.distance - below * self.run,
            height=self.height - below * self.rise,
            num_steps=num_steps,
            offsets=offsets,
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

    @property
    def arrays(self) -> OutlineArrays:
        """All of it, as kernels take it."""
        return self.surface, self.step, self.line, self.top, self.line_gradient, self.top_gradient


def outline_of(profile: StairProfile, *, min_extent: float = LEAST_EXTENT) -> Outline:
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
    surface, step, line, top, line_gradient, top_gradient = trace_outline(
        profile.nosing_distances,
        profile.tread_heights,
        profile.shape,
        profile.is_open,
        section_limits(min_extent),
    )
    return Outline(
        surface=surface, step=step, line=line, top=top, line_gradient=line_gradient, top_gradient=top_gradient
    )


def section_limits(min_extent: float) -> SectionLimits:
    """How a section is seen, level surfaces over a smaller range of slopes than this left out."""
    return SectionLimits(MIN_FORWARD, BEHIND_SHARE, LEAST_LEVEL, LEAST_EXTENT, min_extent)


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
        (N, M + 1) derivatives of Q by the M values of the outline's derivatives, and by the shift of edges;
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

    @property
    def table(self) -> TableArrays:
        """What kernels compare rays with, where the slopes are evenly spaced."""
        q, by_slope = self.inverse_distance, self.by_slope
        return self.slope, q, by_slope, self.sensitivity, self.edge_spread, self.farthest

    def entries(self, slopes: Float64Array) -> IntArray:
        """Return which ray of an evenly spaced prediction is nearest to each of some slopes."""
        return nearest_entries(self.slope, slopes)

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
    """
    slopes = np.ascontiguousarray(slopes, dtype=np.float64)
    surface, step, q, by_slope, sensitivity, edge_spread, farthest, gradient = predict_rays(
        outline.arrays, slopes, edge_optics(optics), PIECE_KINDS, has_gradient
    )
    return Prediction(
        slope=slopes, surface=surface, step=step, inverse_distance=q, by_slope=by_slope,
        sensitivity=sensitivity, edge_spread=edge_spread, farthest=farthest, gradient=gradient,
    )  # fmt: skip


PIECE_KINDS = PieceKinds(int(Surface.BEHIND), int(Surface.TREAD), int(Surface.UNDERSIDE))
"""Which surfaces are unknown, and which level, as kernels take them."""


def edge_optics(optics: Optics) -> EdgeOptics:
    """How borders are blended, as kernels take it."""
    return EdgeOptics(
        row_size=optics.row_size,
        width=max(optics.smoothing * LOGISTIC_WIDTH, LEAST_SMOOTHING) * optics.row_size,
        shift=optics.shift,
        place_std=EDGE_PLACE_STD * optics.row_size,
        blend=max(optics.smoothing / EDGE_PLACE_STD - 1.0, 0.0),
        min_shifted_jump=MIN_SHIFTED_JUMP,
        max_offset=MAX_OFFSET,
        near_offset=NEAR_OFFSET,
    )
