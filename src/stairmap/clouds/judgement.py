"""Judge whether what was measured in a cloud is stairs: each rule that it breaks is a rejection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.clouds.section import Section
from stairmap.clouds.sides import StepSides
from stairmap.clouds.surfaces import CORE
from stairmap.config import Config
from stairmap.detection.observation import Rejection
from stairmap.detection.profile import StairProfile

MIN_SEEN_SHARE = 0.6
"""Share of the steps from the lowest to the highest that must have been seen."""

MAX_ALTERNATION = 0.7
"""Where more of every second step was seen than of those between, by more than this share, those between are
not there."""

MIN_TREAD_DEPTH, MIN_SURFACE_SHARE = 0.015, 0.4
"""In this share of the steps a tread reaches over more depth than this, m, in half of its pieces across, or
its riser was seen: a far scanner's lines on a hill have neither."""

MAX_IRREGULARITY = 0.022
"""Largest root mean square of the steps' own places off the regular ones, m, beyond the noise: worn and badly
built stairs reach 19 mm."""

MIN_ON_PROFILE = 0.6
"""Smallest share of the points on and above the steps that lie on the profile. Real stairs have 0.9 and more,
with railings and bags 0.7."""

MAX_FLATNESS = 0.65
"""Points must lie nearer to the steps than this share of how near they lie to one slope: ramps and roofs."""

MAX_TURN = np.radians(5.0)
"""Largest angle of a nosing against the others, rad: eight winders to a quarter turn differ by 11 degrees."""

MIN_POINTS_ON_STEP = 8.0
"""Fewest points on a step, on average: fewer lie on some lattice by chance."""

ABOVE = 0.45
"""So far above the steps points count against the profile, m: below handrails."""

ENVELOPE_SLACK = 0.02
"""The envelope is widened by two standard deviations, but by no more than this, m."""

MIN_TURN_POINTS = 8
"""Fewest points, or pieces of a front edge, that tell an angle."""

FRONT_PIECE = 0.04
"""Width of the pieces in which the front edge of a tread is looked for, m."""

MIN_TURN_LENGTH = 0.35
"""A nosing seen over less than this tells no angle, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Support:
    """How points about a flight lie on it.

    Attributes
    ----------
    on_profile
        Share of the points on and above the steps that lie on the profile.
    num_on
        How many these are.
    turn
        Largest angle of a single nosing against the others, rad; NaN where none tells.
    flatness
        Median distance from the profile over that from the flat surface that fits best.
    """

    on_profile: float
    num_on: int
    turn: float
    flatness: float


def judge(
    section: Section, sides: StepSides, points: Float64Array, noise: float, config: Config
) -> tuple[Support, tuple[Rejection, ...]]:
    """Return how points lie on a measured flight, and all the rules that it breaks; none when it is one.

    Parameters
    ----------
    section, sides
        The measured flight.
    points
        (N, 3) points about it, in the cloud, m.
    noise
        Standard deviation of a point, m.
    config
        Uses the sections ``envelope`` and ``detection``.
    """
    profile, envelope = section.profile, config.envelope
    seen = section.is_step_seen
    found = []

    def check(rule: str, measured: float, limit: float, unit: str, *, is_least: bool = True) -> None:
        if not (measured >= limit if is_least else measured <= limit):
            found.append(Rejection(rule=rule, measured=float(measured), limit=float(limit), unit=unit))

    check("min_steps", float(np.count_nonzero(seen)), config.detection.min_steps, "1")
    check("min_seen_share", float(seen.mean()), MIN_SEEN_SHARE, "1")
    check("max_alternation", alternation(seen), MAX_ALTERNATION, "1", is_least=False)
    has_surface = section.risers.is_seen | (
        section.treads.is_seen[1:] & (section.treads.extent[1:] > MIN_TREAD_DEPTH)
    )
    check("min_surface_share", float(has_surface.mean()), MIN_SURFACE_SHARE, "1")
    for name in ("rise", "run"):
        value, slack = getattr(profile, name), min(2 * getattr(section.std, name), ENVELOPE_SLACK)
        check(f"min_{name}", value, getattr(envelope, f"min_{name}") - slack, "m")
        check(f"max_{name}", value, getattr(envelope, f"max_{name}") + slack, "m", is_least=False)
    pitch = float(np.degrees(np.arctan2(profile.rise, profile.run)))
    check("min_pitch", pitch, envelope.min_pitch_deg, "deg")
    check("max_pitch", pitch, envelope.max_pitch_deg, "deg", is_least=False)
    check("min_width", sides.width, envelope.min_width, "m")
    support = measure_support(section, sides, points, noise)
    check("max_irregularity", irregularity(profile), MAX_IRREGULARITY + noise, "m", is_least=False)
    check("max_flatness", support.flatness, MAX_FLATNESS, "1", is_least=False)
    check("min_points_on_step", support.num_on / profile.num_steps, MIN_POINTS_ON_STEP, "1")
    check("min_on_profile", support.on_profile, MIN_ON_PROFILE, "1")
    if np.isfinite(support.turn):
        check("max_turn", np.degrees(support.turn), np.degrees(MAX_TURN), "deg", is_least=False)
    return support, tuple(found)


def irregularity(profile: StairProfile) -> float:
    """Root mean square of the steps' places off the regular ones, floors at the ends left out, m."""
    nosings = profile.offsets[: profile.num_steps]
    treads = profile.offsets[profile.num_steps :][1:-1]
    return float(max(np.sqrt(np.mean(nosings**2)), np.sqrt(np.mean(treads**2)) if len(treads) else 0.0))


