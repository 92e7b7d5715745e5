"""From a lattice to a judged candidate: fit a profile, see which steps there are, judge, observe."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Points
from stairmap.config import Config
from stairmap.detection.elevation import Elevation, strip_columns
from stairmap.detection.evidence import Evidence, all_rays, choose_steps, count_evidence, is_level_seen
from stairmap.detection.extents import StepExtents, measure_extents
from stairmap.detection.fit import FittedProfile, Rays, fit_profile, gather_rays, turned_rays
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.judgement import Case, common_extent, find_rejections
from stairmap.detection.lattice import Lattice
from stairmap.detection.nosing_search import Corners
from stairmap.detection.observation import Rejection, StairEdge, StairObservation
from stairmap.detection.profile import MIN_FORWARD, USUAL_THICKNESS, Optics, StairProfile
from stairmap.geometry import cross

TRIED_NEAR, TRIED_FAR = 2, 8
"""Steps before and behind those found that are tried: far off, few rows are left of each, too few for the
search."""

MAX_ROUNDS = 3
"""How often the steps that are seen are fitted and looked for again."""

OPEN_SHARE = 0.08
"""Where more than this share of the rays towards risers go through, the same steps are tried as slabs: of
closed risers no more than that are missed."""

MIN_STEP_ROWS, MAX_ROW_STEP = 12, 3
"""Rows of the farthest step found that are kept, and the most rows of which one is taken: more would tell the
same steps again."""

PIXELS_PER_RAY = 16
"""Pixels that a ray of a strip averages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One frame along one heading.

    Attributes
    ----------
    image
        Inverse depth.
    elevation
        Its scans along the heading.
    corners
        The convex corners in them.
    noise
        Standard deviation of inverse distance of a ray of a strip, 1/m.
    smoothings
        Over how many pixels the sensor may blend both sides of a jump, standard deviations.
    up_std
        Standard deviation of the direction of up, rad.
    ground_slope
        How much floor and treads climb forward, m per m.
    stamp_ns
        Stamp of the frame.
    """

    image: InverseDepthImage
    elevation: Elevation
    corners: Corners
    noise: float
    smoothings: tuple[float, ...]
    up_std: float
    ground_slope: float
    stamp_ns: int

    def optics(self, smoothing: float | None = None) -> Optics:
        """How the camera shows edges, as far as it is known before the fit."""
        grid = self.elevation.grid
        blended = self.smoothings[0] if smoothing is None else smoothing
        return Optics(row_size=grid.row_size, smoothing=blended, shift=grid.edge_shift)


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
        Number of its steps, and in the fraction how many rays support it.
    scene, lattice
        Where it was found.
    case, extents
        The profile of the steps that were seen, what the rays say of them, and how far they reach aside;
        ``None`` when none could be fitted.
    """

    observation: StairObservation | None
    rejections: tuple[Rejection, ...]
    score: float
    scene: Scene
    lattice: Lattice
    case: Case | None = None
    extents: StepExtents | None = None

    def ends(self) -> Points:
        """Return the (N, 3) ends of its steps, camera frame, m: as observed, else where it was found."""
        if self.observation is not None:
            return np.concatenate([edge.nosing for edge in self.observation.edges])
        return self.fitted_nosings().reshape(-1, 3)

    def fitted_nosings(self) -> Points:
        """Return the (K, 2, 3) left and right ends of the fitted steps over the strips that found them, m."""
        if self.case is None:
            return np.zeros((0, 2, 3))
        elevation, profile = self.scene.elevation, self.case.fitted.profile
        up, forward = self.case.fitted.axes(elevation)
        bearings = elevation.bearing[self.lattice.strips][[0, -1], None]
        rays = forward + bearings * cross(up, forward)
        s, z = profile.nosing_distances[:, None, None], profile.tread_heights[1:, None, None]
        return np.asarray(s * rays + z * up)


