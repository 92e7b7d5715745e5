"""The report's stair edge detector: ARL-TR-6381 section 3.3, Algorithm 2."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from stairmap.arrays import DepthImage, Float64Array, IntArray, Mask, Points, Vector
from stairmap.camera import PinholeCamera
from stairmap.config import Config
from stairmap.delmerico2013.collinear import merge_collinear_lines
from stairmap.delmerico2013.lines import (
    GreyImage,
    clip_lines_to_columns,
    extract_edges,
    find_candidate_lines,
    find_shared_columns,
    grey_from_depth,
    pixels_on_lines,
    remove_edges_at_invalid_depth,
    select_dominant_slope,
)
from stairmap.delmerico2013.nosings import edges_from_points
from stairmap.detection.observation import Detection, DetectionTrace, Rejection, StairObservation
from stairmap.frame import DepthFrame
from stairmap.geometry import fit_plane, normalized

WORKING_WIDTH = 320
"""Columns of the images that the report's pixel thresholds are for."""

MIN_LINES = 3
MIN_COLUMNS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class _Lines:
    """What the image part of the algorithm found, in pixels of the working image."""

    edges: GreyImage
    candidates: Float64Array
    accepted: Float64Array


class Delmerico2013Detector:
    """Finds ascending stairs as parallel lines of depth discontinuity (ARL-TR-6381, Algorithm 2).

    Where the report is silent:

    * **Other image sizes than 320x240.** The image is thinned to every n-th pixel, n the whole number
      that brings its width nearest to 320, and all thresholds stay as published. Thinning, other than
      averaging, makes no depths between the two sides of an edge. Images narrower than 320 are
      taken as they are.
    * **Up.** Without ``frame.up`` the camera is taken to be level, as the report's robots carry it: up
      is -y.
    * **The point of a line's pixel** (line 12): the nearest to the camera of the pixel and its 8
      neighbours. A line lies on a depth discontinuity to within a pixel or so, and the far side belongs to
      the next riser, not to this nosing. On 40 rendered staircases of run 0.28 m with Kinect noise this
      gives runs of 0.27 m on average, the pixel itself 0.46 m.
    * **Tilt of the plane.** The report's 0 to 45 degrees has no lower limit that could fail, so a level
      plane passes.

    Parameters
    ----------
    config
        ``config.delmerico2013.max_pitch_deg`` is used; the other numbers are the report's.
    """

    def __init__(self, config: Config) -> None:
        self._max_pitch_deg = config.delmerico2013.max_pitch_deg

    def detect(self, frame: DepthFrame, *, trace: bool = False) -> Detection:
        """Look for ascending stairs in one frame.

        Parameters
        ----------
        frame
            Depth image of any size.
        trace
            Whether the result also carries edge pixels and lines for pictures.

        Returns
        -------
        Detection with one observation, or with the rejections ``no_edges`` (no line at all), ``min_lines``,
        ``min_columns`` (pixels of the thinned image), ``no_plane`` (too few points) or ``max_pitch``.
        """
        stride = max(1, round(frame.camera.width / WORKING_WIDTH))
        depth = thinned_depth(frame.depth, stride)
        camera = frame.camera if stride == 1 else frame.camera.strided(stride)
        lines, rejections = find_stair_lines(depth)
        observation = None
        if not rejections:
            up = np.array([0.0, -1.0, 0.0]) if frame.up is None else frame.up
            found = self._observe(depth, camera, lines.accepted, up, frame.stamp_ns)
            if isinstance(found, Rejection):
                rejections = (found,)
            else:
                observation = found
        return Detection(
            stamp_ns=frame.stamp_ns,
            observations=() if observation is None else (observation,),
            rejections=rejections,
            trace=_trace(lines, stride, frame.depth.shape, accepted=observation is not None)
            if trace
            else None,
        )

    def _observe(
        self, depth: DepthImage, camera: PinholeCamera, lines: Float64Array, up: Vector, stamp_ns: int
    ) -> StairObservation | Rejection:
        """Lines 12 to 15: points of the lines, their plane, its pitch."""
        points, line_index = extract_line_points(depth, camera, lines)
        plane = fit_plane(points)
        if plane is None:
            return Rejection(rule="no_plane", measured=len(points), limit=MIN_LINES, unit="1")
        pitch_deg = float(np.degrees(np.arccos(min(1.0, abs(float(plane[:3] @ up))))))
        if pitch_deg > self._max_pitch_deg:
            return Rejection(rule="max_pitch", measured=pitch_deg, limit=self._max_pitch_deg, unit="deg")
        forward = uphill_direction(plane, up)
        edges = edges_from_points(points, line_index, forward=forward, up=up)
        middles = np.array([edge.nosing.mean(axis=0) for edge in edges])
        # The mean of adjacent differences telescopes to that of the first and the last edge.
        per_step = (middles[-1] - middles[0]) / max(len(edges) - 1, 1)
        return StairObservation(
            stamp_ns=stamp_ns,
            view="ascending",
            up=up,
            forward=forward,
            edges=edges,
            rise=float(per_step @ up),
            run=float(per_step @ forward),
            width=float(np.median([np.linalg.norm(edge.nosing[1] - edge.nosing[0]) for edge in edges])),
            origin=middles[0],
            covariance=np.zeros((0, 0)),
            points=points,
        )


