"""Resample a frame into its side elevation along one heading.

With a heading and up, a ray is told by two numbers: its slope tau = z / s, height gained per metre forward,
and its bearing lambda = t / s, metres to the left per metre forward. All of a step that is seen under one
slope has one forward distance s, wherever it lies across the step. So the image is resampled to a grid whose
rows have equal slope and whose columns have equal bearing, however the camera is rolled about its axis. A
column is then a scan in an upright plane. It holds the inverse forward distance Q = 1/s, in which every flat
surface is a straight line in tau.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from stairmap.arrays import Float32Array, Float64Array, Mask, Vector
from stairmap.detection.inverse_depth import InverseDepthImage
from stairmap.geometry import cross, normalized
from stairmap.kernels import sample_rays, sample_strips, sharpen_scans
from stairmap.kernels.sampling import SamplingView, StripMeans

STRIP_WIDTH = 16
"""Columns of a strip, working pixels: wide enough to average noise, narrow against a stairway."""

COLUMN_STEP = 2
"""Each N-th column is sampled: eight of a strip's sixteen tell its mean well enough."""

MIN_FORWARD = 0.15
"""Rays with a smaller forward component (more than 81 degrees off the heading) are not used."""

MIN_ROWS = 20
"""Fewest rows of an elevation."""

SAME_SURFACE = 0.03
"""Neighbouring pixels whose inverse depths differ by less than this share may be interpolated."""

SHARPENING_ROUNDS = 10
"""Rounds in which the smoothing of a sensor is undone: of waves as long as three of its standard deviations
three quarters come back, of shorter ones less, so that noise does not grow out of bounds."""

MIN_SHARPENED_SHARE = 0.9
"""Share of the measurements about a cell that must be there to sharpen it."""

STRIP_SPREAD = 0.04
"""Samples of a strip within this share of their median are averaged."""

MIN_VALID_PART, MIN_NEAR_PART = 2, 3
"""... where one in N of them is measured, and one in N (the second number) is near the median."""