def examine(scene: Scene, lattice: Lattice, config: Config) -> Candidate:
    """Fit, count and judge the stairs that a lattice suggests."""
    strips, row_step = np.flatnonzero(lattice.strips), _row_step(scene, lattice)
    measured = gather_rays(scene.elevation, strips, row_step)
    everything = all_rays(scene.elevation, strips, row_step)
    start = StairProfile(
        ground=scene.ground_slope * math.copysign(1.0, lattice.run),
        distance=lattice.distance,
        height=lattice.height,
        run=lattice.run,
        rise=lattice.rise,
        num_steps=int(lattice.indices[-1]) + 1,
    )
    seen = _fit_seen_steps(scene, measured, everything, start)
    if start.run > 0 and len(lattice.indices) > 2 and (seen is None or _lets_through(seen[1])):
        slabs = replace(start, is_open=True, thickness=USUAL_THICKNESS)
        opened = _fit_seen_steps(scene, measured, everything, slabs)
        if opened is not None and not _lets_through(opened[1]):
            seen = opened
    if seen is None:
        limit = config.detection.min_steps
        # Corners in a row that no profile explains: one step of them at most was seen.
        rejection = Rejection(rule="min_steps", measured=1, limit=limit, unit="1")
        return Candidate(
            observation=None, rejections=(rejection,), score=0.5 * len(lattice.indices), scene=scene,
            lattice=lattice,
        )  # fmt: skip
    fitted, evidence = seen
    columns = strip_columns(len(scene.elevation.grid.bearing), lattice.strips, margin=1)
    rays = turned_rays(everything, fitted)
    predicted = fitted.predict(rays.slope)
    extents = measure_extents(scene.image, scene.elevation, fitted, predicted, columns)
    chosen = np.flatnonzero(evidence.is_seen)
    left = common_extent(extents.left, extents.left_bounded, chosen, 1.0)
    right = common_extent(extents.right, extents.right_bounded, chosen, -1.0)
    case = Case(fitted=fitted, predicted=predicted, evidence=evidence, rays=rays, sides=(right, left))
    rejections = find_rejections(case, config)
    observation = None
    if not rejections:
        observation = _observe(case, extents, chosen, scene)
    return Candidate(
        observation=observation,
        rejections=rejections,
        score=float(np.count_nonzero(evidence.is_seen)) + float(evidence.on.sum()) / len(rays.slope),
        scene=scene,
        lattice=lattice,
        case=case,
        extents=extents,
    )


def _row_step(scene: Scene, lattice: Lattice) -> int:
    """Each N-th row is taken: as few as leave the farthest step found ``MIN_STEP_ROWS``.

    All are where stairs descend: of their farther steps few rows show.
    """
    if lattice.run < 0:
        return 1
    farthest = max(lattice.distance + int(lattice.indices[-1]) * lattice.run, MIN_FORWARD)
    rows = lattice.rise / farthest / scene.elevation.grid.row_size
    return int(min(max(rows / MIN_STEP_ROWS, 1), MAX_ROW_STEP))


def _lets_through(evidence: Evidence) -> bool:
    """Whether rays go through risers as if there were none."""
    return bool(evidence.farther.sum() > OPEN_SHARE * (evidence.farther.sum() + evidence.on.sum()))


def _fit_seen_steps(
    scene: Scene, measured: Rays, everything: Rays, start: StairProfile
) -> tuple[FittedProfile, Evidence] | None:
    """Fit the steps that found a lattice, look which others there are, and fit those."""
    profile: StairProfile = start
    fitted: FittedProfile | None = None
    span = (0, 0)
    below, above = (TRIED_NEAR, TRIED_FAR) if start.run > 0 else (TRIED_FAR, TRIED_NEAR)
    for _ in range(MAX_ROUNDS):
        fitted = _fit_coarsely(scene, measured, profile, fitted)
        if fitted is None:
            return None
        wider = fitted.profile.with_steps(below, above)
        evidence = count_evidence(turned_rays(everything, fitted), fitted, wider)
        found = (below, below + fitted.profile.num_steps - 1)
        chosen = choose_steps(evidence, found)
        if chosen is None or chosen[1] - chosen[0] < 1:
            return None
        span = chosen
        profile = wider.with_steps(-span[0], span[1] + 1 - wider.num_steps)
        if span == found:
            break
    fitted = fit_profile(
        measured, profile, noise=scene.noise, optics=scene.optics(), up_std=scene.up_std, around=fitted
    )
    return None if fitted is None else (fitted, evidence.of_steps(*span))


