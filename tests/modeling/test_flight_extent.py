"""How far a flight reaches, from edges made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.modeling.flight_extent import FlightExtent, find_extent
from stairmap.modeling.observation_table import EDGE_FIELDS


def extent_of(
    rows: list[tuple[float, float, bool, bool]], *, shift: list[float] | None = None, first: int = 0
) -> FlightExtent:
    """Extent of edges (left, right, left bounded, right bounded), the first ``first`` of the first step."""
    edges = np.zeros(len(rows), dtype=EDGE_FIELDS)
    for name, values in zip(
        ("left", "right", "left_bounded", "right_bounded"), zip(*rows, strict=True), strict=True
    ):
        edges[name] = values
    is_first = np.arange(len(rows)) < first
    return find_extent(edges, np.zeros(len(rows)) if shift is None else np.array(shift), is_first)


def test_both_ends_seen_give_the_width() -> None:
    extent = extent_of([(0.6, -0.6, True, True)] * 10)
    assert (extent.left, extent.right) == pytest.approx((0.6, -0.6))
    assert extent.left_bounded
    assert extent.right_bounded
    assert 0.0 < extent.width_std < 0.01


def test_drift_does_not_widen_a_lower_bound() -> None:
    shift = list(np.linspace(-0.3, 0.3, 20))
    extent = extent_of([(0.6, -0.6, False, False)] * 20, shift=shift)
    assert extent.left - extent.right == pytest.approx(1.2, abs=0.01)
    assert not extent.left_bounded
    assert not extent.right_bounded


def test_a_side_that_was_seen_keeps_its_end_in_a_lower_bound() -> None:
    shift = list(np.linspace(-0.3, 0.3, 21))
    extent = extent_of([(0.6, -0.4, True, False)] * 21, shift=shift)
    assert extent.left == pytest.approx(0.6, abs=0.01)
    assert extent.left - extent.right == pytest.approx(1.0, abs=0.01)


def test_an_end_that_many_edges_reach_past_is_an_obstacle() -> None:
    hidden = [(0.6, -0.3, True, True)] * 10
    open_ended = [(0.6, -0.6, True, False)] * 20
    seen = [(0.6, -0.6, True, True)] * 10
    extent = extent_of(hidden + open_ended + seen)
    assert (extent.left, extent.right) == pytest.approx((0.6, -0.6))


def test_what_lies_far_out_is_another_thing() -> None:
    beside = [(0.6, -2.0, True, False)] * 20
    extent = extent_of([(0.6, -0.6, True, True)] * 20 + beside)
    assert extent.right == pytest.approx(-0.6)


def test_a_first_step_that_is_a_little_wider_makes_the_width_less_sure() -> None:
    others = [(0.55, -0.55, True, True)] * 30
    sure = extent_of([(0.55, -0.55, True, True)] * 8 + others, first=8)
    open_question = extent_of([(0.6, -0.6, True, True)] * 8 + others, first=8)
    assert open_question.left - open_question.right == pytest.approx(1.1)
    assert sure.width_std < 0.01
    assert open_question.width_std == pytest.approx(0.05, rel=0.1)


SEEN, OPEN = (0.6, -0.6, True, True), (0.5, -0.5, False, False)


@pytest.mark.parametrize(("num_seen", "is_bounded"), [(2, False), (3, True)])
def test_three_edges_with_both_ends_bound_a_width(num_seen: int, is_bounded: bool) -> None:
    extent = extent_of([SEEN] * num_seen + [OPEN] * 10)
    assert (extent.left_bounded, extent.right_bounded) == (is_bounded, is_bounded)


@pytest.mark.parametrize(("num_seen", "is_bounded"), [(3, False), (5, True)])
def test_so_does_a_share_of_four_percent_of_many(num_seen: int, is_bounded: bool) -> None:
    extent = extent_of([SEEN] * num_seen + [OPEN] * (100 - num_seen))
    assert extent.left_bounded is is_bounded


@pytest.mark.parametrize(("num_seen", "is_bounded"), [(2, False), (3, True)])
def test_a_single_side_is_bounded_by_three_edges_too(num_seen: int, is_bounded: bool) -> None:
    rows = [(0.6, -0.5, True, False)] * num_seen + [(0.6, -0.5, False, False)] * 10
    extent = extent_of(rows)
    assert (extent.left_bounded, extent.right_bounded) == (is_bounded, False)
    mirrored = extent_of([(-right, -left, b, a) for left, right, a, b in rows])
    assert (mirrored.left_bounded, mirrored.right_bounded) == (False, is_bounded)


def test_drift_to_the_side_does_not_move_the_middle_of_a_bounded_width() -> None:
    shift = list(np.linspace(-0.2, 0.2, 21))
    extent = extent_of([SEEN] * 21, shift=shift)
    assert extent.left - extent.right == pytest.approx(1.2)
    assert extent.left + extent.right == pytest.approx(0.0, abs=1e-9)
    # Six tenths of half of what holds 68 % of the middles.
    assert extent.middle_std == pytest.approx(np.hypot(0.005, 0.6 * 0.68 * 0.2), rel=0.05)
    assert extent.width_std == pytest.approx(0.005, rel=0.01)


def test_frames_that_saw_one_end_tell_drift_too() -> None:
    both, left_only, right_only = SEEN, (0.6, -0.1, True, False), (0.1, -0.6, False, True)
    shift = [0.0] * 10 + [0.1] * 10 + [-0.1] * 10
    extent = extent_of([both] * 10 + [left_only] * 10 + [right_only] * 10, shift=shift)
    assert extent.left - extent.right == pytest.approx(1.2)
    assert extent.middle_std == pytest.approx(np.hypot(0.005, 0.6 * 0.1), rel=0.01)


def test_widths_that_scatter_make_the_width_less_sure_and_many_edges_surer() -> None:
    rows = [(0.6 + 0.02 * (index % 5 - 2), -0.6, True, True) for index in range(60)]
    few, many = extent_of(rows), extent_of(rows * 4)
    spread = 1.48 * 0.02
    assert few.width_std == pytest.approx(np.hypot(0.005, spread), rel=0.01)
    assert many.width_std == pytest.approx(np.hypot(0.005, spread / 2), rel=0.01)


@pytest.mark.parametrize(
    ("wider", "counts"), [(0.02, False), (0.04, True), (0.15, True), (0.17, False), (-0.05, False)]
)
def test_a_first_step_leaves_the_width_open_within_the_size_of_posts(wider: float, counts: bool) -> None:
    first = [(0.55 + wider / 2, -0.55 - wider / 2, True, True)] * 8
    extent = extent_of(first + [(0.55, -0.55, True, True)] * 30, first=8)
    expected = np.hypot(0.005, wider / 2) if counts else 0.005
    assert extent.width_std == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("num", "counts"), [(4, False), (5, True)])
def test_a_first_step_must_be_seen_five_times_for_that(num: int, counts: bool) -> None:
    first = [(0.6, -0.6, True, True)] * num
    extent = extent_of(first + [(0.55, -0.55, True, True)] * 30, first=num)
    assert (extent.width_std > 0.02) is counts


def short_left(short: float, *, num_short: int = 10, num_open: int = 12, num_seen: int = 20) -> FlightExtent:
    """Some left ends lie short of where many edges were seen to go on, and the others end there."""
    return extent_of(
        [(0.6 - short, -0.6, True, True)] * num_short
        + [(0.6, -0.6, False, True)] * num_open
        + [(0.6, -0.6, True, True)] * num_seen
    )


@pytest.mark.parametrize(("short", "counts"), [(0.04, True), (0.06, False)])
def test_an_end_50_mm_before_what_others_reach_is_no_end(short: float, counts: bool) -> None:
    # With 40 edges at each place the median width tells which were taken in.
    extent = short_left(short, num_short=22, num_open=30, num_seen=20)
    expected = 1.2 - short if counts else 1.2
    assert extent.left - extent.right == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("num_open", "counts"), [(4, True), (5, False)])
def test_five_edges_that_go_on_tell_how_far_a_flight_reaches(num_open: int, counts: bool) -> None:
    extent = short_left(0.2, num_short=7, num_open=num_open, num_seen=6)
    assert extent.left == pytest.approx(0.4 if counts else 0.6, abs=1e-6)


def test_where_most_ends_fall_short_what_reaches_farther_is_another_thing() -> None:
    assert short_left(0.2, num_short=20, num_open=40, num_seen=9).left == pytest.approx(0.4)
    assert short_left(0.2, num_short=20, num_open=40, num_seen=11).left == pytest.approx(0.6)


@pytest.mark.parametrize(("beyond", "is_of_flight"), [(0.45, True), (0.55, False)])
def test_what_lies_more_than_half_a_metre_out_is_not_of_the_flight(beyond: float, is_of_flight: bool) -> None:
    rows = [(0.6, -0.6, True, True)] * 10 + [(0.6 + beyond, -0.6, True, True)] * 9
    rows += [(0.6 + beyond, -0.6, False, True)] * 20
    extent = extent_of(rows)
    assert extent.left == pytest.approx(0.6 + beyond if is_of_flight else 0.6)


def test_the_right_side_is_judged_as_the_left() -> None:
    rows = [(0.4, -0.6, True, True)] * 10 + [(0.6, -0.6, False, True)] * 12 + [(0.6, -0.6, True, True)] * 20
    left = extent_of(rows)
    right = extent_of([(-b, -a, d, c) for a, b, c, d in rows])
    assert (right.left, right.right) == pytest.approx((-left.right, -left.left))


def test_a_lower_bound_is_what_nearly_all_edges_reach() -> None:
    rows = [(0.5 + 0.01 * index, -0.5, False, False) for index in range(11)]
    extent = extent_of(rows)
    assert extent.left == pytest.approx(0.59)
    assert (extent.width_std, extent.middle_std) == (0.03, 0.03)


def test_an_end_that_was_seen_on_the_right_holds_while_drift_is_taken_from_the_left() -> None:
    shift = list(np.linspace(-0.3, 0.3, 21))
    extent = extent_of([(0.4, -0.6, False, True)] * 21, shift=shift)
    assert extent.right == pytest.approx(-0.6, abs=0.01)
    assert extent.left - extent.right == pytest.approx(1.0, abs=0.01)
