"""Count what the rays say of each step of a profile: on it, hidden, seen through, or not measured.

A ray is *on* the profile where it met what was predicted, *nearer* where something hides it, *farther* where
it passed through what should be solid, and *unmeasured* where the sensor gave nothing. A nosing is where a
surface ends: beneath it rays lie on the step, above it they go farther than that surface continued. This one
comparison with the surface that goes on tells a step from a wall (a riser that goes on upward) and from a
floor (a level that goes on forward).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.elevation import Elevation
from stairmap.detection.fit import FittedProfile, Rays
from stairmap.detection.profile import MIN_FORWARD, Prediction, StairProfile, Surface

SURFACE_TOLERANCE = 0.012
"""A ray this near a surface, along its normal, is on it, m: three times the irregularity of built steps."""

NUM_SIGMA = 3.0
"""... beyond so many standard deviations of its noise."""

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

LEAST_DEPTH = 1e-3
"""A level less than this below the camera is seen edge-on, m."""

MIN_DIFFERENCE = 1.5
"""A ray tells whether a surface goes on where that makes a difference of so many standard deviations: many
rays together decide."""

MAX_UNSEEN = 1
"""Steps on end that may be hidden before stairs end for the eye."""

FLAT_ROUNDS = 4
"""Rounds in which a flat surface is fitted robustly to the rays."""

SIDE_SHARE = 0.03
"""Stairs reach from this share to the rest of the rays on them, ordered across: a few lie beside them."""

FAR_LEVEL = (1.15, 1.8)
"""A level that is seen between so many runs from its nosing is a floor or a landing: treads end before."""

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
    """

    on: IntArray
    nearer: IntArray
    farther: IntArray
    unmeasured: IntArray
    on_tread: IntArray
    farther_tread: IntArray
    continued: IntArray
    ended: IntArray

    def of_steps(self, first: int, last: int) -> Evidence:
        """Return the evidence of some steps only, the last one included."""
        kept = {field.name: getattr(self, field.name)[..., first : last + 1] for field in fields(self)}
        return Evidence(**kept)

    @property
    def goes_on(self) -> Mask:
        """(num_steps,) whether a surface that should end at the nosing goes on: a wall, or a floor."""
        most = self.continued > MAX_CONTINUED * (self.continued + self.ended)
        return np.asarray((most & (self.continued >= MIN_RAYS)).any(axis=0))

    @property
    def is_seen(self) -> Mask:
        """(num_steps,) whether rays lie on the step, and its surface ends at its nosing."""
        measured = self.on + self.farther + self.nearer
        shows = (self.on >= MIN_RAYS) & (self.on >= MIN_ON_SHARE * (self.on + self.farther))
        shows &= self.on >= MIN_SHOWN_SHARE * measured
        return np.asarray(shows & ~self.goes_on)

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
    is_level = (predicted.surface == Surface.TREAD) | (predicted.surface == Surface.UNDERSIDE)
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
    n = profile.num_steps
    predicted = fitted.predict(rays.slope, profile)
    entry = predicted.entries(rays.slope)
    expected = predicted.expected(rays.slope, entry)
    # Where an edge's place within the row decides what a ray sees, it tells nothing of the surface.
    limit = tolerances(predicted, profile, fitted.noise)
    is_plain = (predicted.edge_spread < limit)[entry]
    tolerance, surface, step = limit[entry], predicted.surface[entry], predicted.step[entry]
    measured = rays.inverse_distance > 0
    off = rays.inverse_distance - expected
    is_on = measured & (np.abs(off) < tolerance)
    is_nearer, is_farther = measured & (off >= tolerance), measured & (off <= -tolerance)
    is_face = (surface == Surface.RISER) | (surface == Surface.FRONT)
    is_tread = surface == Surface.TREAD
    is_own = is_face if profile.run > 0 else is_tread
    # Across the stairs, at the distance that is predicted.
    across = rays.bearing / np.maximum(expected, 1e-6)
    inside = _between_sides(across, step, is_on & is_own & (step >= 0), n)
    is_beside = is_tread if profile.run > 0 else np.zeros(len(step), bool)

    def count(chosen: Mask) -> IntArray:
        kept = chosen & (step >= 0)
        return np.bincount(step[kept], minlength=n)

    own, beside = is_own & is_plain & inside, is_beside & is_plain & inside
    expected = np.maximum(expected, predicted.farthest[entry])
    continued, ended = _continuations(rays, expected, profile, fitted.noise, inside)
    return Evidence(
        on=count(own & is_on),
        nearer=count(own & is_nearer),
        farther=count(own & is_farther),
        unmeasured=count(own & ~measured),
        on_tread=count(beside & is_on),
        farther_tread=count(beside & is_farther),
        continued=continued,
        ended=ended,
    )