def measure_support(section: Section, sides: StepSides, points: Float64Array, noise: float) -> Support:
    """Count points on and above the steps, and measure how single nosings are turned."""
    profile = section.profile
    s, t, z = section.axes.from_cloud(points).T
    nosings, levels = profile.nosing_distances, profile.tread_heights
    half = 0.4 * (sides.left - sides.right)
    middle = 0.5 * (sides.left + sides.right)
    inside = (np.abs(t - middle) < half) & (s > nosings[0]) & (s < nosings[-1] + 0.8 * profile.run)
    s, t, z = s[inside], t[inside], z[inside]
    step = (np.searchsorted(nosings, s, side="right") - 1).clip(0, profile.num_steps - 1)
    core = max(CORE * noise, 0.015)
    above = z - levels[step + 1]
    on_tread = np.abs(above) < core
    nearest = np.argmin(np.abs(s[:, None] - nosings[None] - profile.overhang), axis=1)
    to_riser = s - nosings[nearest] - profile.overhang
    on_riser = (np.abs(to_riser) < core) & (z > levels[nearest] - core) & (z < levels[nearest + 1] + core)
    counted = (above > -core) & (above < ABOVE) | on_riser
    on = (on_tread | on_riser) & counted
    share = float(np.count_nonzero(on)) / max(float(np.count_nonzero(counted)), 1.0)
    off_profile = np.minimum(np.abs(above), np.where(on_riser, np.abs(to_riser), np.inf))
    flatness = _flatness(s[counted], z[counted], off_profile[counted])
    turns = []
    for number in range(profile.num_steps):
        part = on_riser & (nearest == number) & (z > levels[number] + core)
        slope = _slope(to_riser[part], t[part])
        if not np.isfinite(slope[0]):
            part = (step == number) & on_tread
            slope = _slope(*_front_ends(s[part] - nosings[number], t[part]))
        turns.append(slope)
    turn = _largest_turn(np.array(turns))
    return Support(on_profile=share, num_on=int(np.count_nonzero(on)), turn=turn, flatness=flatness)


def alternation(seen: Mask) -> float:
    """How much more of every second step was seen than of those between: 1 where a lattice is half of one.

    Rows of seats have every second edge and tread of a lattice of half their rise and run.
    """
    even, odd = seen[::2], seen[1::2]
    return float(abs(even.mean() - odd.mean())) if len(odd) else 0.0


def _slope(s: Float64Array, t: Float64Array) -> tuple[float, float]:
    """Slope of s over t and its standard deviation; NaN where too few points tell."""
    if len(t) < MIN_TURN_POINTS or np.ptp(t) < MIN_TURN_LENGTH:
        return float("nan"), float("nan")
    centered = t - t.mean()
    spread = float((centered**2).sum())
    slope = float((centered * s).sum()) / spread
    rest = s - s.mean() - slope * centered
    return slope, float(np.sqrt((rest**2).sum() / max(len(t) - 2, 1) / spread))


def _front_ends(s: Float64Array, t: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Where a tread begins, piece by piece across: s and t of each piece's foremost points."""
    if not len(t):
        return s, t
    piece = ((t - t.min()) / FRONT_PIECE).astype(np.int64)
    order = np.lexsort((s, piece))
    place = np.arange(len(order)) - np.searchsorted(piece[order], piece[order])
    # The second one: the first may be a stray.
    chosen = order[place == 1]
    return s[chosen], t[chosen]


def _largest_turn(slopes: Float64Array) -> float:
    """Largest angle of a nosing against the others beyond twice its standard deviation, rad."""
    slopes = slopes[np.isfinite(slopes[:, 0])]
    if len(slopes) < 2:
        return float("nan")
    angle = np.arctan(slopes[:, 0])
    beyond = np.abs(angle - np.median(angle)) - 2.0 * slopes[:, 1]
    return float(max(beyond.max(), 0.0))


def _flatness(s: Float64Array, z: Float64Array, off_profile: Float64Array) -> float:
    """How near points lie to the profile, against how near they lie to the straight line that fits best."""
    if len(s) < 10:
        return 1.0
    used = np.ones(len(s), dtype=bool)
    off_line = np.zeros(len(s))
    for _ in range(4):
        line = np.polyfit(s[used], z[used], 1)
        off_line = np.abs(z - np.polyval(line, s))
        used = off_line <= np.percentile(off_line, 80)
    return float(np.median(off_profile) / max(np.median(off_line), 1e-6))
