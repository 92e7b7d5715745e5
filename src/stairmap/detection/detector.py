"""The default detector: one depth frame in, stair edges or reasons out.

Up, headings, side elevations, nosings, lattice, profile, evidence, judgement: the method is told with
pictures in docs/method.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stairmap.arrays import Float64Array, Vector
from stairmap.config import Config
from stairmap.detection.candidate import Candidate, Scene, examine
from stairmap.detection.drops import find_drops, find_voids
from stairmap.detection.elevation import Elevation, make_elevation, sharpened
from stairmap.detection.fit import MIN_NOISE
from stairmap.detection.ground import sample_ground
from stairmap.detection.inverse_depth import (
    InverseDepthImage,
    SurfaceNormals,
    estimate_smoothings,
    fit_surface_normals,
    inverse_depth_from_frame,
)
from stairmap.detection.lattice import Lattice, find_lattices, group_corners
from stairmap.detection.nosing_search import find_corners, find_turns
from stairmap.detection.observation import Detection, Rejection, StairObservation
from stairmap.detection.orientation import (
    GIVEN_UP_STD,
    CorrectedUp,
    Heading,
    correct_up,
    estimate_up,
    find_headings,
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
"""Once a stairway was found, other headings are tried only where surfaces stand at this many distances."""

SAME_HEADING = np.radians(8.0)
"""Headings nearer than this to one that was tried are not tried again, rad."""

MIN_TURN, MAX_TURN = np.radians(3.0), np.radians(20.0)
"""A heading is turned square to the edges seen along it where they differ by this much, rad."""

MIN_SHARPENED = 1.5
"""Where nothing was found, scans of a sensor that smooths over more rows than this, as phones do, are
sharpened to look for stairs that descend: it leaves no corners of treads that few rows show."""

STRIP_NOISE = 0.25
"""Noise of a strip's ray relative to a pixel's: 16 pixels are averaged."""

MAX_EDGE_HEADINGS = 2
"""Headings of level edges that are tried where upright surfaces led to nothing."""

MAX_LATTICES = 3
"""Lattices along one heading that are examined."""

MIN_PAIR_SCORE = 5.0
"""Least score of a lattice of two nosings, strips: both are seen over a width of stairs."""

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
        candidates, rejections, scenes, ground_up = self._find_candidates(image, frame)
        observations = _without_duplicates(candidates, image)
        height = self._config.detection.camera_height or None
        ground = None if ground_up is None else sample_ground(image, ground_up, camera_height=height)
        if observations:
            rejections = ()
        picture = trace_detection(frame, image, scenes, candidates, observations) if trace else None
        return Detection(
            stamp_ns=frame.stamp_ns, observations=observations, rejections=rejections, trace=picture,
            ground=None if ground is None else ground.view,
            drops=() if ground is None else find_drops(ground),
            voids=() if ground is None else find_voids(ground),
        )  # fmt: skip

    def _find_candidates(
        self, image: InverseDepthImage, frame: DepthFrame
    ) -> tuple[list[Candidate], tuple[Rejection, ...], list[Scene], Vector | None]:
        """Return the candidates, why none was accepted, what was looked along, and the ground's normal."""
        share = np.count_nonzero(image.valid) / image.valid.size
        if share < MIN_VALID_SHARE:
            few = Rejection(rule="valid_pixels", measured=share, limit=MIN_VALID_SHARE, unit="1")
            return [], (few,), [], None
        surfaces = fit_surface_normals(image)
        up = estimate_up(surfaces) if frame.up is None else frame.up
        if up is None:
            no_up = Rejection(rule="up_from_floor", measured=float("nan"), limit=0.1, unit="1")
            return [], (no_up,), [], None
        limit = np.radians(self._config.detection.max_up_correction_deg)
        std = GIVEN_UP_STD if frame.up is None or frame.up_std is None else frame.up_std
        corrected = correct_up(surfaces, up, max_correction=limit, std=std)
        candidates, rejections, scenes = self._look_around(image, surfaces, corrected, frame.stamp_ns)
        if _any_accepted(candidates) or frame.up is None:
            return candidates, rejections, scenes, corrected.ground
        error = find_up_error(surfaces, frame.up, max_correction=limit)
        if error is not None:
            off = float(np.degrees(error))
            wrong = Rejection(rule="max_up_error", measured=off, limit=float(np.degrees(limit)), unit="deg")
            rejections = (wrong, *rejections)
        return candidates, rejections, scenes, corrected.ground

    def _look_around(
        self, image: InverseDepthImage, surfaces: SurfaceNormals, corrected: CorrectedUp, stamp_ns: int
    ) -> tuple[list[Candidate], tuple[Rejection, ...], list[Scene]]:
        """Look along all headings; for what is returned see ``_find_candidates``.

        Upright surfaces tell most headings; where they lead to nothing, level edges do, as with stairs that
        descend and show no risers.
        """
        look = _Look(image, surfaces, corrected, stamp_ns, self._config)
        headings = find_headings(surfaces, corrected.up, max_headings=MAX_HEADINGS)
        candidates = look.along_all(headings)
        if not _any_accepted(candidates) and look.sharpen():
            candidates += look.along_all(headings)
        if not look.scenes:
            return candidates, (Rejection(rule="headings", measured=0, limit=1, unit="1"),), look.scenes
        if not candidates:
            limit = self._config.detection.min_steps
            return candidates, (Rejection(rule="min_steps", measured=0, limit=limit, unit="1"),), look.scenes
        # One that was accepted may yet give way to what winds: that one's reasons count.
        rejected = [candidate for candidate in candidates if candidate.rejections]
        best = max(rejected, key=lambda candidate: candidate.score, default=candidates[0])
        return candidates, best.rejections, look.scenes


