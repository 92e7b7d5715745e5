"""Where a gap in the ground is a void: how long, how far, and at the border of the image."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.drops import (
    LAST_GROUND,
    MAX_SHIFT,
    MAX_VOID_DISTANCE,
    MIN_VOID_ROWS,
    find_void_places,
)
from stairmap.detection.ground import NUM_RANGE_BINS, GroundSamples, GroundView

NUM_ROWS = 30


def ground_with_gap(
    start: int, num_dark: int, *, row: float = 0.2, nearest: tuple[float, ...] = (0.5,)
) -> GroundSamples:
    """Level ground, a column for each nearest distance, without ``num_dark`` rows behind row ``start``."""
    crossing = np.array(nearest) + row * np.arange(NUM_ROWS)[:, None]
    height = np.zeros(crossing.shape)
    height[start + 1 : start + 1 + num_dark] = np.nan
    view = GroundView(
        height=1.0,
        up=np.array([0.0, -1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        bearing=np.zeros(len(nearest)),
        is_seen=np.zeros((len(nearest), NUM_RANGE_BINS), dtype=bool),
    )
    return GroundSamples(view=view, crossing=crossing.astype(np.float32), height=height.astype(np.float32))


@pytest.mark.parametrize(
    ("start", "num_dark", "row", "is_void"),
    [
        (6, MIN_VOID_ROWS - 1, 0.2, True),
        (6, MIN_VOID_ROWS - 2, 0.2, False),
        (LAST_GROUND - 1, 10, 0.2, True),
        (LAST_GROUND - 2, 10, 0.2, False),
        (6, 5, 0.09, True),
        (6, 4, 0.09, False),
        # Up to the border of the image, where nothing ends the gap.
        (NUM_ROWS - 1 - MIN_VOID_ROWS, MIN_VOID_ROWS, 0.07, False),
        (NUM_ROWS - 8, 7, 0.08, True),
        (NUM_ROWS - 1 - MIN_VOID_ROWS, MIN_VOID_ROWS, 0.2, False),
    ],
)
def test_a_void_is_a_gap_of_enough_rows_and_length_in_reach(
    start: int, num_dark: int, row: float, is_void: bool
) -> None:
    places = find_void_places(ground_with_gap(start, num_dark, row=row))
    assert len(places.column) == is_void
    if is_void:
        assert places.place[0] == pytest.approx([0.5 + row * start + MAX_SHIFT, 0.0], abs=1e-6)
        assert np.isnan(places.depth).all()


def test_a_gap_that_begins_as_many_rows_before_the_border_as_make_a_void_is_one() -> None:
    row = 0.6 / MIN_VOID_ROWS
    start = NUM_ROWS - 1 - MIN_VOID_ROWS
    nearest = 1.0 - row * start
    assert (
        len(find_void_places(ground_with_gap(start, MIN_VOID_ROWS, row=row, nearest=(nearest,))).column) == 1
    )
    beyond = ground_with_gap(start + 1, MIN_VOID_ROWS - 1, row=1.5 * row, nearest=(nearest,))
    assert not len(find_void_places(beyond).column)


def test_each_bearing_has_its_own_reach() -> None:
    start, row = 8, 0.2
    far = MAX_VOID_DISTANCE - row * start
    places = find_void_places(ground_with_gap(start, 6, row=row, nearest=(far + 0.01, far - 0.01)))
    assert places.column.tolist() == [1]
