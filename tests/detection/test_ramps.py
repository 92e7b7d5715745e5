"""Where edges lie that sensors made ramps of."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from stairmap.arrays import Float64Array
from stairmap.detection.ramps import MAX_RAMP, SHARP, find_crossings


def below_of(q: Float64Array, last: int) -> Float64Array:
    """One row of what ``find_crossings`` takes: how much inverse depth falls past pixel ``last``."""
    return (q[last] - q[last : last + MAX_RAMP + 1])[None, :]


def test_a_sharp_edge_lies_half_a_pixel_past_the_last_one() -> None:
    q = np.where(np.arange(30) < 10, 0.5, 0.4)
    assert find_crossings(below_of(q, 9)) == pytest.approx([SHARP])


@pytest.mark.parametrize("sigma", [1.0, 1.5, 2.0])
def test_smoothing_leaves_the_edge_where_it_was(sigma: float) -> None:
    sharp = np.where(np.arange(60) < 30, 0.5, 0.4)
    q = cv2.GaussianBlur(sharp[None, :], (0, 0), sigma)[0]
    # The last pixel that still lies on the surface, to 3 % of the jump.
    last = int(np.flatnonzero(q > 0.5 - 0.003)[-1])
    assert last < 29
    assert last + find_crossings(below_of(q, last)) == pytest.approx([29.5], abs=0.2)


def test_a_mixed_pixel_moves_the_edge_by_its_share() -> None:
    q = np.array([0.5] * 10 + [0.475] + [0.4] * 10)
    assert find_crossings(below_of(q, 9)) == pytest.approx([1.0 + 1 / 3])


def test_an_edge_before_nothing_measured_is_taken_for_sharp() -> None:
    below = np.full((1, MAX_RAMP + 1), np.nan)
    assert find_crossings(below) == pytest.approx([SHARP])


def test_crossings_leave_what_they_were_given_alone() -> None:
    below = np.full((1, MAX_RAMP + 1), 0.1)
    find_crossings(below)
    assert (below == 0.1).all()
