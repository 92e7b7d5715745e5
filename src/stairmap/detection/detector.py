"""The default detector: one depth frame in, stair edges or reasons out.

Up, headings, side elevations, nosings, lattice, all pixels, edges: the method is told with
pictures in docs/method.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Points
from stairmap.config import Config
from stairmap.detection.candidates import Candidate, judge_candidate
from stairmap.detection.crease_edges import find_creases
from stairmap.detection.elevation import Elevation, lateral_positions, make_elevation, strip_columns
from stairmap.detection.inverse_depth import (
    InverseDepthImage,
    SurfaceNormals,
    fit_surface_normals,
    inverse_depth_from_frame,
)
from stairmap.detection.jump_edges import find_riser_tops, find_tread_fronts
from stairmap.detection.lattice import Lattice, find_lattices, group_nosings
from stairmap.detection.ledges import find_ledges, is_made_of_ledges
from stairmap.detection.observation import Detection, Rejection, StairObservation
from stairmap.detection.orientation import (
    CorrectedUp,
    Heading,
    correct_up,
    estimate_up,
    find_headings,
    find_line_headings,
    find_up_error,
    level_axes,
)
from stairmap.detection.profile_segments import ProfileSegments, find_segments, label_cells
from stairmap.detection.refinement import refine_lattice
from stairmap.detection.tracing import trace_detection
from stairmap.frame import DepthFrame

MIN_VALID_SHARE = 0.02
"""A frame with a smaller share of measured pixels is not looked at."""

MAX_HEADINGS = 2
"""Headings of upright surfaces that are tried; the one of risers stands at most distances."""

MIN_DISTANCES = 4
"""Once a stairway was found, other headings are tried only where surfaces stand at so many distances."""

STRIP_NOISE = 0.25
"""Noise of a strip's cell relative to a pixel's: 16 pixels are averaged."""


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
        candidates: list[Candidate] = []
        rejections = self._find_candidates(image, frame, candidates)
        accepted = [candidate for candidate in candidates if candidate.observation is not None]
        observations = _without_duplicates(accepted)
        if observations:
            rejections = ()
        picture = trace_detection(frame, image, candidates, observations) if trace else None
        return Detection(
            stamp_ns=frame.stamp_ns, observations=observations, rejections=rejections, trace=picture
        )

    def _find_candidates(
        self, image: InverseDepthImage, frame: DepthFrame, candidates: list[Candidate]
    ) -> tuple[Rejection, ...]:
        """Fill the list of candidates; return why there is none that was accepted."""
        share = np.count_nonzero(image.valid) / image.valid.size
        if share < MIN_VALID_SHARE:
            return (Rejection(rule="valid_pixels", measured=share, limit=MIN_VALID_SHARE, unit="1"),)
        surfaces = fit_surface_normals(image)
        up = estimate_up(surfaces) if frame.up is None else frame.up
        if up is None:
            return (Rejection(rule="up_from_floor", measured=float("nan"), limit=0.1, unit="1"),)
        limit = np.radians(self._config.detection.max_up_correction_deg)
        corrected = correct_up(surfaces, up, max_correction=limit)
        rejections = self._find_by_up(image, surfaces, corrected, frame, candidates)
        if any(candidate.observation for candidate in candidates) or frame.up is None:
            return rejections
        error = find_up_error(surfaces, frame.up, max_correction=limit)
        if error is None:
            return rejections
        off = float(np.degrees(error))
        return (
            Rejection(rule="max_up_error", measured=off, limit=float(np.degrees(limit)), unit="deg"),
            *rejections,
        )

    def _find_by_up(
        self,
        image: InverseDepthImage,
        surfaces: SurfaceNormals,
        corrected: CorrectedUp,
        frame: DepthFrame,
        candidates: list[Candidate],
    ) -> tuple[Rejection, ...]:
        """Look along all headings; return why there is no candidate that was accepted."""
        up = corrected.up
        headings = find_headings(surfaces, up, max_headings=MAX_HEADINGS)
        self._try_headings(image, surfaces, corrected, headings, frame, candidates)
        if not any(candidate.observation for candidate in candidates):
            others = find_line_headings(image, up, known=headings, max_headings=1)
            self._try_headings(image, surfaces, corrected, others, frame, candidates)
            headings = [*headings, *others]
        if len(headings) == 0:
            return (Rejection(rule="headings", measured=0, limit=1, unit="1"),)
        if not candidates:
            return (
                Rejection(rule="min_steps", measured=0, limit=self._config.detection.min_steps, unit="1"),
            )
        best = max(candidates, key=lambda candidate: candidate.score)
        return best.rejections

    def _try_headings(
        self,
        image: InverseDepthImage,
        surfaces: SurfaceNormals,
        corrected: CorrectedUp,
        headings: Sequence[Heading],
        frame: DepthFrame,
        candidates: list[Candidate],
    ) -> None:
        """Look for stairways along each heading."""
        up, up_std = corrected
        ahead, left = level_axes(up)
        for angle, num_distances in headings:
            if num_distances < MIN_DISTANCES and any(candidate.observation for candidate in candidates):
                continue
            forward = np.cos(angle) * ahead + np.sin(angle) * left
            elevation = make_elevation(image, up, forward)
            if elevation is None:
                continue
            noise = STRIP_NOISE * surfaces.noise
            segments = find_segments(elevation, label_cells(elevation, noise=noise), noise=noise)
            for view_sign in (1, -1):
                found = self._find_lattices(elevation, segments, noise, view_sign)
                for lattice, ends, is_open in found:
                    columns = strip_columns(image.camera.width, lattice.strips, margin=1)
                    refined = refine_lattice(
                        image,
                        lattice,
                        up,
                        forward,
                        ends,
                        noise=surfaces.noise,
                        columns=columns,
                        up_std=up_std,
                        is_open=is_open,
                    )
                    candidates.append(judge_candidate(image, lattice, refined, frame.stamp_ns, self._config))
                if candidates and candidates[-1].observation is not None:
                    break

    def _find_lattices(
        self, elevation: Elevation, segments: ProfileSegments, noise: float, view_sign: int
    ) -> list[tuple[Lattice, Points, bool]]:
        """Lattices along one heading and view, the jumps in the strips of each, and if it is of slabs."""
        creases, in_crease = find_creases(segments)
        fronts = find_tread_fronts(elevation, segments, in_crease[:, 1], view_sign=view_sign)
        ledges = find_ledges(elevation, noise=noise) if view_sign > 0 else np.zeros((0, 3))
        if view_sign > 0:
            tops = find_riser_tops(elevation, segments, in_crease[:, 0])
            others = np.concatenate([creases, tops, fronts])
            ends = np.concatenate([tops, fronts, ledges])
        else:
            others = ends = fronts
        nosings = np.concatenate([others, ledges])
        groups = group_nosings(nosings, num_strips=elevation.inverse_distance.shape[1], noise=noise)
        found = []
        for lattice in find_lattices(groups, self._config.envelope, view_sign=view_sign, noise=noise):
            mine = ends[lattice.strips[ends[:, 2].astype(np.int64)]]
            is_open = is_made_of_ledges(lattice, ledges, others)
            found.append((lattice, lateral_positions(elevation, mine), is_open))
        return found


def _without_duplicates(candidates: list[Candidate]) -> tuple[StairObservation, ...]:
    """Keep the best of the candidates that share columns of the image."""
    kept: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda item: -item.score):
        shares = any(
            min(candidate.columns[1], other.columns[1]) - max(candidate.columns[0], other.columns[0])
            > 0.3 * min(candidate.columns[1] - candidate.columns[0], other.columns[1] - other.columns[0])
            for other in kept
        )
        if not shares:
            kept.append(candidate)
    return tuple(candidate.observation for candidate in kept if candidate.observation is not None)
