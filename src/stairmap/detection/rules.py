"""What a lattice of nosings must be to count as a stairway.

Each rule that is broken becomes a rejection with the measured value and the limit.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import IntArray, Mask
from stairmap.config import Config
from stairmap.detection.edge_lines import StepExtents
from stairmap.detection.observation import Rejection
from stairmap.detection.refinement import RefinedLattice
from stairmap.detection.step_turns import MAX_TURN

MAX_SEE_THROUGH = 0.30
"""Largest share of pixels that lie inside the solid stairs: real treads and risers let nothing through."""

MIN_TREAD_PIXELS = 30
"""Fewest pixels of a tread that can stand for a step without a riser."""

MIN_SLABS = 4
"""Fewest nosings where only the fronts of slabs are seen: three bars also line up in furniture."""

MAX_OCCLUDED, MIN_CLEARANCE = 0.4, 0.12
"""Largest share of rays that end at something in front of the stairs, and how far above the nosing line, m,
that must be."""

MAX_LEDGE_PHASE = 0.35
"""Where half of the riser pixels lie within this share of a rise below the nosings, they are the fronts of
slabs, and the risers are open."""

MAX_IRREGULARITY = 0.035
"""Largest root mean square distance of nosings from the lattice, m, beyond the noise."""

MIN_NEIGHBOUR_SHARE = 0.15
"""A nosing with less than this share of the pixels of the one next to it is none of its kind."""


def find_rejections(
    refined: RefinedLattice, extents: StepExtents, chosen: IntArray, width: float, turn: float, config: Config
) -> tuple[Rejection, ...]:
    """Return all the rules that a measured lattice breaks; none when it is a stairway.

    Parameters
    ----------
    refined
        The lattice.
    extents
        Extents of its steps.
    chosen
        Indices of the nosings that were seen.
    width
        Distance between the stairs' ends, m.
    turn
        Largest angle of a step that was left out since it is turned against the others, rad.
    config
        Uses ``envelope`` and ``detection.min_steps``.
    """
    envelope = config.envelope
    found = []
    min_steps = config.detection.min_steps
    if refined.is_open and not (refined.nosings.num_tread_pixels[chosen] >= MIN_TREAD_PIXELS).any():
        min_steps = max(min_steps, MIN_SLABS)
    if len(chosen) < min_steps:
        found.append(Rejection(rule="min_steps", measured=len(chosen), limit=min_steps, unit="1"))
        if turn > 0:
            limit = float(np.degrees(MAX_TURN))
            found.append(
                Rejection(rule="max_turn", measured=float(np.degrees(turn)), limit=limit, unit="deg")
            )
    support = (refined.nosings.num_tread_pixels + refined.nosings.num_riser_pixels)[chosen]
    is_pair = (np.diff(chosen) == 1) & (
        np.minimum(support[1:], support[:-1]) > MIN_NEIGHBOUR_SHARE * np.maximum(support[1:], support[:-1])
    )
    num_pairs = int(np.count_nonzero(is_pair))
    if 2 * num_pairs < len(chosen) - 1:
        # Half of the nosings of a lattice with twice the step: benches, not stairs.
        found.append(
            Rejection(rule="min_neighbours", measured=num_pairs, limit=(len(chosen) - 1) / 2, unit="1")
        )
    rise, run = refined.rise, abs(refined.run)
    pitch = float(np.degrees(np.arctan2(rise, run)))
    rise_slack, run_slack = (min(2.0 * refined.covariance[slot, slot] ** 0.5, 0.02) for slot in (0, 1))
    for rule, value, low, high, slack, unit in (
        ("rise", rise, envelope.min_rise, envelope.max_rise, rise_slack, "m"),
        ("run", run, envelope.min_run, envelope.max_run, run_slack, "m"),
        ("pitch", pitch, envelope.min_pitch_deg, envelope.max_pitch_deg, 1.0, "deg"),
    ):
        if value < low - slack:
            found.append(Rejection(rule=f"min_{rule}", measured=value, limit=low, unit=unit))
        elif value > high + slack:
            found.append(Rejection(rule=f"max_{rule}", measured=value, limit=high, unit=unit))
    if width < envelope.min_width:
        found.append(Rejection(rule="min_width", measured=width, limit=envelope.min_width, unit="m"))
    see_through = _see_through_share(refined, extents, chosen)
    if see_through > MAX_SEE_THROUGH:
        found.append(Rejection(rule="max_see_through", measured=see_through, limit=MAX_SEE_THROUGH, unit="1"))
    occluded = _occluded_share(refined, extents, chosen)
    if occluded > MAX_OCCLUDED:
        found.append(Rejection(rule="max_occluded", measured=occluded, limit=MAX_OCCLUDED, unit="1"))
    irregularity = _irregularity(refined, chosen)
    if irregularity > MAX_IRREGULARITY:
        found.append(
            Rejection(rule="max_irregularity", measured=irregularity, limit=MAX_IRREGULARITY, unit="m")
        )
    return tuple(found)


def _see_through_share(refined: RefinedLattice, extents: StepExtents, chosen: IntArray) -> float:
    """Share of the pixels between the steps' ends that lie behind the surfaces of the stairs.

    Stairs with open risers let one look through where risers would be. Where three treads or
    more were seen, or only the upper part of the risers, only what lies behind treads counts.
    """
    if len(chosen) == 0:
        return 0.0
    left, right = np.nanmedian(extents.left[chosen]), np.nanmedian(extents.right[chosen])
    members, pixels = refined.members, refined.pixels
    between = (pixels.left < left - 0.03) & (pixels.left > right + 0.03)
    between &= members.index <= chosen[-1]
    behind = np.flatnonzero(between & members.inside)
    between &= members.index >= chosen[0]
    through_tread = _enters_by_tread(refined, behind)
    on_riser = int(np.count_nonzero(between & members.riser))
    num_treads = np.count_nonzero(refined.nosings.num_tread_pixels[chosen] >= MIN_TREAD_PIXELS)
    on_tread = int(np.count_nonzero(between & members.tread))
    phase = members.index - (pixels.height - refined.height) / refined.rise
    phases = phase[between & members.riser]
    is_open = refined.is_open or (len(phases) > 0 and float(np.median(phases)) < MAX_LEDGE_PHASE)
    if num_treads >= 3 or is_open:
        num_through = int(np.count_nonzero(through_tread))
        on_surface = on_tread + (on_riser if refined.is_open else 0)
        return num_through / max(on_surface + num_through, 1)
    return len(behind) / max(on_tread + on_riser + len(behind), 1)


def _occluded_share(refined: RefinedLattice, extents: StepExtents, chosen: IntArray) -> float:
    """Share of the rays towards the stairs that something well in front of them stops.

    People and bags hide a part; what hides most is the thing itself: a pallet, through whose gaps
    a few boards line up.
    """
    if len(chosen) == 0:
        return 0.0
    members, pixels = refined.members, refined.pixels
    first, last = int(chosen[0]), int(chosen[-1])
    low_s, low_z = refined.distance + first * refined.run, refined.height + (first - 1) * refined.rise
    high_s, high_z = refined.distance + last * refined.run, refined.height + last * refined.rise
    slope = pixels.height / np.maximum(pixels.forward, 0.1)
    low, high = sorted((low_z / max(low_s, 0.1), high_z / max(high_s, 0.1)))
    toward = (slope > low) & (slope < high)
    # A ray's place across the stairs is taken at the middle step's distance.
    across = pixels.left / np.maximum(pixels.forward, 0.1) * max(0.5 * (low_s + high_s), 0.1)
    toward &= (across < np.nanmedian(extents.left[chosen])) & (across > np.nanmedian(extents.right[chosen]))
    pitch = np.arctan2(refined.rise, refined.run)
    above_line = (pixels.height - refined.height) * np.cos(pitch) - (
        pixels.forward - refined.distance
    ) * np.sin(pitch)
    in_front = int(np.count_nonzero(toward & (above_line > MIN_CLEARANCE)))
    on = int(np.count_nonzero(toward & (members.tread | members.riser)))
    return in_front / max(in_front + on, 1)


def _enters_by_tread(refined: RefinedLattice, chosen: IntArray) -> Mask:
    """Whether the rays of some pixels enter the solid stairs through a tread, not through a riser."""
    s, z = refined.pixels.forward[chosen], refined.pixels.height[chosen]
    slope = (z / np.maximum(s, 1e-3))[:, None]
    index = np.arange(len(refined.nosings.num_tread_pixels))
    riser_s = refined.distance + index * refined.run
    riser_phase = (slope * riser_s - refined.height) / refined.rise - index
    hits_riser = (riser_phase > -1.0) & (riser_phase <= 0.0)
    first_riser = np.where(hits_riser, riser_s, np.inf).min(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        tread_s = (refined.height + index * refined.rise) / slope
    tread_phase = (tread_s - refined.distance) / refined.run - index
    hits_tread = (tread_phase > 0.0) & (tread_phase < 1.0) & (tread_s > 0)
    first_tread = np.where(hits_tread, tread_s, np.inf).min(axis=1)
    return np.asarray(first_tread < first_riser)


def _irregularity(refined: RefinedLattice, chosen: IntArray) -> float:
    """Root mean square distance of the nosings from the lattice beyond their own noise, m."""
    nosings = refined.nosings
    residuals = []
    for value, std, start, spacing in (
        (nosings.distance, nosings.distance_std, refined.distance, refined.run),
        (nosings.height, nosings.height_std, refined.height, refined.rise),
    ):
        known = chosen[np.isfinite(value[chosen])]
        excess = np.abs(value[known] - start - known * spacing) - 2.0 * std[known]
        residuals.append(np.maximum(excess, 0.0))
    joined = np.concatenate(residuals)
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else 0.0
