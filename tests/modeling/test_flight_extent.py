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
