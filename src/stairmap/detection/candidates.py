"""Whether a measured lattice is a stairway, and the observation it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.config import Config
from stairmap.detection.edge_lines import StepExtents, choose_nosings, measure_extents
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.lattice import Lattice
from stairmap.detection.observation import Rejection, StairEdge, StairObservation
from stairmap.detection.refinement import RefinedLattice

MAX_SEE_THROUGH = 0.30
"""Largest share of pixels that lie inside the solid stairs: real treads and risers let nothing through."""

MIN_TREAD_PIXELS = 30
"""Fewest pixels of a tread that can stand for a step without a riser."""

MAX_IRREGULARITY = 0.035
"""Largest root mean square distance of nosings from the lattice, m, beyond the noise."""

@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Something that repeats like stairs, and what became of it.

    Attributes
    ----------
    observation
        The observation, or ``None`` when it was rejected.
    rejections
        The rules that rejected it.
    score
        Number of its nosings, and in the fraction how many pixels support it.
    columns
        First and last column of it in the working image.
    lattice, refined
        What was found on the way.
    """

    observation: StairObservation | None
    rejections: tuple[Rejection, ...]
    score: float
    columns: tuple[float, float]
    lattice: Lattice
    refined: RefinedLattice | None


def judge_candidate(
    image: InverseDepthImage,
    lattice: Lattice,
    refined: RefinedLattice | None,
    stamp_ns: int,
    config: Config,
) -> Candidate:
    """Check a lattice against what a stairway must be, and make the observation.

    Parameters
    ----------
    image
        Inverse depth of the frame.
    lattice, refined
        The lattice as it was found and as it was measured; ``None`` when its steps have no pixels.
    stamp_ns
        Stamp of the frame.
    config
        Uses ``envelope`` and ``detection.min_steps``.
    """
    strips = np.flatnonzero(lattice.strips)
    columns = (float(strips[0] * 16), float(strips[-1] * 16 + 16))
    min_steps = config.detection.min_steps
    if refined is None or len(lattice.indices) < min_steps:
        rejection = Rejection(rule="min_steps", measured=len(lattice.indices), limit=min_steps, unit="1")
        return Candidate(
            observation=None,
            rejections=(rejection,),
            score=float(len(lattice.indices)),
            columns=columns,
            lattice=lattice,
            refined=refined,
        )
    extents = measure_extents(image, refined)
    chosen = choose_nosings(refined, extents)
    left, right = _common_extent(extents, chosen)
    rejections = _find_rejections(refined, extents, chosen, left - right, config)
    num_pixels = int(np.count_nonzero(refined.members.tread | refined.members.riser)) * refined.row_step
    observation = None
    if not rejections:
        observation = _make_observation(image, refined, extents, chosen, left - right, stamp_ns)
    return Candidate(
        observation=observation,
        rejections=rejections,
        score=len(chosen) + num_pixels / image.valid.size,
        columns=columns,
        lattice=lattice,
        refined=refined,
    )


def _common_extent(extents: StepExtents, chosen: IntArray) -> tuple[float, float]:
    """Left and right end of the stairs: the median of ends that were seen, else the farthest cut one."""
    if len(chosen) == 0:
        return 0.0, 0.0
    ends = []
    for values, bounded, sign in (
        (extents.left[chosen], extents.left_bounded[chosen], 1.0),
        (extents.right[chosen], extents.right_bounded[chosen], -1.0),
    ):
        ends.append(float(np.median(values[bounded]) if bounded.any() else sign * np.max(sign * values)))
    return ends[0], ends[1]


