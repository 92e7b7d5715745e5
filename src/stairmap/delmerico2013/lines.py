"""Lines of depth discontinuity in one image: lines 2 to 4 and 6 to 10 of the report's Algorithm 2.

All coordinates are pixels (u to the right, v down) of an image about 320 columns wide,
the size that the report's thresholds are for. A line is a row (u0, v0, u1, v1) with
``u0 <= u1``. No function here loops over pixels or lines.
"""

from __future__ import annotations

from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import DepthImage, Float64Array, IntArray

GreyImage: TypeAlias = NDArray[np.uint8]
"""(height, width) uint8."""

GREY_RANGE = 5.0
"""Depth in metres that becomes 255; see ``grey_from_depth``."""

CANNY_THRESHOLDS = (30.0, 40.0)
CANNY_KERNEL = 3
HOUGH_DISTANCE = 1.0
HOUGH_ANGLE = np.pi / 180
HOUGH_THRESHOLD = 20
HOUGH_MIN_LENGTH = 20
HOUGH_MAX_GAP = 5
ANGLE_BIN_DEG = 10.0
ANGLE_MARGIN_DEG = 5.0


def grey_from_depth(depth: DepthImage) -> GreyImage:
    """Turn depth into the 8-bit image that Canny's thresholds are for.

    The report gives thresholds but no scale. Here 0 to 5 m, the range of its sensor,
    become 0 to 255: a Canny threshold of 40 is a jump of 10 grey levels or 0.20 m, just
    less than the run of any step, so it finds nosings and skips noise. (With 10 m it
    would be 0.39 m and miss most steps.) The scale is the same for all images, other than one from each
    image's own maximum, so that the thresholds keep their meaning in metres.

    Parameters
    ----------
    depth
        (height, width) in metres, 0 where nothing was measured.

    Returns
    -------
    Grey levels; 0 stays 0, and what is farther than 5 m becomes 255.
    """
    return np.asarray(cv2.convertScaleAbs(depth, alpha=255.0 / GREY_RANGE), dtype=np.uint8)


def extract_edges(grey: GreyImage) -> GreyImage:
    """Find discontinuities with the Canny operator (line 2); edge pixels are 255, others 0."""
    edges = cv2.Canny(grey, *CANNY_THRESHOLDS, apertureSize=CANNY_KERNEL)
    return np.asarray(edges, dtype=np.uint8)


def remove_edges_at_invalid_depth(edges: GreyImage, grey: GreyImage) -> GreyImage:
    """Set edge pixels to zero that border a depth of 0 among their 8 neighbours (line 3)."""
    smallest_around = cv2.erode(grey, np.ones((3, 3), dtype=np.uint8))
    _, valid = cv2.threshold(smallest_around, 0, 255, cv2.THRESH_BINARY)
    return np.asarray(cv2.bitwise_and(edges, valid), dtype=np.uint8)


def find_candidate_lines(edges: GreyImage) -> Float64Array:
    """Find line segments with the probabilistic Hough transform (line 4).

    OpenCV seeds the transform's random generator anew in every call, so equal images give equal
    lines and no global seed is touched.

    Returns
    -------
    (N, 4) lines, from left to right.
    """
    found = cv2.HoughLinesP(
        edges,
        HOUGH_DISTANCE,
        HOUGH_ANGLE,
        HOUGH_THRESHOLD,
        minLineLength=HOUGH_MIN_LENGTH,
        maxLineGap=HOUGH_MAX_GAP,
    )
    if found is None:
        return np.empty((0, 4))
    return left_to_right(np.asarray(found, dtype=np.float64).reshape(-1, 4))


def left_to_right(lines: Float64Array) -> Float64Array:
    """Return (N, 4) lines with their left end first, and the upper one of vertical lines."""
    swapped = (lines[:, 0] > lines[:, 2]) | ((lines[:, 0] == lines[:, 2]) & (lines[:, 1] > lines[:, 3]))
    return np.asarray(np.where(swapped[:, None], lines[:, [2, 3, 0, 1]], lines))


