"""Count what the rays say of each step of a profile: on it, hidden, seen through, or not measured.

A ray is *on* the profile where it met what was predicted, *nearer* where something hides it, *farther* where
it passed through what should be solid, and *unmeasured* where the sensor gave nothing. A nosing is where a
surface ends: beneath it rays lie on the step, above it they go farther than that surface continued. This one
comparison with the surface that goes on tells a step from a wall (a riser that goes on upward) and from a
floor (a level that goes on forward).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation
from stairmap.detection.fit import FittedProfile, Rays
from stairmap.detection.profile import (
    MIN_FORWARD,
    PIECE_KINDS,
    ROWS_PER_ENTRY,
    Prediction,
    StairProfile,
    edge_optics,
    section_limits,
)
from stairmap.kernels import compare_with_line, count_steps, outlines
from stairmap.kernels.counts import LineLimits
from stairmap.kernels.step_counts import CountLimits

SURFACE_TOLERANCE = 0.012
"""A ray this near a surface, along its normal, is on it, m: three times the irregularity of built steps."""

NUM_SIGMA = 3.0
"""... beyond this many standard deviations of its noise."""

MAX_TOLERANCE_SHARE = 0.3
"""... and never more than this share of a run (risers) or a rise (treads)."""

MIN_ON_SHARE = 0.5
"""Share of the rays that reached a step's surface, not hidden, that must lie on it."""

MIN_SHOWN_SHARE = 0.2
"""Share of all measured rays towards a step that must lie on it: what is hidden by more is not seen."""

MIN_RAYS = 4
"""Fewest rays of strips on a step; each averages sixteen pixels."""

MAX_CONTINUED = 0.5
"""Where more than this share of the rays above a nosing see its surface go on, it is none."""

CONTINUED_HEIGHT = 0.8
"""How far above a nosing it is looked whether its surface goes on, in rises (or in runs, for a level)."""

LEAST_EXPECTED = 1e-6
"""Rays that should see something farther are compared as if they should see this, 1/m: a thousand km."""

MAX_HIDING_SHARE = 0.5
"""What is nearer than a surface by this share of its inverse distance hides it, however large the noise."""

LEAST_DEPTH = 1e-3
"""A level less than this below the camera is seen edge-on, m."""

MIN_DIFFERENCE = 1.5
"""A ray tells whether a surface goes on where that makes a difference of this many standard deviations: many
rays together decide."""

MAX_UNSEEN = 1
"""Steps on end that may be hidden before stairs end for the eye."""

FLAT_ROUNDS = 4
"""Rounds in which a flat surface is fitted robustly to the rays."""

SIDE_SHARE = 0.03
"""Stairs reach from this share to the rest of the rays on them, ordered across: a few lie beside them."""

FAR_LEVEL = (1.15, 1.8)
"""A level that is seen between these two numbers of runs from its nosing is a floor or a landing: treads end
before."""

MIN_LEVEL_RAYS = 6
"""Fewest rays on such a level."""

