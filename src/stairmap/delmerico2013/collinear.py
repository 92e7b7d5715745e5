"""Merging of nearly collinear image lines: line 5 of the report's Algorithm 2."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask

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
      the whole line, so that an edge that the Hough transform broke in two becomes one line again. With
      segments, 21 of 40 rendered staircases with Kinect noise were left with fewer than 10 shared
      columns, with whole lines 2. The price: floor on both sides of a stairway can be joined through it;
    * what comes of a merge: all lines that are joined by a chain of such pairs become one, between the
      two of their ends that lie farthest apart along the longest of them. This needs no order of merging.

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
    lengths = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    by_length = np.argsort(lengths, kind="stable")
    longest = np.zeros(len(lines), dtype=np.int64)
    longest[groups[by_length]] = by_length
    along = (lines[:, 2:] - lines[:, :2])[longest[groups]]
    ends = lines.reshape(-1, 2, 2)
    position = np.einsum("ijk,ik->ij", ends, along).ravel()
    group_of_end = np.repeat(groups, 2)
    order = np.lexsort([position, group_of_end])
    change = np.flatnonzero(np.diff(group_of_end[order]))
    starts, stops = np.append(0, change + 1), np.append(change, len(order) - 1)
    flat = ends.reshape(-1, 2)
    merged = np.concatenate([flat[order[starts]], flat[order[stops]]], axis=1)
    swapped = merged[:, 0] > merged[:, 2]
    merged[swapped] = merged[swapped][:, [2, 3, 0, 1]]
    return merged


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
