"""What the detector saw on the way, for pictures."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.detection.candidate import Candidate
from stairmap.detection.evidence import tolerances
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.observation import DetectionTrace, StairObservation
from stairmap.detection.profile import Surface
from stairmap.frame import DepthFrame
from stairmap.geometry import cross


def trace_detection(
    frame: DepthFrame,
    image: InverseDepthImage,
    candidates: Sequence[Candidate],
    observations: Sequence[StairObservation],
) -> DetectionTrace:
    """Return the treads, risers, candidate nosings and accepted nosings of a detection.

    Surfaces are those of the best candidate. Its edge pixels are where treads and risers meet.
    """
    shape = frame.depth.shape
    treads, risers = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    fitted = [candidate for candidate in candidates if candidate.fitted is not None]
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
    )


def _candidate_lines(camera: PinholeCamera, candidate: Candidate) -> Float64Array:
    """The nosings of a candidate's profile over the strips that found it, in pixels."""
    fitted, elevation = candidate.fitted, candidate.scene.elevation
    assert fitted is not None
    up, forward = fitted.axes(elevation)
    left = cross(up, forward)
    bearings = elevation.bearing[candidate.lattice.strips]
    s, z = fitted.profile.nosing_distances, fitted.profile.tread_heights[1:]
    points = s[:, None, None] * (forward + np.array([bearings.max(), bearings.min()])[:, None] * left)
    lines = camera.project(points + z[:, None, None] * up).reshape(-1, 4)
    return np.asarray(lines[np.isfinite(lines).all(axis=1)])


def _paint(treads: Mask, risers: Mask, image: InverseDepthImage, candidate: Candidate) -> None:
    """Mark the pixels that lie on a candidate's surfaces in masks of the frame's size."""
    fitted, elevation = candidate.fitted, candidate.scene.elevation
    assert fitted is not None
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
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)