def _fit_coarsely(
    scene: Scene, rays: Rays, profile: StairProfile, around: FittedProfile | None
) -> FittedProfile | None:
    """Fit regular steps; at first with each smoothing that the sensor may have, of which the best is kept."""
    fits = []
    for smoothing in scene.smoothings if around is None else scene.smoothings[:1]:
        fitted = fit_profile(
            rays, profile, noise=scene.noise, optics=scene.optics(smoothing), up_std=scene.up_std,
            around=around, is_coarse=True,
        )  # fmt: skip
        if fitted is not None:
            fits.append(fitted)
    return min(fits, key=lambda fit: fit.cost, default=None)


def _observe(case: Case, extents: StepExtents, chosen: IntArray, scene: Scene) -> StairObservation:
    """The observation of the steps that were seen; step 0 is the lowest of them."""
    fitted, evidence = case.fitted, case.evidence
    profile = fitted.profile
    up, ahead = fitted.axes(scene.elevation)
    left_axis = cross(up, ahead)
    descending = profile.run < 0
    s, z = profile.nosing_distances, profile.tread_heights[1:]
    # A step too thin to show its ends reaches from side to side as far as is known.
    lefts = np.where(np.isfinite(extents.left), extents.left, case.sides[1])
    rights = np.where(np.isfinite(extents.right), extents.right, case.sides[0])
    aside = np.stack([lefts, rights], axis=1)[chosen]
    bounded = np.stack([extents.left_bounded, extents.right_bounded], axis=1)[chosen]
    middle = aside.mean()
    if descending:
        aside, bounded = aside[:, ::-1], bounded[:, ::-1]
    line = np.outer(s[chosen], ahead) + np.outer(z[chosen], up)
    nosings = line[:, None] + aside[..., None] * left_axis
    lowest, is_top = int(chosen[0]), int(chosen[-1]) == profile.num_steps - 1
    num_rays = (evidence.on + evidence.on_tread)[chosen].tolist()
    stds = fitted.step_std[chosen].tolist()
    edges = [
        StairEdge(
            nosing=nosing,
            step_index=index - lowest,
            left_bounded=left_bounded,
            right_bounded=right_bounded,
            cue="crease" if evidence.on_tread[index] > 0 else "jump",
            num_pixels=number * PIXELS_PER_RAY,
            std=(along, upward),
        )
        for index, nosing, (left_bounded, right_bounded), number, (along, upward) in zip(
            chosen.tolist(), nosings, bounded.tolist(), num_rays, stds, strict=True
        )
    ]
    origin = (profile.distance + lowest * profile.run) * ahead + (profile.height + lowest * profile.rise) * up
    return StairObservation(
        stamp_ns=scene.stamp_ns,
        view="descending" if descending else "ascending",
        up=up,
        forward=-ahead if descending else ahead,
        edges=tuple(edges),
        rise=profile.rise,
        run=abs(profile.run),
        width=case.width,
        origin=origin + float(middle) * left_axis,
        covariance=_covariance_at(fitted, lowest),
        rise_information=fitted.rise_information,
        overhang=max(profile.overhang, 0.0),
        overhang_std=fitted.overhang_std,
        floor_seen=lowest == 0 and is_level_seen(case.rays, profile, is_top=False),
        top_seen=is_top and is_level_seen(case.rays, profile, is_top=True),
        points=nosings.reshape(-1, 3),
    )


def _covariance_at(fitted: FittedProfile, lowest: int) -> Float64Array:
    """The covariance with the origin moved to the lowest step that was seen, run counted positive."""
    jacobian = np.eye(6)
    jacobian[2, 1], jacobian[3, 0] = lowest, lowest
    jacobian[1:3] *= fitted.profile.direction
    return np.asarray(jacobian @ fitted.covariance @ jacobian.T)
