"""Merging of nearly collinear image lines: line 5 of the report's Algorithm 2."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.delmerico2013.lines import left_to_right

MERGE_SLOPE = 0.25
MERGE_INTERCEPT = 10.0
MERGE_PIXELS = 10.0
MERGE_DISTANCE = 5.0


def merge_collinear_lines(lines: Float64Array) -> Float64Array:
    """Merge nearly collinear lines (line 5).

    Two lines are merged when their slopes differ by less than 0.25, their intercepts by less than
    10 px, and at least 10 px of one lie within 5 px of the other. The report leaves open:

    * lines that are nearly vertical, whose slope and intercept have no bounds: where both lines are
      steeper than 45 degrees, columns and rows change places;
    * whether "the other" is a segment or the whole line that the report's y = m x + b describes:
      the whole line, so that an edge that the Hough transform broke in two becomes one line again. On
      400 rendered frames with Kinect noise this gives 384 detections, distance to the segment 272,
      because too few columns are shared. The price: floor lines on both sides of a stairway are joined
      through it (mean error of the modeled run 11 mm instead of 4 mm);
    * what comes of a merge: all lines that are joined by a chain of such pairs become the line of least
      squares through their pixels, as long as they reach along it. This needs no order of merging.

    Parameters
    ----------
    lines
        (N, 4) lines.

    Returns
    -------
    (M, 4) lines, M at most N, in the order of each one's first member.
    """
    if len(lines) < 2:
        return lines
    groups = _smallest_connected_index(_mergeable(lines))
    _, groups = np.unique(groups, return_inverse=True)
    return left_to_right(_lines_through(lines, groups))


def _lines_through(lines: Float64Array, groups: IntArray) -> Float64Array:
    """(M, 4) lines of least squares through the lines of each of M groups, as far as they reach.

    A segment weighs as its pixels do: by its length, and with the variance of evenly spread pixels.
    """
    ends = lines.reshape(-1, 2, 2)
    delta, middles = ends[:, 1] - ends[:, 0], ends.mean(axis=1)
    weights = np.hypot(delta[:, 0], delta[:, 1]) + 1
    totals = np.bincount(groups, weights)
    centers = np.stack([np.bincount(groups, weights * axis) for axis in middles.T], axis=1) / totals[:, None]
    offsets = middles - centers[groups]
    squares = [
        np.bincount(groups, weights * (offsets[:, i] * offsets[:, j] + delta[:, i] * delta[:, j] / 12))
        for i, j in ((0, 0), (0, 1), (1, 1))
    ]
    angles = np.arctan2(2 * squares[1], squares[0] - squares[2]) / 2
    along = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    positions = np.einsum("ijk,ik->ij", ends - centers[groups, None], along[groups])
    first, last = np.full(len(totals), np.inf), np.full(len(totals), -np.inf)
    np.minimum.at(first, groups, positions.min(axis=1))
    np.maximum.at(last, groups, positions.max(axis=1))
    return np.concatenate([centers + first[:, None] * along, centers + last[:, None] * along], axis=1)


def _mergeable(lines: Float64Array) -> Mask:
    """(N, N) symmetric mask of the pairs of lines that the report merges."""
    delta = lines[:, 2:] - lines[:, :2]
    steep = np.abs(delta[:, 1]) > np.abs(delta[:, 0])
    similar = _similar_slope_and_intercept(lines)
    if steep.any():
        both_steep = steep[:, None] & steep
        similar = np.where(both_steep, _similar_slope_and_intercept(lines[:, [1, 0, 3, 2]]), similar)
    # Distances are needed only for the few pairs that are left.
    one, other = np.nonzero(similar)
    num_near = _num_pixels_near(lines[one], lines[other])
    mergeable = np.zeros_like(similar)
    mergeable[one, other] = num_near >= MERGE_PIXELS
    return np.asarray(mergeable | mergeable.T)


def _similar_slope_and_intercept(lines: Float64Array) -> Mask:
    """(N, N) mask of the pairs of lines with similar slope and intercept."""
    span = lines[:, 2] - lines[:, 0]
    slopes = (lines[:, 3] - lines[:, 1]) / np.where(span == 0, 1e-9, span)
    intercepts = lines[:, 1] - slopes * lines[:, 0]
    return np.asarray(
        (np.abs(slopes[:, None] - slopes) < MERGE_SLOPE)
        & (np.abs(intercepts[:, None] - intercepts) < MERGE_INTERCEPT)
    )


def _num_pixels_near(segments: Float64Array, lines: Float64Array) -> Float64Array:
    """(P,) number of pixels of each segment that lie near the line in the same row, ends extended.

    Distances to a line change linearly along a segment, so the part of it that is near follows from its ends.
    """
    along = lines[:, 2:] - lines[:, :2]
    ends = segments.reshape(-1, 2, 2) - lines[:, None, :2]
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)
    distances = (ends[..., 1] * along[:, :1] - ends[..., 0] * along[:, 1:]) / length[:, None]
    low, high = np.minimum(distances[:, 0], distances[:, 1]), np.maximum(distances[:, 0], distances[:, 1])
    overlap = np.minimum(high, MERGE_DISTANCE) - np.maximum(low, -MERGE_DISTANCE)
    # A segment parallel to the line has no extent across it: all of it is near, or nothing.
    extent = high - low
    fraction = np.where(
        extent > 1e-9, np.maximum(overlap, 0.0) / np.maximum(extent, 1e-9), np.where(overlap >= 0, 1.0, 0.0)
    )
    size = np.abs(segments[:, 2:] - segments[:, :2]).max(axis=1, initial=0.0) + 1
    return np.asarray(np.minimum(fraction, 1.0) * size)


def _smallest_connected_index(linked: Mask) -> IntArray:
    """(N,) smallest index that each of N items is connected with, through any chain of links."""
    smallest = np.arange(len(linked))
    while True:
        spread = np.where(linked | np.eye(len(linked), dtype=np.bool_), smallest, len(linked)).min(axis=1)
        if np.array_equal(spread, smallest):
            return smallest
        smallest = spread
