"""The default detector: one depth frame in, stair edges or reasons out.

Up, headings, side elevations, nosings, lattice, profile, evidence, judgement: the method is told with
pictures in docs/method.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.config import Config
from stairmap.detection.candidate import Candidate, Scene, examine
from stairmap.detection.elevation import make_elevation
from stairmap.detection.fit import MIN_NOISE
from stairmap.detection.inverse_depth import (
    InverseDepthImage,
    SurfaceNormals,
    estimate_smoothing,
    fit_surface_normals,
    inverse_depth_from_frame,
)
from stairmap.detection.lattice import find_lattices, group_corners
from stairmap.detection.nosing_search import find_corners
from stairmap.detection.observation import Detection, Rejection, StairObservation
from stairmap.detection.orientation import (
    GIVEN_UP_STD,
    CorrectedUp,
    Heading,
    correct_up,
    estimate_up,
    find_headings,
    find_line_headings,
    find_up_error,
    level_axes,
)
from stairmap.detection.tracing import trace_detection
from stairmap.frame import DepthFrame
from stairmap.geometry import normalized

MIN_VALID_SHARE = 0.02
"""A frame with a smaller share of measured pixels is not looked at."""

MAX_HEADINGS = 2
"""Headings of upright surfaces that are tried; the one of risers stands at most distances."""

MIN_DISTANCES = 4
"""Once a stairway was found, other headings are tried only where surfaces stand at so many distances."""

STRIP_NOISE = 0.25
"""Noise of a strip's ray relative to a pixel's: 16 pixels are averaged."""

MAX_LATTICES = 3
"""Lattices along one heading that are examined."""

MAX_OVERLAP = 0.3
"""Candidates that share more than this of the smaller one's part of the image are one stairway."""


