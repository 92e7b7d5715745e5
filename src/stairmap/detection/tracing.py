"""What the detector saw on the way, for pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.detection.candidate import Candidate, Scene
from stairmap.detection.elevation import Elevation
from stairmap.detection.evidence import tolerances
from stairmap.detection.extents import StepExtents
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.judgement import Case
from stairmap.detection.lattice import Lattice
from stairmap.detection.nosing_search import Corners
from stairmap.detection.observation import DetectionTrace, Rejection, StairObservation
from stairmap.detection.profile import Surface
from stairmap.frame import DepthFrame
from stairmap.geometry import cross


@dataclass(frozen=True, slots=True, kw_only=True)
class StepsTrace:
    """The default method's own steps along one heading: what was found, fitted, counted and judged.

    Attributes
    ----------
    elevation
        The scans along the heading.
    corners
        The convex corners found in them.
    lattice
        The nosings that repeat; ``None`` where none do, and then nothing of what follows is there.
    case
        The fitted profile, its evidence, and the rays; ``None`` where no profile could be fitted.
    extents
        How far each step reaches to either side.
    rejections
        The rules against it.
    """

    elevation: Elevation
    corners: Corners
    lattice: Lattice | None = None
    case: Case | None = None
    extents: StepExtents | None = None
    rejections: tuple[Rejection, ...] = ()


def trace_detection(
    frame: DepthFrame,
    image: InverseDepthImage,
    scenes: Sequence[Scene],
    candidates: Sequence[Candidate],
    observations: Sequence[StairObservation],
) -> DetectionTrace:
    """Return what a detector did with a frame, for pictures.

    Surfaces and steps are those of the best candidate. Its edge pixels are where treads and risers meet.

    Parameters
    ----------
    frame, image
        The frame and its inverse depth.
    scenes
        The headings that were looked along.
    candidates, observations
        What was found along them, and what was accepted of it.
    """
    shape = frame.depth.shape
    treads, risers = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    fitted = [candidate for candidate in candidates if candidate.case is not None]
    lines = [_candidate_lines(frame.camera, candidate) for candidate in fitted]
    if fitted:
        _paint(treads, risers, image, max(fitted, key=lambda candidate: candidate.score))
    edge_pixels = _dilated(treads, 3 * image.stride) & _dilated(risers, 3 * image.stride)
    accepted = [
        frame.camera.project(edge.nosing).reshape(4)
        for observation in observations
        for edge in observation.edges
    ]
    return DetectionTrace(
        edge_pixels=edge_pixels,
        candidate_lines=np.concatenate(lines) if lines else np.zeros((0, 4)),
        accepted_lines=np.array(accepted).reshape(-1, 4),
        tread_pixels=treads,
        riser_pixels=risers,
        steps=_trace_steps(scenes, candidates),
    )


def _trace_steps(scenes: Sequence[Scene], candidates: Sequence[Candidate]) -> StepsTrace | None:
    """The steps of the best candidate, an accepted one if there is any; else the first heading's corners."""
    if candidates:
        best = max(candidates, key=lambda candidate: (candidate.observation is not None, candidate.score))
        return StepsTrace(
            elevation=best.scene.elevation,
            corners=best.scene.corners,
            lattice=best.lattice,
            case=best.case,
            extents=best.extents,
            rejections=best.rejections,
        )
    if not scenes:
        return None
    return StepsTrace(elevation=scenes[0].elevation, corners=scenes[0].corners)


def _candidate_lines(camera: PinholeCamera, candidate: Candidate) -> Float64Array:
    """The nosings of a candidate's profile over the strips that found it, in pixels."""
    lines = camera.project(candidate.fitted_nosings()).reshape(-1, 4)
    return np.asarray(lines[np.isfinite(lines).all(axis=1)])


def _paint(treads: Mask, risers: Mask, image: InverseDepthImage, candidate: Candidate) -> None:
    """Mark the pixels that lie on a candidate's surfaces in masks of the frame's size."""
    assert candidate.case is not None
    fitted, elevation = candidate.case.fitted, candidate.scene.elevation
    up, forward = fitted.axes(elevation)
    rays = image.camera.rays()
    ahead = rays @ forward
    bearings = elevation.bearing[candidate.lattice.strips]
    bearing = (rays @ cross(up, forward)) / np.where(ahead > 0, ahead, np.inf)
    row, column = np.nonzero(
        (ahead > 0) & image.valid & (bearing < bearings.max() + 0.1) & (bearing > bearings.min() - 0.1)
    )
    slope = (rays[row, column] @ up) / ahead[row, column]
    if len(slope) == 0:
        return
    predicted = fitted.predict(slope)
    entry = predicted.entries(slope)
    measured = image.inverse_depth[row, column] / ahead[row, column]
    # A strip's ray averages sixteen pixels.
    tolerance = tolerances(predicted, fitted.profile, 4.0 * fitted.noise)[entry]
    on = np.abs(measured - predicted.expected(slope, entry)) < tolerance
    surface = predicted.surface[entry]
    is_tread = surface == Surface.TREAD
    is_riser = (surface == Surface.RISER) | (surface == Surface.FRONT)
    for mask, chosen in ((treads, on & is_tread), (risers, on & is_riser)):
        small = np.zeros(image.valid.shape, dtype=bool)
        small[row[chosen], column[chosen]] = True
        large = np.repeat(np.repeat(small, image.stride, axis=0), image.stride, axis=1)
        height, width = large.shape
        mask[:height, :width] |= large


def _dilated(mask: Mask, radius: int) -> Mask:
    """The mask grown by a square."""
    size = 2 * radius + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0)
