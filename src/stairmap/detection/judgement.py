"""Judge whether a fitted profile is a stairway: each rule that it breaks becomes a rejection.

Every rule names a property of stairs: how many steps they have, how large steps are, that they are solid,
regular and parallel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import median

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.config import Config, EnvelopeConfig
from stairmap.detection.evidence import Evidence, compare_with_flat
from stairmap.detection.fit import FittedProfile, Rays
from stairmap.detection.observation import Rejection
from stairmap.detection.profile import Prediction, StairProfile
from stairmap.kernels import sum_risers
from stairmap.kernels.counts import RiserLimits

MAX_SEE_THROUGH, SEE_THROUGH_PER_STEP = 0.30, 0.05
"""Largest share of rays that go through what should be solid, and how much of it each step beyond two allows:
real treads and risers let nothing through, and few steps line up by chance where many do not."""

MAX_HIDDEN = 0.60
"""Largest share of rays towards the stairs that end at something in front of them. People and bags hide a
part; what hides most is the thing itself: a pallet, through whose gaps a few boards line up."""

MAX_FLATNESS = 0.65
"""Steps must leave at most this share of what one flat surface leaves unexplained: where noise is as large as
steps, any lattice fits a slope."""

MAX_IRREGULARITY = 0.035
"""Largest root mean square of the steps' own places off the regular ones, m."""

MIN_OPEN_STEPS = 4
"""Fewest steps where only the fronts of slabs are seen: three bars also line up in furniture."""

MAX_TURN = np.radians(6.0)
"""Largest angle between a step and the others beyond its noise, rad: eight winders to a quarter turn by
11 degrees each."""

MAX_GROWTH = np.radians(2.0)
"""Largest growth of the angle from step to step beyond its noise, rad: winders grow twice on end."""

MAX_TURN_STD = np.radians(15.0)
"""An angle known worse than this tells nothing, rad."""

TURN_BAND = 0.45
"""Rays within this share of a run of a riser tell how it is turned; a turned riser leaves a narrow band."""

RAYS_PER_SAMPLE = 1.5
"""This many rays tell a turn like one independent sample: across the stairs neighbours err less together."""

MIDDLE_SHARE = 0.3
"""Rays within this share of a rise from a riser's middle tell how it is turned: near its edges they mix."""

SIDE_MARGIN = 0.05
"""So near to the ends of the stairs rays do not tell a turn, m: a strip's ray averages over that much."""

MIN_TURN_RAYS = 8
"""Fewest rays that tell how a step is turned."""

MAX_SLACK = 0.02
"""The envelope is widened by two standard deviations of a measure, but never by more than this, m."""