def select_dominant_slope(lines: Float64Array) -> Float64Array:
    """Keep the lines whose slope falls into the fullest bin of 10 degrees, or 5 degrees beside it (line 6).

    The report does not say where bins begin. Here one is centred on the horizontal, so that the level
    edges of stairs seen from the front fall into one bin; of equally full bins the one
    nearest to the horizontal, from rising-to-the-right downward, wins.
    """
    if len(lines) == 0:
        return lines
    angles = np.degrees(np.arctan2(lines[:, 3] - lines[:, 1], lines[:, 2] - lines[:, 0]))
    num_bins = round(180 / ANGLE_BIN_DEG)
    bins = np.round(angles / ANGLE_BIN_DEG).astype(np.int64) % num_bins
    counts = np.bincount(bins, minlength=num_bins)
    from_horizontal = np.minimum(np.arange(num_bins), num_bins - np.arange(num_bins))
    fullest = int(np.lexsort([from_horizontal, -counts])[0])
    difference = (angles - fullest * ANGLE_BIN_DEG + 90) % 180 - 90
    return lines[np.abs(difference) <= ANGLE_BIN_DEG / 2 + ANGLE_MARGIN_DEG]


def find_shared_columns(lines: Float64Array, width: int) -> tuple[int, int] | None:
    """Find the widest run of columns that the largest number of lines pass through (lines 7 and 8).

    The report's text asks for the widest rectangle with the maximum in all of its columns, its
    Algorithm 2 for the first and the last column with the maximum. They differ when the maximum is reached
    in several places; the text is followed.

    Returns
    -------
    First and last column; ``None`` without lines.
    """
    if len(lines) == 0:
        return None
    columns = np.clip(np.round(lines[:, [0, 2]]).astype(np.int64), 0, width - 1)
    change = np.bincount(columns[:, 0], minlength=width + 1) - np.bincount(
        columns[:, 1] + 1, minlength=width + 1
    )
    counts = np.cumsum(change)[:width]
    full = np.flatnonzero(counts == counts.max())
    gaps = np.flatnonzero(np.diff(full) > 1)
    first, last = full[np.append(0, gaps + 1)], full[np.append(gaps, len(full) - 1)]
    widest = int(np.argmax(last - first))
    return int(first[widest]), int(last[widest])


def clip_lines_to_columns(lines: Float64Array, left: int, right: int) -> Float64Array:
    """Keep what lies between two columns, both included (lines 9 and 10).

    Upper and lower bounds of the report's box come from the lines themselves, so only columns remove lines.
    """
    lines = lines[(lines[:, 0] <= right) & (lines[:, 2] >= left)]
    span = np.maximum(lines[:, 2] - lines[:, 0], 1e-9)
    slope = (lines[:, 3] - lines[:, 1]) / span
    start, stop = np.maximum(lines[:, 0], left), np.minimum(lines[:, 2], right)
    # A vertical line has no slope to clip by and keeps its rows.
    vertical = lines[:, 0] == lines[:, 2]
    clipped = np.stack(
        [
            start,
            lines[:, 1] + slope * (start - lines[:, 0]),
            stop,
            lines[:, 1] + slope * (stop - lines[:, 0]),
        ],
        axis=1,
    )
    return np.asarray(np.where(vertical[:, None], lines, clipped))


def pixels_on_lines(lines: Float64Array) -> tuple[IntArray, IntArray]:
    """Draw (N, 4) lines with one pixel per step along the longer axis.

    Returns
    -------
    (K, 2) pixels (u, v), line by line, and (K,) indices of their lines.
    """
    delta = lines[:, 2:] - lines[:, :2]
    counts = np.round(np.abs(delta).max(axis=1, initial=0)).astype(np.int64) + 1
    line_index = np.repeat(np.arange(len(lines)), counts)
    number = np.arange(len(line_index)) - np.repeat(np.cumsum(counts) - counts, counts)
    fraction = number / np.maximum(counts - 1, 1)[line_index]
    pixels = lines[line_index, :2] + fraction[:, None] * delta[line_index]
    return np.round(pixels).astype(np.int64), line_index
