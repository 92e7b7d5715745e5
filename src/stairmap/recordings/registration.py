"""Poses from depth alone: each frame is registered to a key frame with small_gicp.

The library does the registration (generalised ICP: Segal, Haehnel, Thrun, RSS 2009). Here is only
what makes its result safe to use: points of a depth image, when to take the next key frame, and
when a result is none. Directions of motion that the view does not determine (along a corridor,
along the steps) show as small eigenvalues of the registration's information matrix; they keep the
motion of the frame before (solution remapping: Zhang, Kaess, Singh, ICRA 2016).
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, Points, Transform
from stairmap.detection.inverse_depth import inverse_depth_from_frame
from stairmap.errors import MissingPackageError
from stairmap.frame import DepthFrame
from stairmap.transforms import (
    invert_transform,
    rotation_from_vector,
    transform_from_parts,
    vector_from_rotation,
)

MAX_DEPTH = 6.0
"""Farthest depth that is registered, m."""

POINTS_WIDTH = 160
"""Depth images are thinned to about so many columns."""

VOXEL_SIZE = 0.05
"""Points are averaged in cubes of this size, m."""

NUM_NEIGHBOURS = 10
"""Points that make one covariance."""

MAX_CORRESPONDENCE = 0.2
"""Farthest pair of points, m."""

MAX_ITERATIONS = 30
"""Iterations of one registration."""

MIN_POINTS = 300
"""Fewest points of a frame that is registered, after averaging."""

MIN_INLIER_SHARE = 0.5
"""Share of a frame's points that must find a partner in the key frame."""

KEY_FRAME_SHARE = 0.6
"""Below this share of partners, the frame becomes the next key frame."""

KEY_FRAME_DISTANCE = 0.15
"""After this way the frame becomes the next key frame, m."""

KEY_FRAME_ANGLE = np.radians(6.0)
"""After this turn the frame becomes the next key frame, rad."""

MAX_SPEED = 4.0
"""A registration that moves faster than this, m/s, is wrong."""

MAX_TURN_RATE = np.radians(240.0)
"""A registration that turns faster than this, rad/s, is wrong."""

MAX_LOST_NS = 1_000_000_000
"""After so long without a pose, nanoseconds, nobody knows where the camera went."""

LEVER = 2.0
"""A turn of 1 rad counts as a motion of this length: the usual distance of what is seen, m."""

EIGENVALUE_OF_PLANES = 0.6
"""Eigenvalue of the information per point that even a lone plane gives along itself: GICP lets each
point slide on its plane only at a cost."""

EIGENVALUE_OF_PRIOR = 0.3
"""Weight, in eigenvalues per point, of going on as before."""

MIN_EIGENVALUE = 0.8
"""Below this eigenvalue per point, a direction counts as not determined (measured: docs/odometry.md)."""


class TrackState(Enum):
    """What came of a frame."""

    START = "the first frame of a piece"
    TRACKED = "registered"
    UNDETERMINED = "registered, but a direction of motion is not determined by what is in view"
    TOO_FEW_POINTS = "too few points"
    LOST = "the registration was lost"

    @property
    def has_pose(self) -> bool:
        """Whether the frame has a pose."""
        return self not in {TrackState.TOO_FEW_POINTS, TrackState.LOST}


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackedFrame:
    """Where a frame was taken.

    Attributes
    ----------
    stamp_ns
        Its stamp, in nanoseconds.
    state
        What came of it.
    piece
        Number of the piece of trajectory, from 0. Poses of two pieces have no relation.
    piece_from_camera
        (4, 4) pose in the coordinate frame of the piece's first camera; ``None`` without one.
    """

    stamp_ns: int
    state: TrackState
    piece: int
    piece_from_camera: Transform | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _KeyFrame:
    cloud: Any
    tree: Any
    piece_from_camera: Transform