PITCH_SLACK_DEG = 1.0
"""The same of pitch, degrees."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """All that is known of a candidate when it is judged.

    Attributes
    ----------
    fitted, predicted
        The fitted profile of the steps that were seen, and what it says of the elevation's rays.
    evidence
        Of each of its steps.
    rays
        Rays of the stairs' strips in the fitted axes.
    sides
        Right and left end of the stairs, m to the left of the camera's sagittal plane; NaN where not seen.
    """

    fitted: FittedProfile
    predicted: Prediction
    evidence: Evidence
    rays: Rays
    sides: tuple[float, float]

    @property
    def width(self) -> float:
        """Distance between the ends, m; 0 where none was seen."""
        width = self.sides[1] - self.sides[0]
        return width if np.isfinite(width) else 0.0


def find_rejections(case: Case, config: Config) -> tuple[Rejection, ...]:
    """Return all the rules that a candidate breaks; none when it is a stairway."""
    found = [
        *_check_steps(case, config.detection.min_steps),
        *_check_envelope(case.fitted, config.envelope),
        *_check_solid(case),
        *_check_regular(case.fitted),
        *_check_not_flat(case),
    ]
    if case.width < config.envelope.min_width:
        found.append(_broken("min_width", case.width, config.envelope.min_width, "m"))
    return tuple(found)


def _broken(rule: str, measured: float, limit: float, unit: str) -> Rejection:
    return Rejection(rule=rule, measured=float(measured), limit=float(limit), unit=unit)


def _check_steps(case: Case, min_steps: int) -> list[Rejection]:
    """Enough steps that were seen, each parallel to the others."""
    turn, std = measure_turns(case.rays, case.fitted.profile, case.sides)
    turned, largest = find_turned(turn, std)
    is_seen = case.evidence.is_seen & ~turned
    found = []
    if case.fitted.profile.is_open and not case.evidence.on_tread.any():
        min_steps = max(min_steps, MIN_OPEN_STEPS)
    num_seen = int(np.count_nonzero(is_seen))
    if num_seen < min_steps:
        found.append(_broken("min_steps", num_seen, min_steps, "1"))
        if largest > 0:
            found.append(_broken("max_turn", np.degrees(largest), np.degrees(MAX_TURN), "deg"))
    num_pairs = int(np.count_nonzero(is_seen[1:] & is_seen[:-1]))
    if 2 * num_pairs < num_seen - 1:
        # Half of the nosings of a lattice with twice the step: benches, not stairs.
        found.append(_broken("min_neighbours", num_pairs, (num_seen - 1) / 2, "1"))
    return found


def _check_envelope(fitted: FittedProfile, envelope: EnvelopeConfig) -> list[Rejection]:
    """Rise, run and pitch that stairs may have."""
    rise, run = fitted.profile.rise, abs(fitted.profile.run)
    pitch = float(np.degrees(np.arctan2(rise, run)))
    rise_slack, run_slack = (min(2.0 * fitted.covariance[i, i] ** 0.5, MAX_SLACK) for i in (0, 1))
    found = []
    for rule, value, low, high, slack, unit in (
        ("rise", rise, envelope.min_rise, envelope.max_rise, rise_slack, "m"),
        ("run", run, envelope.min_run, envelope.max_run, run_slack, "m"),
        ("pitch", pitch, envelope.min_pitch_deg, envelope.max_pitch_deg, PITCH_SLACK_DEG, "deg"),
    ):
        if value < low - slack:
            found.append(_broken(f"min_{rule}", value, low, unit))
        elif value > high + slack:
            found.append(_broken(f"max_{rule}", value, high, unit))
    return found


def _check_solid(case: Case) -> list[Rejection]:
    """Surfaces that let nothing through and are mostly in view."""
    evidence = case.evidence
    on = int(evidence.on.sum() + evidence.on_tread.sum())
    farther = int(evidence.farther.sum() + evidence.farther_tread.sum())
    nearer = int(evidence.nearer.sum())
    found = []
    see_through = farther / max(on + farther, 1)
    num_seen = int(np.count_nonzero(evidence.is_seen))
    limit = min(MAX_SEE_THROUGH, SEE_THROUGH_PER_STEP * max(num_seen - 2, 0))
    if see_through > limit:
        found.append(_broken("max_see_through", see_through, limit, "1"))
    hidden = nearer / max(on + nearer, 1)
    if hidden > MAX_HIDDEN:
        found.append(_broken("max_occluded", hidden, MAX_HIDDEN, "1"))
    return found


def _check_regular(fitted: FittedProfile) -> list[Rejection]:
    """Steps of one size."""
    own = fitted.profile.offsets
    irregularity = float(np.sqrt(np.mean(own**2)))
    if irregularity > MAX_IRREGULARITY:
        return [_broken("max_irregularity", irregularity, MAX_IRREGULARITY, "m")]
    return []


def _check_not_flat(case: Case) -> list[Rejection]:
    """Steps that can be told from a wall, a floor or a ramp."""
    flatness = compare_with_flat(case.rays, case.fitted, case.predicted, case.sides)
    if flatness > MAX_FLATNESS:
        return [_broken("max_flatness", flatness, MAX_FLATNESS, "1")]
    return []


def measure_turns(
    rays: Rays, profile: StairProfile, sides: tuple[float, float] = (-np.inf, np.inf)
) -> tuple[Float64Array, Float64Array]:
    """Measure how far each riser is turned out of the lateral axis.

    Parameters
    ----------
    rays
        Rays of the stairs' strips in the fitted axes.
    profile
        The fitted profile.
    sides
        Right and left end of the stairs, m: what stands there, or the side face of a step, is no riser.

    Returns
    -------
    (num_steps,) angles, NaN where too few rays tell them, and their standard deviations, rad.
    """
    n = profile.num_steps
    if profile.run < 0:
        # Risers of stairs that descend face away.
        return np.full(n, np.nan), np.full(n, np.nan)
    limits = RiserLimits(
        floor=float(profile.tread_heights[0]),
        rise=profile.rise,
        height_share=MIDDLE_SHARE,
        overhang=profile.overhang,
        band=TURN_BAND * abs(profile.run),
        right=sides[0] + SIDE_MARGIN,
        left=sides[1] - SIDE_MARGIN,
    )
    sums = sum_risers(rays.arrays, profile.nosing_distances, limits)
    count = sums[0]
    mean_s, mean_t, square_s, product, square_t = sums[1:] / np.maximum(count, 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance_t = square_t - mean_t**2
        turn = (product - mean_s * mean_t) / variance_t
        scatter = np.maximum(square_s - mean_s**2 - turn**2 * variance_t, 1e-6)
        std = np.sqrt(RAYS_PER_SAMPLE * scatter / (count * variance_t))
    turn[(count < MIN_TURN_RAYS) | ~np.isfinite(std)] = np.nan
    return turn, std


def find_turned(turn: Float64Array, std: Float64Array) -> tuple[Mask, float]:
    """Tell which steps are turned against the others.

    A step is, when its own angle says so; all are, when the angles grow from step to step in one direction,
    as those of winders and spirals do: twice on end, clearly each time, or over all of them together.

    Returns
    -------
    (num_steps,) whether each step is turned, and the largest such angle, rad (0 for none).
    """
    with np.errstate(invalid="ignore"):
        turned = np.abs(turn) > MAX_TURN + 2.0 * std
        growth = np.diff(turn)
        limit = MAX_GROWTH + 2.0 * np.hypot(std[1:], std[:-1])
        direction = np.where(np.abs(growth) > limit, np.sign(growth), 0.0)
        known = np.flatnonzero(np.isfinite(turn) & ~turned & (std < MAX_TURN_STD))
    winds = bool((direction[1:] * direction[:-1] > 0).any())
    if not winds and len(known) >= 2:
        weight = 1.0 / (std[known] + np.radians(1.0)) ** 2
        offset = known - (weight @ known) / weight.sum()
        spread = float(np.sum(weight * offset**2))
        slope = float(np.sum(weight * offset * turn[known])) / spread
        winds = abs(slope) > MAX_GROWTH + 2.0 / np.sqrt(spread)
    if winds:
        return np.ones(len(turn), dtype=bool), float(np.nanmax(np.abs(turn)))
    return np.asarray(turned), float(np.abs(turn[turned]).max()) if turned.any() else 0.0


def common_extent(ends: Float64Array, bounded: Mask, chosen: IntArray, sign: float) -> float:
    """One end of the stairs: the median of ends that were seen, else the farthest cut one.

    ``sign`` is +1 for left ends, which lie farther out the larger they are, -1 for right ones.
    """
    values, own = ends[chosen].tolist(), bounded[chosen].tolist()
    known = [(value, is_own) for value, is_own in zip(values, own, strict=True) if math.isfinite(value)]
    if any(is_own for _, is_own in known):
        return float(median(value for value, is_own in known if is_own))
    return float(sign * max((sign * value for value, _ in known), default=math.nan))