def thinned_depth(depth: DepthImage, stride: int) -> DepthImage:
    """Return a copy of every ``stride``-th pixel of a depth image, with 0 for NaN as in the report."""
    thinned = np.array(depth[::stride, ::stride], dtype=np.float32)
    cv2.patchNaNs(thinned, 0.0)
    return thinned


def find_stair_lines(depth: DepthImage) -> tuple[_Lines, tuple[Rejection, ...]]:
    """Find the lines that may be stair edges, or why there are none (Algorithm 2, lines 2 to 11).

    Parameters
    ----------
    depth
        Thinned depth in metres, 0 where nothing was measured.
    """
    grey = grey_from_depth(depth)
    edges = remove_edges_at_invalid_depth(extract_edges(grey), grey)
    candidates = find_candidate_lines(edges)
    parallel = select_dominant_slope(merge_collinear_lines(candidates))
    columns = find_shared_columns(parallel, depth.shape[1])
    if columns is None:
        lines = _Lines(edges=edges, candidates=candidates, accepted=parallel)
        return lines, (Rejection(rule="no_edges", measured=0, limit=1, unit="1"),)
    left, right = columns
    accepted = clip_lines_to_columns(parallel, left, right)
    lines = _Lines(edges=edges, candidates=candidates, accepted=accepted)
    rejections = []
    if len(accepted) < MIN_LINES:
        rejections.append(Rejection(rule="min_lines", measured=len(accepted), limit=MIN_LINES, unit="1"))
    if right - left < MIN_COLUMNS:
        rejections.append(Rejection(rule="min_columns", measured=right - left, limit=MIN_COLUMNS, unit="px"))
    return lines, tuple(rejections)


def extract_line_points(
    depth: DepthImage, camera: PinholeCamera, lines: Float64Array
) -> tuple[Points, IntArray]:
    """Return the points of the lines' pixels (line 12).

    Parameters
    ----------
    depth
        (height, width) in metres, 0 where nothing was measured.
    camera
        The camera of this image.
    lines
        (N, 4) lines in its pixels.

    Returns
    -------
    (K, 3) points in the camera frame, in metres, and (K,) indices of their lines, in ascending order.
    Each is the nearest of the pixel and its 8 neighbours; a pixel without any measurement gives none.
    """
    pixels, line_index = pixels_on_lines(lines)
    # A merged line may end just outside of the image.
    pixels = np.clip(pixels, 0, np.array(depth.shape)[::-1] - 1)
    # A border that was never measured gives every pixel 8 neighbours.
    padded = cv2.copyMakeBorder(depth, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0.0)
    width = padded.shape[1]
    around = np.array([row * width + column for row in range(3) for column in range(3)])
    candidates = (pixels[:, 1] * width + pixels[:, 0])[:, None] + around
    depths = padded.ravel()[candidates]
    depths[depths <= 0] = np.inf
    nearest = depths.argmin(axis=1)
    chosen = depths[np.arange(len(depths)), nearest]
    chosen_pixels = pixels + np.stack([nearest % 3 - 1, nearest // 3 - 1], axis=1)
    measured = np.isfinite(chosen)
    return camera.unproject_pixels(chosen_pixels[measured], chosen[measured]), line_index[measured]


def uphill_direction(plane: Float64Array, up: Vector) -> Vector:
    """Return the level (3,) unit vector along which a plane rises.

    For a level plane, which rises nowhere, it is the level direction of the camera's view.
    """
    normal = plane[:3] if plane[:3] @ up >= 0 else -plane[:3]
    level = (normal @ up) * up - normal
    if np.linalg.norm(level) < 1e-6:
        view = np.array([0.0, 0.0, 1.0])
        level = view - (view @ up) * up
    return normalized(level)


def _trace(lines: _Lines, stride: int, shape: tuple[int, ...], *, accepted: bool) -> DetectionTrace:
    """Bring the lines into the pixels of the full frame; lines of a rejected frame are no accepted lines."""
    height, width = shape
    edges = np.repeat(np.repeat(lines.edges > 0, stride, axis=0), stride, axis=1)[:height, :width]
    nothing: Mask = np.zeros((height, width), dtype=np.bool_)
    return DetectionTrace(
        edge_pixels=edges,
        candidate_lines=lines.candidates * stride,
        accepted_lines=lines.accepted * stride if accepted else np.empty((0, 4)),
        tread_pixels=nothing,
        riser_pixels=nothing,
    )
