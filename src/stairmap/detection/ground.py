"""Find the ground a robot stands on in one frame: its plane, and where it was seen.

The frame is sampled along some sixty bearings. The ground is the level surface that the steepest rays meet;
its distance below the camera is the camera's height. What lies where is told by the place at which a ray
crosses the ground's plane: a ray that goes on below proves that no ground is there.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, Vector, readonly
from stairmap.detection.elevation import make_grid
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.orientation import level_axes
from stairmap.geometry import cross, normalized

COLUMN_STEP = 5
"""Every so many columns of the working image are sampled: 15 mm apart at 1 m, 40 mm at 2.5 m."""

MIN_HEIGHT, MAX_HEIGHT = 0.12, 2.2
"""Heights of a camera above its ground, m: from the lowest robots to a camera held overhead."""

MAX_RANGE = 4.0
"""Ground is looked at up to this distance, m: beyond, noise and tilt make heights unsure."""

NEAR_ROWS = 12
"""The ground is looked for in so many measured rows at the steepest end of each bearing."""

HEIGHT_BIN = 0.02
"""Width of a bin of the histogram of heights, m: twice the noise of near ground."""

MIN_SHARE = 0.25
"""Least share of the steepest rays that lie on the ground."""

EXPECTED_TOLERANCE = 0.10
"""A camera's height differs by no more from what is known of it, m: gait, tilt of a body, noise."""

NOISE, NOISE_PER_METRE = 0.025, 0.012
"""A ray is on the ground when it ends within this of its plane, m: the noise of a near one, carpets, joints;
and so much more with each metre, for what the plane is tilted by."""

MAX_TILT = 0.14
"""Slope of the ground against the level by which the frame was sampled: 8 degrees."""

FIT_ROUNDS = 3
"""Rounds of the fit, each with a tighter limit."""

FIT_ROW_STEP, FIT_COLUMN_STEP = 3, 3
"""Every so many rows and columns are fitted: a thousand rays tell three numbers well enough."""

RANGE_BIN, NUM_RANGE_BINS = 0.125, 32
"""What was seen is kept in bins of this length, m: so many reach to 4 m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundView:
    """The ground in one frame.

    Attributes
    ----------
    height
        Height of the camera above the ground's plane, m.
    up, forward
        (3,) normal of the ground, and the viewing direction along the ground, camera frame.
    bearing
        (C,) metres to the left per metre forward of each column, descending.
    is_seen
        (C, 32) whether the ground was seen along a bearing in each eighth of a metre of forward distance.
    """

    height: float
    up: Vector
    forward: Vector
    bearing: Float64Array
    is_seen: Mask

    def __post_init__(self) -> None:
        for name in ("up", "forward", "bearing"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
        object.__setattr__(self, "is_seen", readonly(self.is_seen, np.bool_))

    @property
    def left(self) -> Vector:
        """(3,) unit vector to the left along the ground, camera frame."""
        return cross(self.up, self.forward)


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundSamples:
    """Rays of one frame against the plane of its ground.

    Attributes
    ----------
    view
        The ground.
    crossing
        (R, C) forward distance at which each ray crosses the ground's plane, m, ascending along a column;
        infinite for rays that look up.
    height
        (R, C) height of what each ray met above the plane, m; NaN where nothing was measured.
    """

    view: GroundView
    crossing: Float32Array
    height: Float32Array

    @property
    def is_on_ground(self) -> Mask:
        """(R, C) which rays end on the ground."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.abs(self.height) < ground_tolerance(self.crossing))


def ground_tolerance(distance: Float32Array) -> Float32Array:
    """How far from its plane the ground may seem to lie at a distance, m."""
    return np.asarray(NOISE + NOISE_PER_METRE * np.minimum(distance, MAX_RANGE), dtype=np.float32)