LEVEL_TOLERANCE = 0.3
"""A floor or landing lies within this share of a rise of where the next tread would."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What rays say of each step; all arrays are (num_steps,), counts of rays of strips.

    Attributes
    ----------
    on, nearer, farther, unmeasured
        Rays towards what tells the step: its riser and front, or its tread where stairs descend.
    on_tread, farther_tread
        The same of the tread behind the nosing; not all of them show.
    continued, ended
        (2, num_steps) rays just above the nosing that see the surface beneath it go on, and that do not; then
        those beneath it that see the tread go on towards the camera, and that do not.
    goes_on
        (num_steps,) whether a surface that should end at the nosing goes on: a wall, or a floor.
    is_seen
        (num_steps,) whether rays lie on the step, and its surface ends at its nosing.
    """

    on: IntArray
    nearer: IntArray
    farther: IntArray
    unmeasured: IntArray
    on_tread: IntArray
    farther_tread: IntArray
    continued: IntArray
    ended: IntArray
    goes_on: Mask = field(init=False)
    is_seen: Mask = field(init=False)

    def __post_init__(self) -> None:
        most = self.continued > MAX_CONTINUED * (self.continued + self.ended)
        goes_on = (most & (self.continued >= MIN_RAYS)).any(axis=0)
        reached = self.on + self.farther
        shows = (self.on >= MIN_RAYS) & (self.on >= MIN_ON_SHARE * reached)
        shows &= self.on >= MIN_SHOWN_SHARE * (reached + self.nearer)
        object.__setattr__(self, "goes_on", goes_on)
        object.__setattr__(self, "is_seen", shows & ~goes_on)

    def of_steps(self, first: int, last: int) -> Evidence:
        """Return the evidence of some steps only, the last one included."""
        names = [count.name for count in fields(self) if count.init]
        return Evidence(**{name: getattr(self, name)[..., first : last + 1] for name in names})

    @property
    def is_refuted(self) -> Mask:
        """(num_steps,) whether rays went through where the step would be, or its surface goes on."""
        through = self.farther > MIN_ON_SHARE * (self.on + self.farther)
        return np.asarray((through & (self.farther >= MIN_RAYS)) | self.goes_on)