class StairEdgeDetector:
    """Finds the stair edges of one frame.

    Parameters
    ----------
    config
        Uses the sections ``envelope`` and ``detection``.
    """

    def __init__(self, config: Config) -> None:
        self._config = config

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Look for stairways in one frame.

        Parameters
        ----------
        frame
            Depth image; without ``up`` it is taken from the floor.
        trace
            Whether to keep what pictures need.

        Returns
        -------
        Observations, best first, or the rules that rejected what looked most like one.
        """
        image = inverse_depth_from_frame(frame, max_depth=self._config.detection.max_depth)
        candidates, rejections = self._find_candidates(image, frame)
        accepted = [candidate for candidate in candidates if candidate.observation is not None]
        observations = _without_duplicates(accepted, image)
        if observations:
            rejections = ()
        picture = trace_detection(frame, image, candidates, observations) if trace else None
        return Detection(
            stamp_ns=frame.stamp_ns, observations=observations, rejections=rejections, trace=picture
        )

    def _find_candidates(
        self, image: InverseDepthImage, frame: DepthFrame
    ) -> tuple[list[Candidate], tuple[Rejection, ...]]:
        """Return the candidates, and why there is none that was accepted."""
        share = np.count_nonzero(image.valid) / image.valid.size
        if share < MIN_VALID_SHARE:
            return [], (Rejection(rule="valid_pixels", measured=share, limit=MIN_VALID_SHARE, unit="1"),)
        surfaces = fit_surface_normals(image)
        up = estimate_up(surfaces) if frame.up is None else frame.up
        if up is None:
            return [], (Rejection(rule="up_from_floor", measured=float("nan"), limit=0.1, unit="1"),)
        limit = np.radians(self._config.detection.max_up_correction_deg)
        std = GIVEN_UP_STD if frame.up is None or frame.up_std is None else frame.up_std
        corrected = correct_up(surfaces, up, max_correction=limit, std=std)
        candidates, rejections = self._look_around(image, surfaces, corrected, frame.stamp_ns)
        if any(candidate.observation for candidate in candidates) or frame.up is None:
            return candidates, rejections
        error = find_up_error(surfaces, frame.up, max_correction=limit)
        if error is not None:
            off = float(np.degrees(error))
            wrong = Rejection(rule="max_up_error", measured=off, limit=float(np.degrees(limit)), unit="deg")
            rejections = (wrong, *rejections)
        return candidates, rejections

    def _look_around(
        self, image: InverseDepthImage, surfaces: SurfaceNormals, corrected: CorrectedUp, stamp_ns: int
    ) -> tuple[list[Candidate], tuple[Rejection, ...]]:
        """Look along all headings; return the candidates, and why there is none that was accepted."""
        headings = find_headings(surfaces, corrected.up, max_headings=MAX_HEADINGS)
        candidates = self._look_along(image, surfaces, corrected, headings, stamp_ns)
        if not any(candidate.observation for candidate in candidates):
            others = find_line_headings(image, corrected.up, known=headings, max_headings=1)
            candidates += self._look_along(image, surfaces, corrected, others, stamp_ns)
            headings = [*headings, *others]
        if not headings:
            return candidates, (Rejection(rule="headings", measured=0, limit=1, unit="1"),)
        if not candidates:
            limit = self._config.detection.min_steps
            return candidates, (Rejection(rule="min_steps", measured=0, limit=limit, unit="1"),)
        return candidates, max(candidates, key=lambda candidate: candidate.score).rejections

    def _look_along(
        self,
        image: InverseDepthImage,
        surfaces: SurfaceNormals,
        corrected: CorrectedUp,
        headings: Sequence[Heading],
        stamp_ns: int,
    ) -> list[Candidate]:
        """Examine what repeats like stairs along each heading."""
        ahead, left = level_axes(corrected.up)
        smoothing = estimate_smoothing(image)
        noise = max(STRIP_NOISE * surfaces.noise, MIN_NOISE)
        candidates: list[Candidate] = []
        for angle, num_distances in headings:
            if num_distances < MIN_DISTANCES and any(candidate.observation for candidate in candidates):
                continue
            forward = np.cos(angle) * ahead + np.sin(angle) * left
            # Ground that slopes aside turns no rise: only along the heading does it matter what is level.
            climb = float(corrected.ground @ forward)
            up = normalized(corrected.ground - climb * forward)
            elevation = make_elevation(image, up, forward)
            if elevation is None:
                continue
            scene = Scene(
                image=image, elevation=elevation, noise=noise, smoothing=smoothing, up_std=corrected.std,
                ground_slope=-climb / float(corrected.ground @ up), stamp_ns=stamp_ns,
            )  # fmt: skip
            corners = find_corners(elevation, noise=noise)
            groups = group_corners(corners, num_strips=len(elevation.bearing), noise=noise)
            for lattice in find_lattices(
                groups, self._config.envelope, noise=noise, max_lattices=MAX_LATTICES
            ):
                candidates.append(examine(scene, lattice, self._config))
        return candidates


def _without_duplicates(
    candidates: Sequence[Candidate], image: InverseDepthImage
) -> tuple[StairObservation, ...]:
    """Keep the best of the candidates that share a part of the image."""
    kept: list[tuple[Float64Array, StairObservation]] = []
    for candidate in sorted(candidates, key=lambda item: -item.score):
        observation = candidate.observation
        if observation is None:
            continue
        area = _area_of(observation, image)
        if all(_overlap(area, other) <= MAX_OVERLAP for other, _ in kept):
            kept.append((area, observation))
    return tuple(observation for _, observation in kept)


def _area_of(observation: StairObservation, image: InverseDepthImage) -> Float64Array:
    """(2, 2) least and greatest pixel coordinates of the ends of an observation's edges."""
    ends = np.concatenate([edge.nosing for edge in observation.edges])
    pixels = image.camera.project(ends)
    size = [image.camera.width - 1, image.camera.height - 1]
    return np.stack([np.clip(np.nanmin(pixels, axis=0), 0, size), np.clip(np.nanmax(pixels, axis=0), 0, size)])


def _overlap(first: Float64Array, second: Float64Array) -> float:
    """Share of the smaller of two areas that lies in the other."""
    shared = np.minimum(first[1], second[1]) - np.maximum(first[0], second[0])
    if (shared <= 0).any():
        return 0.0
    smaller = min(float(np.prod(first[1] - first[0])), float(np.prod(second[1] - second[0])))
    return float(np.prod(shared)) / max(smaller, 1.0)