class DepthOdometry:
    """Follows a camera by registering its depth frames, one after the other.

    Raises
    ------
    MissingPackageError
        Without the package small_gicp.
    """

    def __init__(self) -> None:
        try:
            self._library: Any = importlib.import_module("small_gicp")
        except ImportError as error:
            raise MissingPackageError("small_gicp", "odometry", "odometry from depth") from error
        self._key_frame: _KeyFrame | None = None
        self._piece = -1
        self._pose: Transform = np.eye(4)
        self._step: Transform = np.eye(4)
        self._stamp_ns = 0

    def track(self, frame: DepthFrame) -> TrackedFrame:
        """Return where a frame was taken; frames come in the order of their stamps.

        A frame that cannot be registered has no pose, and the next one is tried against the same key
        frame. After ``MAX_LOST_NS`` without success, a new piece of trajectory begins.
        """
        points = points_from_frame(frame)
        cloud, tree = None, None
        if len(points) >= MIN_POINTS:
            cloud, tree = self._library.preprocess_points(
                points, downsampling_resolution=VOXEL_SIZE, num_neighbors=NUM_NEIGHBOURS
            )
        if cloud is None or len(cloud) < MIN_POINTS:
            return self._tracked(frame, TrackState.TOO_FEW_POINTS)
        if self._key_frame is None or frame.stamp_ns - self._stamp_ns > MAX_LOST_NS:
            return self._begin_piece(frame, cloud, tree)
        guess = invert_transform(self._key_frame.piece_from_camera) @ self._pose @ self._step
        result = self._library.align(
            self._key_frame.cloud,
            cloud,
            self._key_frame.tree,
            init_T_target_source=guess,
            registration_type="GICP",
            max_correspondence_distance=MAX_CORRESPONDENCE,
            max_iterations=MAX_ITERATIONS,
            rotation_epsilon=1e-4,
            translation_epsilon=1e-4,
        )
        share = result.num_inliers / len(cloud)
        key_from_camera, is_determined = _keep_determined(guess, result)
        pose = _rigid(self._key_frame.piece_from_camera @ key_from_camera)
        step = invert_transform(self._pose) @ pose
        if share < MIN_INLIER_SHARE or not _is_plausible(step, frame.stamp_ns - self._stamp_ns):
            # What moved it before says nothing about what moves it when it is found again.
            self._step = np.eye(4)
            return self._tracked(frame, TrackState.LOST)
        self._pose, self._step, self._stamp_ns = pose, step, frame.stamp_ns
        if (
            share < KEY_FRAME_SHARE
            or np.linalg.norm(key_from_camera[:3, 3]) > KEY_FRAME_DISTANCE
            or _angle(key_from_camera) > KEY_FRAME_ANGLE
        ):
            self._key_frame = _KeyFrame(cloud=cloud, tree=tree, piece_from_camera=pose)
        return self._tracked(frame, TrackState.TRACKED if is_determined else TrackState.UNDETERMINED)

    def _begin_piece(self, frame: DepthFrame, cloud: Any, tree: Any) -> TrackedFrame:
        self._piece += 1
        self._pose, self._step, self._stamp_ns = np.eye(4), np.eye(4), frame.stamp_ns
        self._key_frame = _KeyFrame(cloud=cloud, tree=tree, piece_from_camera=self._pose)
        return self._tracked(frame, TrackState.START)

    def _tracked(self, frame: DepthFrame, state: TrackState) -> TrackedFrame:
        return TrackedFrame(
            stamp_ns=frame.stamp_ns,
            state=state,
            piece=self._piece,
            piece_from_camera=self._pose.copy() if state.has_pose else None,
        )


def points_from_frame(frame: DepthFrame) -> Points:
    """Return (N, 3) points of a frame, thinned, camera frame, m."""
    image = inverse_depth_from_frame(frame, max_depth=MAX_DEPTH)
    stride = max(1, round(image.camera.width / POINTS_WIDTH))
    first = stride // 2
    inverse = image.inverse_depth[first::stride, first::stride]
    rows, columns = np.nonzero(inverse > 0)
    depth = 1.0 / inverse[rows, columns].astype(np.float64)
    camera = image.camera
    x = (columns * stride + first - camera.cx) / camera.fx
    y = (rows * stride + first - camera.cy) / camera.fy
    return np.stack([x * depth, y * depth, depth], axis=1)


def _keep_determined(guess: Transform, result: Any) -> tuple[Transform, bool]:
    """Correct a guess only where the registration knows better; tell whether that is everywhere."""
    scale: Float64Array = np.array([1 / LEVER] * 3 + [1.0] * 3)
    information = np.asarray(result.H) * scale[:, None] * scale / max(result.num_inliers, 1)
    values, vectors = np.linalg.eigh(information)
    own = np.maximum(values - EIGENVALUE_OF_PLANES, 0.0)
    gain = own / (own + EIGENVALUE_OF_PRIOR)
    correction = invert_transform(guess) @ np.asarray(result.T_target_source)
    twist = np.concatenate([vector_from_rotation(correction[:3, :3]), correction[:3, 3]]) / scale
    kept = scale * (vectors @ (gain * (vectors.T @ twist)))
    corrected = guess @ transform_from_parts(rotation_from_vector(kept[:3]), kept[3:])
    return corrected, bool(values[0] >= MIN_EIGENVALUE)


def _is_plausible(step: Transform, duration_ns: int) -> bool:
    """Whether a camera can have moved so in the time."""
    seconds = duration_ns * 1e-9
    distance = float(np.linalg.norm(step[:3, 3]))
    # Two hand's breadths and 10 degrees are allowed at any rate: stamps jitter.
    return distance < 0.2 + MAX_SPEED * seconds and _angle(step) < 0.17 + MAX_TURN_RATE * seconds


def _rigid(transform: Transform) -> Transform:
    """Remove rounding errors from a rotation: they double from frame to frame otherwise."""
    left, _, right = np.linalg.svd(transform[:3, :3])
    return transform_from_parts(left @ right, transform[:3, 3])


def _angle(transform: Transform) -> float:
    return float(np.linalg.norm(vector_from_rotation(transform[:3, :3])))