def _find_rejections(
    refined: RefinedLattice, extents: StepExtents, chosen: IntArray, width: float, config: Config
) -> tuple[Rejection, ...]:
    """All the rules that the lattice breaks."""
    envelope = config.envelope
    found = []
    if len(chosen) < config.detection.min_steps:
        found.append(
            Rejection(rule="min_steps", measured=len(chosen), limit=config.detection.min_steps, unit="1")
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
    irregularity = _irregularity(refined, chosen)
    if irregularity > MAX_IRREGULARITY:
        found.append(
            Rejection(rule="max_irregularity", measured=irregularity, limit=MAX_IRREGULARITY, unit="m")
        )
    return tuple(found)


def _see_through_share(refined: RefinedLattice, extents: StepExtents, chosen: IntArray) -> float:
    """Share of the pixels between the steps' ends that lie behind the surfaces of the stairs.

    Stairs with open risers let one look through where risers would be. Where three treads or
    more were seen, only what lies behind treads counts.
    """
    if len(chosen) == 0:
        return 0.0
    left, right = np.nanmedian(extents.left[chosen]), np.nanmedian(extents.right[chosen])
    members, pixels = refined.members, refined.pixels
    between = (pixels.left < left - 0.03) & (pixels.left > right + 0.03)
    between &= (members.index >= chosen[0]) & (members.index <= chosen[-1])
    behind = np.flatnonzero(between & members.inside)
    through_tread = enters_by_tread(refined, behind)
    num_treads = np.count_nonzero(refined.nosings.num_tread_pixels[chosen] >= MIN_TREAD_PIXELS)
    on_tread = np.count_nonzero(between & members.tread)
    if num_treads >= 3:
        num_through = np.count_nonzero(through_tread)
        return num_through / max(on_tread + num_through, 1)
    on_riser = np.count_nonzero(between & members.riser)
    return len(behind) / max(on_tread + on_riser + len(behind), 1)


def enters_by_tread(refined: RefinedLattice, chosen: IntArray) -> Mask:
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


def _make_observation(
    image: InverseDepthImage,
    refined: RefinedLattice,
    extents: StepExtents,
    chosen: IntArray,
    width: float,
    stamp_ns: int,
) -> StairObservation:
    """The observation of the chosen nosings; nosing 0 is the lowest of them."""
    descending = refined.run < 0
    forward = -refined.forward if descending else refined.forward
    left_axis = np.cross(refined.up, refined.forward)
    nosings = refined.nosings
    distance, height = nosings.distance, nosings.height
    lattice_s = refined.distance + np.arange(len(distance)) * refined.run
    lattice_z = refined.height + np.arange(len(distance)) * refined.rise
    # A nosing lies where it was measured, unless that strays from the lattice like an outlier.
    distance = np.where(np.abs(distance - lattice_s) < 0.03, distance, lattice_s)
    height = np.where(np.abs(height - lattice_z) < 0.03, height, lattice_z)
    edges = []
    for index in chosen:
        point = distance[index] * refined.forward + height[index] * refined.up
        ends = [point + extents.left[index] * left_axis, point + extents.right[index] * left_axis]
        bounded = [bool(extents.left_bounded[index]), bool(extents.right_bounded[index])]
        if descending:
            ends.reverse()
            bounded.reverse()
        edges.append(
            StairEdge(
                nosing=np.array(ends),
                step_index=int(index - chosen[0]),
                left_bounded=bounded[0],
                right_bounded=bounded[1],
                cue="crease" if nosings.is_crease[index] else "jump",
                num_pixels=int(nosings.num_tread_pixels[index] + nosings.num_riser_pixels[index]),
            )
        )
    middle = np.mean([edge.nosing.mean(axis=0) @ left_axis for edge in edges])
    lowest = int(chosen[0])
    origin = lattice_s[lowest] * refined.forward + lattice_z[lowest] * refined.up + float(middle) * left_axis
    return StairObservation(
        stamp_ns=stamp_ns,
        view="descending" if descending else "ascending",
        up=refined.up,
        forward=forward,
        edges=tuple(edges),
        rise=refined.rise,
        run=abs(refined.run),
        width=width,
        origin=origin,
        covariance=_covariance_at(refined, lowest),
        floor_seen=_has_floor(refined, lowest),
        top_seen=_has_landing(refined, int(chosen[-1])),
        points=np.concatenate([edge.nosing for edge in edges]),
    )


def _covariance_at(refined: RefinedLattice, lowest: int) -> Float64Array:
    """The covariance with the origin moved to the lowest chosen nosing, run counted positive."""
    jacobian = np.eye(6)
    jacobian[2, 1], jacobian[3, 0] = lowest, lowest
    if refined.run < 0:
        jacobian[1] *= -1.0
        jacobian[2] *= -1.0
    return np.asarray(jacobian @ refined.covariance @ jacobian.T)


def _has_floor(refined: RefinedLattice, lowest: int) -> bool:
    """Whether a level surface one rise below the lowest nosing reaches farther than a step before it."""
    x = (refined.pixels.forward - refined.distance) / refined.run - lowest
    z = refined.pixels.height - (refined.height + (lowest - 1) * refined.rise)
    return _is_covered(x, z, refined, (-1.8, -1.15))


def _has_landing(refined: RefinedLattice, highest: int) -> bool:
    """Whether the tread behind the highest nosing reaches farther than a step."""
    x = (refined.pixels.forward - refined.distance) / refined.run - highest
    z = refined.pixels.height - (refined.height + highest * refined.rise)
    return _is_covered(x, z, refined, (1.15, 1.8))


def _is_covered(
    x: Float64Array, z: Float64Array, refined: RefinedLattice, interval: tuple[float, float]
) -> bool:
    in_interval = (x > interval[0]) & (x < interval[1])
    on_level = in_interval & (np.abs(z) < 0.3 * refined.rise)
    return bool(np.count_nonzero(on_level) * refined.row_step >= max(30, 0.5 * np.count_nonzero(in_interval)))
