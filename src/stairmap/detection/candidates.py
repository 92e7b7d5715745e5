"""Whether a measured lattice is a stairway, and the observation it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, IntArray
from stairmap.config import Config
from stairmap.detection.edge_lines import StepExtents, measure_extents
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.lattice import Lattice
from stairmap.detection.observation import Rejection, StairEdge, StairObservation
from stairmap.detection.refinement import RefinedLattice
from stairmap.detection.rules import find_rejections
from stairmap.detection.seen_steps import choose_nosings
from stairmap.detection.step_turns import find_turned
from stairmap.geometry import cross


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
    if refined is None:
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
    turned, turn = find_turned(refined, extents)
    chosen = choose_nosings(refined, extents, turned)
    left, right = _common_extent(extents, chosen)
    rejections = find_rejections(refined, extents, chosen, left - right, turn, config)
    # Two nosings find a lattice anywhere; the third must then be as good as they are, or not alone, and
    # where noise is as large as a step anything would do.
    all_creases = bool(refined.nosings.is_crease[chosen].all())
    num_sure = len(lattice.indices) + _num_told_from_noise(refined, chosen)
    is_sure = num_sure >= min_steps and (len(chosen) > min_steps or all_creases)
    if len(lattice.indices) < min_steps <= len(chosen) and not is_sure:
        rejection = Rejection(rule="min_steps", measured=len(lattice.indices), limit=min_steps, unit="1")
        rejections = (*rejections, rejection)
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


def _num_told_from_noise(refined: RefinedLattice, chosen: IntArray) -> int:
    """How many nosings were added to those found where three sigma are less than 0.3 of a run."""
    others = chosen[(chosen < refined.found[0]) | (chosen > refined.found[1])]
    distance = refined.distance + others * refined.run
    return int(np.count_nonzero(3.0 * refined.noise * distance**2 < 0.3 * abs(refined.run)))


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
    left_axis = cross(refined.up, refined.forward)
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
        rise_information=refined.rise_information,
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
    x = (refined.pixels.forward - np.float32(refined.distance)) / np.float32(refined.run) - lowest
    z = refined.pixels.height - np.float32(refined.height + (lowest - 1) * refined.rise)
    return _is_covered(x, z, refined, (-1.8, -1.15))


def _has_landing(refined: RefinedLattice, highest: int) -> bool:
    """Whether the tread behind the highest nosing reaches farther than a step."""
    x = (refined.pixels.forward - np.float32(refined.distance)) / np.float32(refined.run) - highest
    z = refined.pixels.height - np.float32(refined.height + highest * refined.rise)
    return _is_covered(x, z, refined, (1.15, 1.8))


def _is_covered(
    x: Float32Array, z: Float32Array, refined: RefinedLattice, interval: tuple[float, float]
) -> bool:
    in_interval = (x > interval[0]) & (x < interval[1])
    on_level = in_interval & (np.abs(z) < 0.3 * refined.rise)
    return bool(np.count_nonzero(on_level) * refined.row_step >= max(30, 0.5 * np.count_nonzero(in_interval)))