def sample_ground(
    image: InverseDepthImage, up: Vector, *, camera_height: float | None = None
) -> GroundSamples | None:
    """Return the rays of a frame against its ground; ``None`` where no ground is in view.

    Parameters
    ----------
    image
        Inverse depth.
    up
        (3,) normal of level ground, camera frame.
    camera_height
        What is known of the camera's height, m; only ground at that height counts then.
    """
    forward, _ = level_axes(up)
    grid = make_grid(image, up, forward)
    if grid is None:
        return None
    slope = grid.slope.astype(np.float32)
    slope = slope[slope < 0.0]
    bearing = grid.bearing[COLUMN_STEP // 2 :: COLUMN_STEP].astype(np.float32)
    if not len(slope) or not len(bearing):
        return None
    inverse = _sample_nearest(image, (up, forward), slope, bearing)
    valid = inverse > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(valid, 1.0 / inverse, np.float32(np.nan))
    height = slope[:, None] * distance
    first = _find_height(height, valid, camera_height)
    if first is None:
        return None
    plane = _fit_plane(distance, height, bearing, first)
    if plane is None or not MIN_HEIGHT <= plane[2] <= MAX_HEIGHT:
        return None
    if camera_height is not None and abs(plane[2] - camera_height) > EXPECTED_TOLERANCE:
        return None
    return _against_plane((distance, height), (slope, bearing), plane, (up, forward))


def _sample_nearest(
    image: InverseDepthImage, axes: tuple[Vector, Vector], slope: Float32Array, bearing: Float32Array
) -> Float32Array:
    """(R, C) inverse forward distance of the pixel nearest to each ray, 1/m; 0 where none is."""
    up, forward = (axis.astype(np.float32) for axis in axes)
    left = cross(*axes).astype(np.float32)
    camera = image.camera
    fx, fy, cx, cy = (np.float32(value) for value in (camera.fx, camera.fy, camera.cx, camera.cy))
    column = forward[:, None] + np.outer(left, bearing)
    row = np.outer(up, slope)
    depth = row[2][:, None] + column[2]
    inverse = 1.0 / np.maximum(depth, np.float32(1e-3))
    map_u = (row[0][:, None] + column[0]) * inverse * fx + cx
    map_v = (row[1][:, None] + column[1]) * inverse * fy + cy
    sampled = cv2.remap(image.inverse_depth, map_u, map_v, cv2.INTER_NEAREST, borderValue=0)
    return np.asarray(np.where(depth > np.float32(1e-3), sampled * depth, np.float32(0)))


def _find_height(height: Float32Array, valid: Mask, camera_height: float | None) -> float | None:
    """Height of the camera above the level surface that the steepest rays meet, m."""
    steepest = valid & (np.cumsum(valid, axis=0) <= NEAR_ROWS)
    below = -height[steepest]
    if not len(below):
        return None
    if camera_height is None:
        inside = below[(below > MIN_HEIGHT) & (below < MAX_HEIGHT)]
    else:
        inside = below[np.abs(below - camera_height) < EXPECTED_TOLERANCE]
    if len(inside) < MIN_SHARE * len(below) and (camera_height is None or len(inside) < NEAR_ROWS):
        return None
    counts = np.bincount((inside / HEIGHT_BIN).astype(np.int64), minlength=3)
    smooth = counts[:-2] + counts[1:-1] + counts[2:]
    best = int(np.argmax(smooth)) + 1
    near = inside[np.abs(inside - (best + 0.5) * HEIGHT_BIN) < 1.5 * HEIGHT_BIN]
    if camera_height is None and len(near) < MIN_SHARE * len(below):
        return None
    return float(np.median(near))


def _fit_plane(
    distance: Float32Array, height: Float32Array, bearing: Float32Array, first: float
) -> Float64Array | None:
    """(3,) slope along, slope across and height of the camera of the ground's plane.

    Heights are fitted over forward and lateral distance with the weight of a metre's distance: near ground
    tells the height, far ground the tilt. Each round counts rays nearer to the plane of the last one.
    """
    plane = np.array([0.0, 0.0, first])
    distance, height = (values[::FIT_ROW_STEP, ::FIT_COLUMN_STEP] for values in (distance, height))
    bearing = bearing[::FIT_COLUMN_STEP]
    with np.errstate(invalid="ignore"):
        rows, columns = np.nonzero((distance < MAX_RANGE) & (np.abs(height + first) < 0.08 + 0.05 * distance))
    s = distance[rows, columns].astype(np.float64)
    z = height[rows, columns].astype(np.float64)
    design = np.stack([s, s * bearing[columns], -np.ones_like(s)], axis=1)
    for limit in np.linspace(0.08, NOISE, FIT_ROUNDS):
        near = np.abs(z - design @ plane) < limit + NOISE_PER_METRE * s
        if np.count_nonzero(near) < NEAR_ROWS:
            return None
        weighted = design[near] / np.maximum(s[near], 0.3)[:, None] ** 2
        # A little of the level plane keeps what few rays leave open.
        information = weighted.T @ design[near] + np.diag([5.0, 5.0, 0.0])
        plane = np.linalg.solve(information, weighted.T @ z[near])
    return plane if np.hypot(plane[0], plane[1]) < MAX_TILT else None


def _against_plane(
    met: tuple[Float32Array, Float32Array],
    rays: tuple[Float32Array, Float32Array],
    plane: Float64Array,
    axes: tuple[Vector, Vector],
) -> GroundSamples:
    """Express all rays against the ground's plane, whose normal becomes the new up."""
    (distance, height), (slope, bearing), (up, forward) = met, rays, axes
    along, across, below = (np.float32(value) for value in plane)
    left = cross(up, forward)
    normal = normalized(up - plane[0] * forward - plane[1] * left)
    lean = np.float32(normal @ up)
    fall = along + across * bearing[None, :] - slope[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.where(fall > 1e-6, below / fall, np.float32(np.inf))
        above = (height + below - distance * (along + across * bearing[None, :])) * lean
        seen = (np.abs(above) < ground_tolerance(crossing)) & (crossing < NUM_RANGE_BINS * RANGE_BIN)
    is_seen = np.zeros((len(bearing), NUM_RANGE_BINS), dtype=np.bool_)
    rows, columns = np.nonzero(seen)
    is_seen[columns, (crossing[rows, columns] / RANGE_BIN).astype(np.int64)] = True
    level_forward = normalized(forward - (forward @ normal) * normal)
    view = GroundView(
        height=float(below * lean),
        up=normal,
        forward=level_forward,
        bearing=bearing.astype(np.float64),
        is_seen=is_seen,
    )
    return GroundSamples(view=view, crossing=crossing, height=above)
