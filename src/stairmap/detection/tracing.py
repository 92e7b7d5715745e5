"""What the detector saw on the way, for pictures."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from stairmap.arrays import Float64Array, Mask
from stairmap.camera import PinholeCamera
from stairmap.detection.candidates import Candidate
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.ledges import MAX_THICKNESS
from stairmap.detection.observation import DetectionTrace, StairObservation
from stairmap.detection.stair_pixels import find_members, gather_pixels
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
    lines = []
    for candidate in candidates:
        if candidate.refined is not None:
            lines.append(_candidate_lines(frame.camera, candidate))
    with_surfaces = [candidate for candidate in candidates if candidate.refined is not None]
    if with_surfaces:
        best = max(with_surfaces, key=lambda candidate: candidate.score)
        _paint(treads, risers, image, best)
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
    """The nosings of a candidate's lattice over the lateral range of its pixels, in pixels."""
    refined = candidate.refined
    assert refined is not None
    member = refined.members.tread | refined.members.riser
    if not member.any():
        return np.zeros((0, 4))
    low, high = np.percentile(refined.pixels.left[member], [5, 95])
    left = cross(refined.up, refined.forward)
    lines = []
    for index in np.flatnonzero(refined.nosings.is_seen):
        point = (refined.distance + index * refined.run) * refined.forward
        point = point + (refined.height + index * refined.rise) * refined.up
        lines.append(camera.project(np.array([point + high * left, point + low * left])).reshape(4))
    found = np.array(lines).reshape(-1, 4)
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _paint(treads: Mask, risers: Mask, image: InverseDepthImage, candidate: Candidate) -> None:
    """Mark a candidate's surfaces, of all its pixels, in masks of the frame's size."""
    refined = candidate.refined
    assert refined is not None
    columns = (int(refined.pixels.column.min()), int(refined.pixels.column.max()) + 1)
    pixels = gather_pixels(image, refined.up, refined.forward, columns=columns)
    members = find_members(
        pixels,
        distance=refined.distance,
        height=refined.height,
        run=refined.run,
        rise=refined.rise,
        noise=refined.noise,
        num_nosings=len(refined.nosings.num_tread_pixels),
        slab_thickness=MAX_THICKNESS if refined.is_open else None,
    )
    for mask, chosen in ((treads, members.tread), (risers, members.riser)):
        small = np.zeros(image.valid.shape, dtype=bool)
        small[pixels.row[chosen], pixels.column[chosen]] = True
        large = np.repeat(np.repeat(small, image.stride, axis=0), image.stride, axis=1)
        height, width = large.shape
        mask[:height, :width] |= large


def _dilated(mask: Mask, radius: int) -> Mask:
    """The mask grown by a square."""
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)