class _Look:
    """One frame that is looked along several headings."""

    def __init__(
        self,
        image: InverseDepthImage,
        surfaces: SurfaceNormals,
        corrected: CorrectedUp,
        stamp_ns: int,
        config: Config,
    ) -> None:
        self._image, self._corrected, self._stamp_ns, self._config = image, corrected, stamp_ns, config
        self._level_axes = level_axes(corrected.up)
        self._noise = max(STRIP_NOISE * surfaces.noise, MIN_NOISE)
        self._smoothings = estimate_smoothings(image)
        self._is_sharp = False
        self._elevations: dict[float, tuple[Elevation, float] | None] = {}
        self.scenes: list[Scene] = []

    def sharpen(self) -> bool:
        """Sharpen all scans from now on, for stairs that descend, and say whether that may show more."""
        self._is_sharp = max(self._smoothings) > MIN_SHARPENED
        return self._is_sharp

    def along_all(self, headings: Sequence[Heading]) -> list[Candidate]:
        """Look along headings, then, where nothing was found, along those of level edges."""
        candidates: list[Candidate] = []
        for angle, num_distances in headings:
            if num_distances >= MIN_DISTANCES or not _any_accepted(candidates):
                candidates += self.along(angle)
        if not _any_accepted(candidates):
            for angle in self.headings_of_edges([heading.angle for heading in headings]):
                candidates += self.along(angle)
        return candidates

    def along(self, angle: float) -> list[Candidate]:
        """Examine what repeats like stairs along a heading, turned square to the edges seen there."""
        scene = self._scan(angle)
        if scene is None:
            return []
        turns = find_turns(scene.elevation, scene.corners, max_turns=1)
        if turns and MIN_TURN < abs(turns[0]) < MAX_TURN:
            scene = self._scan(angle + turns[0]) or scene
        groups = group_corners(scene.corners, num_strips=len(scene.elevation.bearing), noise=self._noise)
        lattices = find_lattices(groups, self._config.envelope, noise=self._noise, max_lattices=MAX_LATTICES)
        chosen = _promising(lattices)
        if self._is_sharp:
            chosen = [lattice for lattice in chosen if lattice.run < 0]
        return [examine(scene, lattice, self._config) for lattice in chosen]

    def headings_of_edges(self, known: Sequence[float]) -> list[float]:
        """Headings square to level edges that are in view, without those that are known."""
        scene = self._scan(0.0)
        if scene is None:
            return []
        turns = find_turns(scene.elevation, scene.corners, max_turns=MAX_EDGE_HEADINGS + len(known))
        return [turn for turn in turns if all(abs(turn - other) > SAME_HEADING for other in known)]

    def _scan(self, angle: float) -> Scene | None:
        """The frame along a heading; ``None`` where it does not look there."""
        if angle not in self._elevations:
            self._elevations[angle] = self._sample(angle)
        sampled = self._elevations[angle]
        if sampled is None:
            return None
        elevation, ground_slope = sampled
        scans = sharpened(elevation, max(self._smoothings)) if self._is_sharp else elevation
        scene = Scene(
            image=self._image, elevation=elevation, corners=find_corners(scans, noise=self._noise),
            noise=self._noise, smoothings=self._smoothings, up_std=self._corrected.std,
            ground_slope=ground_slope, stamp_ns=self._stamp_ns,
        )  # fmt: skip
        self.scenes.append(scene)
        return scene

    def _sample(self, angle: float) -> tuple[Elevation, float] | None:
        """The elevation along a heading, and how much the ground climbs there."""
        ground = self._corrected.ground
        ahead, left = self._level_axes
        forward = math.cos(angle) * ahead + math.sin(angle) * left
        # Ground that slopes aside turns no rise: only along the heading does it matter what is level.
        climb = float(ground @ forward)
        up = normalized(ground - climb * forward)
        elevation = make_elevation(self._image, up, forward)
        return None if elevation is None else (elevation, -climb / float(ground @ up))