LEAST_DEPTH = 1e-3
"""Rays with less depth for each metre forward look aside of the camera, m per m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ElevationGrid:
    """Where the rows and columns of an elevation lie.

    Attributes
    ----------
    up, forward, left
        (3,) axes of the elevation, camera frame.
    slope
        (R,) slope tau of each row, ascending.
    bearing
        (C,) bearing lambda of each column, descending: the first column lies farthest left.
    row_size
        Mean slope between rows.
    edge_shift
        How many rows the reduced image moved the edges of near surfaces outward on average.
    """

    up: Vector
    forward: Vector
    left: Vector
    slope: Float64Array
    bearing: Float64Array
    row_size: float
    edge_shift: float

    @property
    def axes(self) -> Float64Array:
        """(3, 3) rows forward, up and left, as kernels take them."""
        return np.array([self.forward, self.up, self.left])


@dataclass(frozen=True, slots=True, kw_only=True)
class Elevation:
    """The scans of a frame along one heading, averaged over strips of columns.

    Attributes
    ----------
    grid
        Rows and columns of single pixels.
    bearing
        (S,) bearing of the middle of each strip.
    inverse_distance
        (R, S) float64 inverse forward distance Q, 1/m, 0 where nothing was measured.
    """

    grid: ElevationGrid
    bearing: Float64Array
    inverse_distance: Float64Array

    @property
    def slope(self) -> Float64Array:
        """(R,) slope tau of each row, ascending."""
        return self.grid.slope


def make_grid(image: InverseDepthImage, up: Vector, forward: Vector) -> ElevationGrid | None:
    """Lay rows of equal slope and columns of equal bearing over an image.

    Parameters
    ----------
    image
        Inverse depth.
    up, forward
        (3,) perpendicular unit vectors, camera frame.

    Returns
    -------
    The grid, or ``None`` when the image does not look along the heading at all. Rows and columns are those of
    a camera turned about its axis until it stands upright, so they are as fine as the image.
    """
    camera = image.camera
    right, down = _upright_axes(up)
    (right_x, right_y, _), (down_x, down_y, _) = right.tolist(), down.tolist()
    corners = [
        ((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy)
        for x in (0, camera.width - 1)
        for y in (0, camera.height - 1)
    ]
    across = [x * right_x + y * right_y for x, y in corners]
    along = [x * down_x + y * down_y for x, y in corners]
    num_columns = round((max(across) - min(across)) * camera.fx) + 1
    num_rows = round((max(along) - min(along)) * camera.fy) + 1
    x, y = _spaced(min(across), max(across), num_columns), _spaced(max(along), min(along), num_rows)
    left = cross(up, forward)
    # What a step to the right, or down, in the upright image adds along each axis.
    axes = np.array([forward, left, up])
    (ahead_x, ahead_y), (left_x, left_y), (up_x, up_y) = (axes @ np.array([right, down]).T).tolist()
    forward_z, left_z, up_z = axes[:, 2].tolist()
    # The rows' slopes are those of the column that looks most nearly along the heading.
    middle = float(x[-1 if ahead_x > 0 else 0])
    middle = min(max(middle, float(x[num_columns // 4])), float(x[3 * num_columns // 4]))
    ahead = (middle * ahead_x + forward_z) + ahead_y * y
    usable = ahead > MIN_FORWARD
    if np.count_nonzero(usable) < MIN_ROWS:
        return None
    slope = (((middle * up_x + up_z) + up_y * y) / ahead)[usable]
    center = 0.5 * float(y[0] + y[-1])
    ahead = (center * ahead_y + forward_z) + ahead_x * x
    visible = ahead > MIN_FORWARD
    if np.count_nonzero(visible) < STRIP_WIDTH:
        return None
    bearing = (((center * left_y + left_z) + left_x * x) / ahead)[visible]
    return ElevationGrid(
        up=up,
        forward=forward,
        left=left,
        slope=slope,
        bearing=bearing,
        row_size=float(slope[-1] - slope[0]) / (len(slope) - 1),
        # A block of pixels shows its nearest surface, however little of it is that.
        edge_shift=0.5 * (image.stride - 1) / image.stride,
    )


def sample_grid(
    image: InverseDepthImage, grid: ElevationGrid, slope: Float64Array, bearing: Float64Array
) -> Float32Array:
    """Return the (R, N) inverse forward distance, 1/m, of (R,) slopes and (N,) bearings; 0 where none is.

    Between pixels of one surface it is interpolated, which is exact on planes; elsewhere the nearest counts.
    """
    slope, bearing = np.ascontiguousarray(slope), np.ascontiguousarray(bearing)
    return sample_rays(image.inverse_depth, grid.axes, slope, bearing, _view_of(image))


def _view_of(image: InverseDepthImage) -> SamplingView:
    camera = image.camera
    return SamplingView(camera.fx, camera.fy, camera.cx, camera.cy, SAME_SURFACE, LEAST_DEPTH)


def make_elevation(image: InverseDepthImage, up: Vector, forward: Vector) -> Elevation | None:
    """Resample an image into side elevations along a heading; ``None`` when it does not look along it.

    Parameters
    ----------
    image
        Inverse depth.
    up, forward
        (3,) perpendicular unit vectors, camera frame.
    """
    grid = make_grid(image, up, forward)
    if grid is None:
        return None
    first, num_strips = _first_column(len(grid.bearing)), len(grid.bearing) // STRIP_WIDTH
    inside = grid.bearing[first : first + num_strips * STRIP_WIDTH]
    q = sample_strips(
        image.inverse_depth,
        grid.axes,
        grid.slope,
        np.ascontiguousarray(inside[::COLUMN_STEP]),
        _view_of(image),
        _STRIP_MEANS,
    )
    middle = inside.reshape(num_strips, STRIP_WIDTH).sum(axis=1) / STRIP_WIDTH
    return Elevation(grid=grid, bearing=middle, inverse_distance=q)


_NUM_SAMPLES = STRIP_WIDTH // COLUMN_STEP
_STRIP_MEANS = StripMeans(
    _NUM_SAMPLES,
    STRIP_SPREAD,
    min_valid=-(-_NUM_SAMPLES // MIN_VALID_PART),
    min_near=-(-_NUM_SAMPLES // MIN_NEAR_PART),
)


def sharpened(elevation: Elevation, smoothing: float) -> Elevation:
    """Undo a part of what a sensor smooths along the scans.

    The scans are smoothed again, compared with what was measured, and the difference is added, a few times
    over (van Cittert). Edges of treads that the sensor blended become corners; only their places may be used,
    for noise grows as well.

    Parameters
    ----------
    elevation
        The scans.
    smoothing
        Standard deviation over which the sensor blends, rows.
    """
    size = 2 * int(np.ceil(3.0 * smoothing)) + 1
    kernel = np.asarray(cv2.getGaussianKernel(size, smoothing, cv2.CV_32F)[:, 0], dtype=np.float32)
    scans = sharpen_scans(elevation.inverse_distance, kernel, SHARPENING_ROUNDS, MIN_SHARPENED_SHARE)
    return replace(elevation, inverse_distance=scans)


def strip_columns(num_columns: int, strips: Mask, *, margin: int) -> tuple[int, int]:
    """Return the first column and one past the last of the given strips and ``margin`` more on each side."""
    chosen = np.flatnonzero(strips)
    offset = _first_column(num_columns)
    first = offset + (int(chosen[0]) - margin) * STRIP_WIDTH
    last = offset + (int(chosen[-1]) + 1 + margin) * STRIP_WIDTH
    return max(first, 0), min(last, num_columns)


def _spaced(first: float, last: float, number: int) -> Float64Array:
    """Evenly spaced numbers, as ``numpy.linspace`` at a tenth of its cost."""
    spacing = (last - first) / max(number - 1, 1)
    return np.asarray(first + spacing * np.arange(number))


def _upright_axes(up: Vector) -> tuple[Vector, Vector]:
    """The camera's x and y axes turned about its optical axis until y points downward."""
    down = np.array([-up[0], -up[1], 0.0])
    # Looking straight up or down, every turn is as upright as any.
    down = normalized(down) if math.hypot(down[0], down[1]) > 0.05 else np.array([0.0, 1.0, 0.0])
    return np.array([down[1], -down[0], 0.0]), down


def _first_column(num_columns: int) -> int:
    """Column where strip 0 begins: the strips are centred."""
    return (num_columns - num_columns // STRIP_WIDTH * STRIP_WIDTH) // 2