def all_rays(elevation: Elevation, strips: IntArray, row_step: int = 1) -> Rays:
    """Return all rays of some strips and every ``row_step``-th row, also those without a measurement, whose
    inverse distance is 0."""
    num_rows = -(-len(elevation.slope) // row_step)
    row, place = np.divmod(np.arange(num_rows * len(strips)), len(strips))
    row, strip = row * row_step, strips[place]
    return Rays(
        slope=elevation.slope[row],
        bearing=elevation.bearing[strip],
        inverse_distance=elevation.inverse_distance[row, strip],
        row=row,
        strip=strip,
    )


def tolerances(predicted: Prediction, profile: StairProfile, noise: float) -> Float64Array:
    """(N,) how far inverse distance may be off for a ray to be on its surface, 1/m."""
    is_level = (predicted.surface == outlines.TREAD) | (predicted.surface == outlines.UNDERSIDE)
    limit = np.where(is_level, profile.rise, abs(profile.run)) * MAX_TOLERANCE_SHARE
    sensitivity = predicted.sensitivity
    return np.asarray(np.minimum(SURFACE_TOLERANCE * sensitivity + NUM_SIGMA * noise, limit * sensitivity))


def count_evidence(rays: Rays, fitted: FittedProfile, profile: StairProfile) -> Evidence:
    """Count the rays of some strips for and against each step of a profile.

    Rays beside the stairs say nothing of them: only those count that would meet the profile between the
    sides of what lies on it.

    Parameters
    ----------
    rays
        All rays of the strips, in the fitted axes.
    fitted
        How the sensor shows edges, and the noise.
    profile
        The fitted profile, mostly with more steps than were found: they are tried here.
    """
    optics = fitted.optics
    counts, continued = count_steps(
        rays.arrays,
        (profile.nosing_distances, profile.tread_heights),
        profile.rise,
        profile.shape,
        profile.is_open,
        edge_optics(optics),
        PIECE_KINDS,
        section_limits(optics.smoothing * optics.row_size),
        _LIMITS._replace(spacing=ROWS_PER_ENTRY * optics.row_size, noise=fitted.noise),
    )
    on, nearer, farther, unmeasured, on_tread, farther_tread = counts
    return Evidence(
        on=on,
        nearer=nearer,
        farther=farther,
        unmeasured=unmeasured,
        on_tread=on_tread,
        farther_tread=farther_tread,
        continued=continued[:, 0],
        ended=continued[:, 1],
    )


_LIMITS = CountLimits(
    spacing=math.nan,
    noise=math.nan,
    tolerance=SURFACE_TOLERANCE,
    num_sigma=NUM_SIGMA,
    max_tolerance_share=MAX_TOLERANCE_SHARE,
    side_share=SIDE_SHARE,
    min_rays=MIN_RAYS,
    least_expected=LEAST_EXPECTED,
    min_difference=MIN_DIFFERENCE,
    max_hiding_share=MAX_HIDING_SHARE,
    continued_height=CONTINUED_HEIGHT,
    least_depth=LEAST_DEPTH,
)
"""How rays count; spacing and noise are those of a frame."""


def choose_steps(evidence: Evidence, found: tuple[int, int]) -> tuple[int, int] | None:
    """Return the first and last step of the stairs that were seen, or ``None``.

    From the best step that found the lattice it is gone up and down. A step that is hidden or shows too
    little may be passed over if the next one is seen; one that is refuted ends the stairs.

    Parameters
    ----------
    evidence
        Of all steps that are tried.
    found
        First and last step that found the lattice.
    """
    is_seen, is_refuted = evidence.is_seen, evidence.is_refuted
    inside = np.zeros(len(is_seen), dtype=bool)
    inside[found[0] : found[1] + 1] = True
    if not (is_seen & inside).any():
        return None
    main = int(np.argmax(np.where(is_seen & inside, evidence.on, 0)))
    ends = []
    for direction in (-1, 1):
        end, place, unseen = main, main + direction, 0
        while 0 <= place < len(is_seen) and unseen <= MAX_UNSEEN:
            if is_seen[place]:
                end, unseen = place, 0
            elif is_refuted[place]:
                break
            else:
                unseen += 1
            place += direction
        ends.append(end)
    return ends[0], ends[1]


def compare_with_flat(
    rays: Rays, fitted: FittedProfile, predicted: Prediction, sides: tuple[float, float]
) -> float:
    """Compare how well steps explain the rays with how well one flat surface does: a wall, floor or ramp.

    In inverse distance over slope, any flat surface is a straight line. It is fitted to the same rays, those
    from the foot of the stairs to the last nosing, robustly and with the same noise.

    Parameters
    ----------
    rays
        Rays of the stairs' strips in the fitted axes.
    fitted, predicted
        The profile of the steps that were seen, and what it says of the elevation's rays.
    sides
        Right and left side of the stairs, m.

    Returns
    -------
    Cost of the steps over that of the flat surface: near 0 for stairs, 1 where steps explain nothing more.
    """
    profile = fitted.profile
    s, z = np.maximum(profile.nosing_distances, MIN_FORWARD), profile.tread_heights
    low, high = (z[0] / s[0], z[-1] / s[-1]) if profile.run > 0 else (z[-1] / s[-1], z[1] / s[0])
    limits = LineLimits(
        low=float(low),
        high=float(high),
        right=sides[0],
        left=sides[1],
        noise=fitted.noise,
        surface_std=SURFACE_TOLERANCE / NUM_SIGMA,
        tail=NUM_SIGMA,
        num_rounds=FLAT_ROUNDS,
        min_rays=MIN_RAYS,
        least_expected=LEAST_EXPECTED,
    )
    num, by_steps, by_flat = compare_with_line(rays.arrays, predicted.table, limits)
    return by_steps / max(by_flat, 1e-9) if num >= MIN_RAYS else 1.0


def is_level_seen(rays: Rays, profile: StairProfile, *, is_top: bool) -> bool:
    """Whether the level before the first nosing, or behind the last, reaches farther than a tread does.

    Parameters
    ----------
    rays
        Rays of the stairs' strips in the fitted axes.
    profile
        The steps that were seen.
    is_top
        Whether the level behind the last nosing is meant.
    """
    q = np.maximum(rays.inverse_distance, 1e-6)
    s, z = 1.0 / q, rays.slope / q
    if is_top:
        x = (s - profile.nosing_distances[-1]) / profile.run
        off = z - profile.tread_heights[-1]
    else:
        x = (profile.nosing_distances[0] - s) / profile.run
        off = z - profile.tread_heights[0]
    inside = (rays.inverse_distance > 0) & (x > FAR_LEVEL[0]) & (x < FAR_LEVEL[1])
    on_level = np.count_nonzero(inside & (np.abs(off) < LEVEL_TOLERANCE * profile.rise))
    return bool(on_level >= max(MIN_LEVEL_RAYS, 0.5 * np.count_nonzero(inside)))