def _between_sides(across: Float64Array, step: IntArray, on: Mask, n: int) -> Mask:
    """Whether rays meet the stairs between their sides: the medians of those of the steps, so that a floor
    that is wider than the stairs, or a step that the image cuts, does not decide."""
    lefts, rights = [], []
    order = np.lexsort((across, np.where(on, step, n)))
    edges = np.searchsorted(np.where(on, step, n)[order], np.arange(n + 1))
    for first, last in pairwise(edges.tolist()):
        few = int(SIDE_SHARE * (last - first))
        if last - first >= MIN_RAYS:
            rights.append(across[order[first + few]])
            lefts.append(across[order[last - 1 - few]])
    if not lefts:
        return np.zeros(len(across), dtype=bool)
    return np.asarray((across >= np.median(rights)) & (across <= np.median(lefts)))


def _continuations(
    rays: Rays, expected: Float64Array, profile: StairProfile, noise: float, usable: Mask
) -> tuple[IntArray, IntArray]:
    """Rays about each nosing that see a surface go on where it should end, and that do not.

    Above the nosing the surface beneath it would go on: a wall, or a floor for stairs that descend. Beneath
    the nosing of stairs that ascend, the tread would go on towards the camera: a floor. (2, num_steps) each,
    above and beneath.
    """
    n = profile.num_steps
    s, z = np.maximum(profile.nosing_distances, MIN_FORWARD), profile.tread_heights
    usable = usable & (rays.inverse_distance > 0)
    slope, q, stairs = rays.slope[usable], rays.inverse_distance[usable], expected[usable]
    # Steps in the order in which their nosings are seen, those beside the camera left out.
    order = np.flatnonzero(profile.nosing_distances > MIN_FORWARD)[:: int(profile.direction)]
    nosing = np.maximum.accumulate(z[1:][order] / s[order])
    place = np.searchsorted(nosing, slope)
    last = len(order) - 1
    above, beneath = order[(place - 1).clip(0, last)], order[place.clip(0, last)]
    if profile.run > 0:
        is_above = (place > 0) & (slope < ((z[1:] + CONTINUED_HEIGHT * profile.rise) / s)[above])
        going_on = 1.0 / s[above]
        is_beneath = (place <= last) & (slope > (z[:-1] / s)[beneath]) & (z[1:][beneath] < 0)
    else:
        reach = s + CONTINUED_HEIGHT * abs(profile.run)
        is_above = (place > 0) & (slope < (z[1:] / reach)[above])
        going_on = slope / np.minimum(z[1:], -LEAST_DEPTH)[above]
        is_beneath = np.zeros(len(slope), dtype=bool)
    level = slope / np.minimum(z[1:], -LEAST_DEPTH)[beneath]
    continued, ended = np.zeros((2, n), dtype=np.int64), np.zeros((2, n), dtype=np.int64)
    for row, (step, inside, surface) in enumerate(
        ((above, is_above, going_on), (beneath, is_beneath, level))
    ):
        # Only where the two can be told apart; what is nearer than both hides them.
        differ = inside & (surface - stairs > MIN_DIFFERENCE * noise)
        differ &= q < surface + np.minimum(SURFACE_TOLERANCE * surface**2 + NUM_SIGMA * noise, 0.5 * surface)
        goes_on = q > 0.5 * (surface + stairs)
        continued[row] = np.bincount(step[differ & goes_on], minlength=n)
        ended[row] = np.bincount(step[differ & ~goes_on], minlength=n)
    return continued, ended


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
    main = int(np.argmax(np.where(is_seen & inside, evidence.on, -1)))
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
    chosen = (rays.slope > low) & (rays.slope < high) & (rays.inverse_distance > 0)
    if np.count_nonzero(chosen) < MIN_RAYS:
        return 1.0
    slope, q = rays.slope[chosen], rays.inverse_distance[chosen]
    entry = predicted.entries(slope)
    across = rays.bearing[chosen] / np.maximum(predicted.expected(slope, entry), 1e-6)
    inside = (across > sides[0]) & (across < sides[1])
    if np.count_nonzero(inside) < MIN_RAYS:
        return 1.0
    slope, q, entry = slope[inside], q[inside], entry[inside]
    variance = fitted.noise**2 + (SURFACE_TOLERANCE / NUM_SIGMA * predicted.sensitivity[entry]) ** 2
    # What lies behind an edge may be as far as it likes.
    by_steps = (np.maximum(q, predicted.farthest[entry]) - predicted.expected(slope, entry)) ** 2
    weight = 1.0 / variance
    middle = slope - slope.mean()
    for _ in range(FLAT_ROUNDS):
        total, mean = weight.sum(), (weight @ q) / weight.sum()
        center = (weight @ middle) / total
        steepness = (weight @ ((middle - center) * (q - mean))) / max(weight @ (middle - center) ** 2, 1e-12)
        by_flat = (q - mean - steepness * (middle - center)) ** 2
        weight = 1.0 / (variance * (1.0 + by_flat / variance / NUM_SIGMA**2) ** 2)

    def cost(squares: Float64Array) -> float:
        ratio = squares / variance
        return float(np.sum(ratio / (1.0 + ratio / NUM_SIGMA**2)))

    return cost(by_steps) / max(cost(by_flat), 1e-9)


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