def _promising(lattices: Sequence[Lattice]) -> list[Lattice]:
    """The lattices worth a fit: two nosings find one anywhere, so of pairs only the first, if it is wide."""
    return [
        lattice
        for place, lattice in enumerate(lattices)
        if len(lattice.indices) > 2 or (place == 0 and lattice.score >= MIN_PAIR_SCORE)
    ]


def _any_accepted(candidates: Sequence[Candidate]) -> bool:
    return any(candidate.observation is not None for candidate in candidates)


def _without_duplicates(
    candidates: Sequence[Candidate], image: InverseDepthImage
) -> tuple[StairObservation, ...]:
    """Keep the best of the accepted candidates that share a part of the image.

    What winds keeps its part as well, before others of as many steps: a piece of it may look like a straight
    flight.
    """

    def winds(candidate: Candidate) -> bool:
        # All of its steps are turned; along a wrong heading only those are that show it clearly.
        measured = {rejection.rule: rejection.measured for rejection in candidate.rejections}
        return "max_turn" in measured and measured.get("min_steps") == 0

    kept: list[tuple[Float64Array, StairObservation | None]] = []
    some = [item for item in candidates if item.observation is not None or winds(item)]
    if len(some) == 1:
        return () if some[0].observation is None else (some[0].observation,)
    for candidate in sorted(some, key=lambda item: (int(item.score), winds(item), item.score), reverse=True):
        area = _area_of(candidate, image)
        if all(shared_part(area, other) <= MAX_OVERLAP for other, _ in kept):
            kept.append((area, candidate.observation))
    return tuple(observation for _, observation in kept if observation is not None)


def _area_of(candidate: Candidate, image: InverseDepthImage) -> Float64Array:
    """(2, 2) least and greatest pixel coordinates of the ends of a candidate's steps."""
    pixels = image.camera.project(candidate.ends())
    if not np.isfinite(pixels).any():
        return np.zeros((2, 2))
    size = [image.camera.width - 1, image.camera.height - 1]
    return np.stack(
        [np.clip(np.nanmin(pixels, axis=0), 0, size), np.clip(np.nanmax(pixels, axis=0), 0, size)]
    )


def shared_part(first: Float64Array, second: Float64Array) -> float:
    """Return which part of the smaller of two areas, (2, 2) least and greatest corner, lies in the other."""
    shared = np.minimum(first[1], second[1]) - np.maximum(first[0], second[0])
    if (shared <= 0).any():
        return 0.0
    smaller = min(float(np.prod(first[1] - first[0])), float(np.prod(second[1] - second[0])))
    return float(np.prod(shared)) / max(smaller, 1.0)
