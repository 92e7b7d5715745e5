"""Find the ground a robot stands on in one frame: its plane, and where it was seen.

The frame is sampled along some sixty bearings. The ground is the level surface that the steepest rays meet;
its distance below the camera is the camera's height. What lies where is told by the place at which a ray
crosses the ground's plane: a ray that goes on below proves that no ground is there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, Vector, readonly
from stairmap.detection.elevation import make_grid
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.detection.orientation import level_axes
from stairmap.geometry import cross, normalized
from stairmap.kernels import fit_ground
from stairmap.kernels.grounds import GroundCamera, GroundLimits

COLUMN_STEP = 5
"""Each N-th column of the working image is sampled: 15 mm apart at 1 m, 40 mm at 2.5 m."""

MIN_HEIGHT, MAX_HEIGHT = 0.12, 2.2
"""Heights of a camera above its ground, m: from the lowest robots to a camera held overhead."""

MAX_RANGE = 4.0
"""Ground is looked at up to this distance, m: beyond, noise and tilt make heights unsure."""

NEAR_ROWS = 12
"""The ground is looked for in this many measured rows at the steepest end of each bearing."""

HEIGHT_BIN = 0.02
"""Width of a bin of the histogram of heights, m: twice the noise of near ground."""

MIN_SHARE = 0.25
"""Least share of the steepest rays that lie on the ground."""

EXPECTED_TOLERANCE = 0.10
"""A camera's height differs by no more from what is known of it, m: gait, tilt of a body, noise."""

NOISE, NOISE_PER_METRE = 0.025, 0.012
"""A ray is on the ground when it ends within this of its plane, m: the noise of a near one, carpets, joints;
and this much more with each metre, for what the plane is tilted by."""

MAX_TILT = 0.14
"""Slope of the ground against the level by which the frame was sampled: 8 degrees."""

REACH_GROWTH = 1.5
"""The fit reaches this many times as far in each round, from the nearest ground on: what lies lower behind an
edge has then no part in it."""

FIT_ROW_STEP, FIT_COLUMN_STEP = 3, 3
"""Each N-th row and column is fitted: a thousand rays tell three numbers well enough."""

FIRST_LIMIT, FIRST_LIMIT_PER_METRE = 0.08, 0.05
"""Rays within this of the level at the height found may be fitted, m, and this much more per metre."""

STEADINESS = 5.0
"""Weight of a level plane against the rays': that of five at a metre."""

LEAST_DISTANCE = 0.3
"""Nearer rays weigh no more than one at this distance, m."""

LEAST_DEPTH = 1e-3
"""Rays with less depth for each metre forward look aside of the camera, m per m."""

RANGE_BIN, NUM_RANGE_BINS = 0.125, 32
"""What was seen is kept in bins of this length, m: this many reach to 4 m."""


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
    slope = np.ascontiguousarray(grid.slope[grid.slope < 0.0])
    bearing = np.ascontiguousarray(grid.bearing[COLUMN_STEP // 2 :: COLUMN_STEP])
    if not len(slope):
        return None
    camera = GroundCamera(image.camera.fx, image.camera.fy, image.camera.cx, image.camera.cy, LEAST_DEPTH)
    plane, crossing, height, is_seen = fit_ground(
        image.inverse_depth, grid.axes, slope, bearing, camera, _limits(camera_height)
    )
    if not len(plane) or np.hypot(plane[0], plane[1]) >= MAX_TILT:
        return None
    if not MIN_HEIGHT <= plane[2] <= MAX_HEIGHT:
        return None
    if camera_height is not None and abs(plane[2] - camera_height) > EXPECTED_TOLERANCE:
        return None
    normal = normalized(up - plane[0] * forward - plane[1] * grid.left)
    view = GroundView(
        height=float(plane[2] * (normal @ up)),
        up=normal,
        forward=normalized(forward - (forward @ normal) * normal),
        bearing=bearing,
        is_seen=is_seen,
    )
    return GroundSamples(view=view, crossing=crossing, height=height)


def _limits(camera_height: float | None) -> GroundLimits:
    """What the ground may be, for a camera's height of which something is known or nothing."""
    low, high = MIN_HEIGHT, MAX_HEIGHT
    if camera_height is not None:
        low, high = max(camera_height - EXPECTED_TOLERANCE, 0.0), camera_height + EXPECTED_TOLERANCE
    return GroundLimits(
        low=low,
        high=high,
        height_bin=HEIGHT_BIN,
        near_rows=NEAR_ROWS,
        is_known=camera_height is not None,
        min_share=MIN_SHARE,
        row_step=FIT_ROW_STEP,
        column_step=FIT_COLUMN_STEP,
        max_range=MAX_RANGE,
        reach_growth=REACH_GROWTH,
        first_limit=FIRST_LIMIT,
        first_per_metre=FIRST_LIMIT_PER_METRE,
        noise=NOISE,
        noise_per_metre=NOISE_PER_METRE,
        steadiness=STEADINESS,
        least_distance=LEAST_DISTANCE,
        num_bins=NUM_RANGE_BINS,
        range_bin=RANGE_BIN,
    )
