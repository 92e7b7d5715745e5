"""Views of the ground: where they saw it, and how high the camera was above it."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.ground import NUM_RANGE_BINS, GroundView
from stairmap.modeling.ground_table import NUM_BEARINGS, GroundTable, sees_ground
from stairmap.transforms import transform_from_parts

BIN = 0.125
HEIGHT = 0.6
POSE = transform_from_parts([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [5.0, 2.0, HEIGHT])
"""The camera looks along the map's +y; its own axes are forward, left and up."""


def make_view(is_seen=None, *, height=HEIGHT, num_bearings=NUM_BEARINGS):
    """A view of 45 degrees to either side, of ground that was seen everywhere or in some bins."""
    seen = np.ones((num_bearings, NUM_RANGE_BINS), dtype=bool) if is_seen is None else is_seen
    bearing = np.linspace(1.0, -1.0, num_bearings)
    return GroundView(height=height, up=[0, 0, 1], forward=[1, 0, 0], bearing=bearing, is_seen=seen)


def record_of(view):
    table = GroundTable()
    table.add(0, view, ())
    return table.views[0]


def is_seen_at(view, ahead, left=0.0, above=0.0):
    """Whether a view saw its ground so far ahead of the camera's foot."""
    place = POSE[:3, :3] @ [ahead, left, above - HEIGHT] + POSE[:3, 3]
    return bool(sees_ground(record_of(view), POSE, place[None])[0])


@pytest.mark.parametrize("number", [0, 7, 31])
def test_ground_is_seen_from_the_near_to_the_far_end_of_its_bin(number):
    seen = np.zeros((NUM_BEARINGS, NUM_RANGE_BINS), dtype=bool)
    seen[:, number] = True
    low, high = number * BIN, (number + 1) * BIN
    expected = [(low + 0.01, True), (high - 0.01, True), (low - 0.01, False), (high + 0.01, False)]
    for ahead, is_seen in expected:
        assert is_seen_at(make_view(seen), ahead) is is_seen, ahead


def test_nothing_is_seen_behind_the_camera_nor_beyond_4_m():
    assert is_seen_at(make_view(), 3.99)
    assert not is_seen_at(make_view(), 4.01)
    assert not is_seen_at(make_view(), -0.5)


@pytest.mark.parametrize(("above", "is_seen"), [(0.14, True), (-0.14, True), (0.16, False), (-0.16, False)])
def test_a_place_is_on_the_ground_within_15_cm_of_its_plane(above, is_seen):
    assert is_seen_at(make_view(), 2.0, above=above) is is_seen


@pytest.mark.parametrize(
    ("left", "is_seen"), [(1.98, True), (-1.98, True), (2.06, False), (-2.06, False), (0.0, True)]
)
def test_a_view_ends_at_its_first_and_last_bearing(left, is_seen):
    assert is_seen_at(make_view(), 2.0, left) is is_seen


@pytest.mark.parametrize("column", [0, 10, 47])
def test_each_bearing_tells_of_what_lies_along_it_alone(column):
    seen = np.zeros((NUM_BEARINGS, NUM_RANGE_BINS), dtype=bool)
    seen[column] = True
    bearings = np.linspace(1.0, -1.0, NUM_BEARINGS)
    told = [is_seen_at(make_view(seen), 2.0, 2.0 * bearing) for bearing in bearings]
    assert np.flatnonzero(told).tolist() == [column]


def test_a_view_of_more_bearings_is_thinned_evenly():
    seen = np.zeros((95, NUM_RANGE_BINS), dtype=bool)
    seen[60] = True
    bearings = np.linspace(1.0, -1.0, 95)
    assert is_seen_at(make_view(seen, num_bearings=95), 2.0, 2.0 * bearings[60])
    assert not is_seen_at(make_view(seen, num_bearings=95), 2.0, 2.0 * bearings[56])


def camera_height_of(*heights):
    table = GroundTable()
    for stamp_ns, height in enumerate(heights):
        table.add(stamp_ns, make_view(height=height), ())
    return table.camera_height()


def test_three_views_tell_the_height_of_the_camera_and_two_do_not():
    assert camera_height_of(0.6, 0.6) is None
    assert camera_height_of(0.6, 0.61, 0.62) == pytest.approx(0.61)


@pytest.mark.parametrize(("spread", "is_told"), [(0.058, True), (0.062, False)])
def test_heights_within_6_cm_are_one(spread, is_told):
    # Of five views three agree, or two.
    heights = (0.5, 0.5 + spread / 2, 0.5 + spread, 1.0, 1.5)
    assert (camera_height_of(*heights) is not None) is is_told


def test_half_of_the_views_must_agree_on_a_height():
    assert camera_height_of(0.9, 0.6, 0.61, 1.4) == pytest.approx(0.605)
    assert camera_height_of(0.9, 0.6, 0.61, 1.4, 2.0) is None


def test_the_height_that_most_agree_on_counts_and_not_the_lowest():
    assert camera_height_of(0.3, 0.31, 0.9, 0.91, 0.92, 0.93) == pytest.approx(0.915)
