from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.arrays import Float64Array
from stairmap.delmerico2013.collinear import merge_collinear_lines
from stairmap.delmerico2013.lines import pixels_on_lines
from value_strategies import no_deadline

LINES = st.lists(
    st.tuples(*[st.integers(0, 319), st.integers(0, 239)] * 2).filter(lambda ends: ends[:2] < ends[2:]),
    max_size=12,
    unique=True,
)


def merged(*lines: list[float]) -> list[list[float]]:
    result = merge_collinear_lines(np.array(lines, dtype=np.float64))
    return [list(np.round(line, 9)) for line in result]


def turned(line: list[float]) -> list[float]:
    """Mirror a line in the diagonal: columns become rows."""
    u0, v0, u1, v1 = line
    return [v0, u0, v1, u1] if v0 <= v1 else [v1, u1, v0, u0]


HALF, OTHER_HALF = [10.0, 100.0, 60.0, 110.0], [70.0, 112.0, 140.0, 126.0]


def test_halves_of_one_edge_become_one_line_between_its_ends() -> None:
    assert merged(HALF, OTHER_HALF) == [[10, 100, 140, 126]]


def test_steep_halves_are_merged_too_though_their_slopes_are_far_apart() -> None:
    # Slopes 50 and -70 rows per column: as y = m x + b these would never be merged.
    down, up = [100.0, 10.0, 101.0, 60.0], [100.0, 140.0, 101.0, 70.0]
    (line,) = merged(down, up)
    np.testing.assert_allclose(line[::2], 100.5, atol=0.6)
    np.testing.assert_allclose(sorted(line[1::2]), [10.0, 140.0], atol=0.6)


def test_merged_line_is_the_least_squares_line_through_the_pixels_of_its_members() -> None:
    lines = np.array([[10.0, 100.0, 60.0, 101.0], [55.0, 103.0, 140.0, 102.0], [20.0, 98.0, 50.0, 99.0]])
    (line,) = merge_collinear_lines(lines)
    pixels = pixels_on_lines(lines)[0].astype(np.float64)
    center = pixels.mean(axis=0)
    direction = np.linalg.eigh(np.cov(pixels.T))[1][:, 1]
    slope = (line[3] - line[1]) / (line[2] - line[0])
    assert slope == pytest.approx(direction[1] / direction[0], abs=0.005)
    assert line[1] + slope * (center[0] - line[0]) == pytest.approx(center[1], abs=0.3)
    assert (line[0], line[2]) == pytest.approx((10.0, 140.0), abs=0.5)


@pytest.mark.parametrize(
    "other",
    [
        [10.0, 111.0, 60.0, 111.0],  # intercept 11 px away
        [20.0, 105.0, 60.0, 117.0],  # slope 0.3
        [40.0, 107.0, 80.0, 107.0],  # intercept 7 px away, but no pixel within 5 px
    ],
    ids=["intercept", "slope", "distance"],
)
@pytest.mark.parametrize("steep", [False, True])
def test_lines_that_fail_one_criterion_stay_apart(other: list[float], steep: bool) -> None:
    line = [10.0, 100.0, 60.0, 100.0]
    lines = [turned(line), turned(other)] if steep else [line, other]
    assert merged(*lines) == lines


def test_chain_of_mergeable_lines_becomes_one() -> None:
    # The outer two are 12 px apart and would stay apart without the one between them.
    outer = [[10.0, 100.0, 110.0, 100.0], [10.0, 108.0, 110.0, 108.0]]
    between = [10.0, 104.0, 110.0, 104.0]
    assert len(merged(*outer)) == 2
    assert len(merged(outer[0], between, outer[1])) == 1


def test_one_line_and_none_are_left_alone() -> None:
    assert merged(HALF) == [HALF]
    assert merge_collinear_lines(np.empty((0, 4))).shape == (0, 4)


@no_deadline
@given(LINES, st.randoms(use_true_random=False))
def test_merging_does_not_depend_on_the_order_of_the_lines(lines: list[tuple[int, ...]], random) -> None:  # type: ignore[no-untyped-def]
    shuffled = list(lines)
    random.shuffle(shuffled)
    results = [
        merge_collinear_lines(np.array(part, dtype=np.float64).reshape(-1, 4)) for part in (lines, shuffled)
    ]
    np.testing.assert_allclose(_sorted_rows(results[0]), _sorted_rows(results[1]), atol=1e-6)


@no_deadline
@given(LINES)
def test_merged_lines_are_no_more_and_run_from_left_to_right(
    lines: list[tuple[int, ...]],
) -> None:
    given_lines = np.array(lines, dtype=np.float64).reshape(-1, 4)
    result = merge_collinear_lines(given_lines)
    assert len(result) <= len(given_lines)
    assert (result[:, 0] <= result[:, 2]).all()
    np.testing.assert_allclose(merge_collinear_lines(given_lines[:1]), given_lines[:1])


def _sorted_rows(lines: Float64Array) -> Float64Array:
    return lines[np.lexsort(np.round(lines, 6).T)]
