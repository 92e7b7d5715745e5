from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.delmerico2013.lines import (
    clip_lines_to_columns,
    extract_edges,
    find_candidate_lines,
    find_shared_columns,
    grey_from_depth,
    pixels_on_lines,
    remove_edges_at_invalid_depth,
    select_dominant_slope,
)
from value_strategies import no_deadline

SPANS = st.lists(st.tuples(st.integers(0, 39), st.integers(0, 39)).map(sorted), min_size=1, max_size=8)


def step_image(near: float, far: float) -> np.ndarray:
    """Depth that jumps from far above to near below at row 60."""
    depth = np.full((120, 160), far, dtype=np.float32)
    depth[60:] = near
    return depth


def at_angle(degrees: float, v: float = 100.0) -> list[float]:
    """Line of 60 px through (100, v)."""
    du, dv = 30 * np.cos(np.radians(degrees)), 30 * np.sin(np.radians(degrees))
    return [100 - du, v - dv, 100 + du, v + dv]


def test_depth_of_0_to_5_m_becomes_0_to_255_and_stays_255_beyond() -> None:
    grey = grey_from_depth(np.array([[0.0, 1.0, 2.5, 5.0, 8.0]], dtype=np.float32))
    assert grey.dtype == np.uint8
    assert grey.tolist() == [[0, 51, 128, 255, 255]]


@pytest.mark.parametrize(("jump", "seen"), [(0.25, True), (0.15, False)])
def test_jump_of_a_run_is_an_edge_and_one_below_20_cm_is_none(jump: float, seen: bool) -> None:
    assert extract_edges(grey_from_depth(step_image(2.0, 2.0 + jump))).any() == seen


def test_edges_beside_unmeasured_pixels_are_removed_and_no_others() -> None:
    depth = step_image(2.0, 3.0)
    depth[57:64, 50:54] = 0.0
    grey = grey_from_depth(depth)
    edges = extract_edges(grey)
    kept = remove_edges_at_invalid_depth(edges, grey)
    beside = cv2.dilate((depth == 0).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert edges[beside].any()
    assert not kept[beside].any()
    np.testing.assert_array_equal(kept[~beside], edges[~beside])


def test_edge_is_found_as_one_line_from_left_to_right() -> None:
    lines = find_candidate_lines(extract_edges(grey_from_depth(step_image(2.0, 3.0))))
    assert len(lines) == 1
    u0, v0, u1, v1 = lines[0]
    assert u0 <= 2
    assert u1 >= 157
    assert abs(v0 - 60) <= 1
    assert abs(v1 - 60) <= 1


def test_edges_shorter_than_20_px_give_no_line() -> None:
    edges = np.zeros((50, 50), dtype=np.uint8)
    edges[20, 10:27] = 255
    assert find_candidate_lines(edges).shape == (0, 4)


def test_lines_do_not_depend_on_the_state_of_opencvs_random_generator() -> None:
    edges = (np.random.default_rng(0).random((240, 320)) > 0.9).astype(np.uint8) * 255
    first = find_candidate_lines(edges)
    cv2.setRNGSeed(1234)
    assert len(first) > 10
    np.testing.assert_array_equal(find_candidate_lines(edges), first)


def test_lines_of_the_most_frequent_slope_and_its_neighbourhood_are_kept() -> None:
    lines = np.array([at_angle(a) for a in (0.0, 2.0, -4.0, 9.0, -9.0, 12.0, 70.0, 71.0)])
    np.testing.assert_array_equal(select_dominant_slope(lines), lines[:5])


def test_slopes_on_either_side_of_the_vertical_count_as_neighbours() -> None:
    lines = np.array([at_angle(a) for a in (88.0, 89.5, -88.0, 0.0, 1.0)])
    np.testing.assert_array_equal(select_dominant_slope(lines), lines[:3])


@pytest.mark.parametrize("other", [40.0, -40.0, 90.0])
def test_of_equally_frequent_slopes_the_more_level_one_wins(other: float) -> None:
    lines = np.array([at_angle(other), at_angle(10.0)])
    np.testing.assert_array_equal(select_dominant_slope(lines), lines[1:])


def test_no_lines_have_no_slope_and_no_columns() -> None:
    assert select_dominant_slope(np.empty((0, 4))).shape == (0, 4)
    assert find_shared_columns(np.empty((0, 4)), 320) is None


@no_deadline
@given(SPANS)
def test_shared_columns_are_the_widest_run_that_most_lines_cross(spans: list[list[int]]) -> None:
    lines = np.array([[left, 5.0, right, 9.0] for left, right in spans])
    found = find_shared_columns(lines, 40)
    assert found is not None
    counts = [sum(left <= column <= right for left, right in spans) for column in range(40)]
    most = max(counts)
    runs = [
        (last - first, -first)
        for first in range(40)
        for last in range(first, 40)
        if all(count == most for count in counts[first : last + 1])
    ]
    width, start = max(runs)
    assert found == (-start, -start + width)


def test_lines_are_cut_at_the_columns_and_dropped_outside_of_them() -> None:
    lines = np.array([[0.0, 10.0, 100.0, 20.0], [60.0, 50.0, 90.0, 50.0], [10.0, 5.0, 30.0, 5.0]])
    expected = [[40.0, 14.0, 80.0, 18.0], [60.0, 50.0, 80.0, 50.0]]
    np.testing.assert_allclose(clip_lines_to_columns(lines, 40, 80), expected)


def test_vertical_line_within_the_columns_keeps_its_rows() -> None:
    lines = np.array([[50.0, 10.0, 50.0, 90.0]])
    np.testing.assert_array_equal(clip_lines_to_columns(lines, 40, 80), lines)


@no_deadline
@given(st.lists(st.tuples(*[st.integers(0, 60)] * 4), min_size=1, max_size=5))
def test_lines_are_drawn_without_gaps_between_their_ends(ends: list[tuple[int, ...]]) -> None:
    lines = np.array(ends, dtype=np.float64)
    pixels, index = pixels_on_lines(lines)
    for number, line in enumerate(lines):
        mine = pixels[index == number]
        assert len(mine) == max(abs(line[2] - line[0]), abs(line[3] - line[1])) + 1
        np.testing.assert_array_equal(mine[[0, -1]], line.reshape(2, 2))
        assert np.abs(np.diff(mine, axis=0)).max(initial=0) <= 1
