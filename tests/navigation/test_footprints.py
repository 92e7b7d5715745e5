"""Ground that stairs forbid, to the centimetre, on the floor below and on the one above."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stairmap.navigation.floors import Floor, FloorStack, find_floors
from stairmap.navigation.footprints import (
    EDGE_MARGIN,
    FOOT_MARGIN,
    HEADROOM,
    Rectangle,
    stair_rectangles,
)
from stairmap.navigation.keepout import ForbiddenGround, block_stairs, make_keepout_mask
from stairmap.navigation.occupancy import MapError, OccupancyGrid
from stairmap.stairway import Landing
from walkable_stairways import make_flight, make_half_turn, make_stairway

TURNED = Rectangle(center=(1.0, 2.0), heading=math.radians(30), length=4.0, width=1.0)


def along_and_across(along, across):
    """Return a point that lies so far along the turned rectangle and to its left."""
    forward = np.array([math.cos(math.radians(30)), math.sin(math.radians(30))])
    return np.array([1.0, 2.0]) + along * forward + across * np.array([-forward[1], forward[0]])


def test_a_turned_rectangle_contains_what_is_half_its_length_and_width_away():
    for sign in (1, -1):
        assert TURNED.contains(along_and_across(1.99 * sign, 0.49 * sign))
        assert TURNED.contains(along_and_across(1.99 * sign, -0.49 * sign))
        assert not TURNED.contains(along_and_across(2.01 * sign, 0.0))
        assert not TURNED.contains(along_and_across(0.0, 0.51 * sign))


def test_the_corners_go_round_counter_clockwise_from_front_left():
    expected = [along_and_across(*place) for place in ((2, 0.5), (-2, 0.5), (-2, -0.5), (2, -0.5))]
    assert TURNED.corners() == pytest.approx(np.array(expected))


def test_the_margins_are_those_that_the_page_on_navigation_states():
    assert (HEADROOM, EDGE_MARGIN, FOOT_MARGIN) == (2.0, 0.30, 0.05)


def test_on_the_floor_below_only_the_risers_under_which_nobody_can_pass_count():
    """Eleven risers of 0.17 m are below 2.0 m; the tread of the eleventh belongs to them."""
    stairway = make_stairway(make_flight(num_risers=18))
    (below,) = stair_rectangles(stairway, find_floors([stairway]), 0)
    assert below.length == pytest.approx(11 * 0.28 + FOOT_MARGIN)
    assert below.center == pytest.approx(((11 * 0.28 - FOOT_MARGIN) / 2, 0.0))
    assert below.width == pytest.approx(1.2)


def test_a_low_flight_covers_all_its_risers_on_both_floors_and_the_strip_before_its_edge_above():
    stairway = make_stairway(make_flight(base=(1.0, 2.0, 0.0), heading=math.pi / 2, num_risers=6))
    floors = find_floors([stairway])
    (below,), (above,) = stair_rectangles(stairway, floors, 0), stair_rectangles(stairway, floors, 1)
    assert below.length == pytest.approx(5 * 0.28 + FOOT_MARGIN)
    assert below.center == pytest.approx((1.0, 2.0 + (5 * 0.28 - FOOT_MARGIN) / 2))
    # Above, both ends of the hole are edges.
    assert above.length == pytest.approx(5 * 0.28 + 2 * EDGE_MARGIN)
    assert above.center == pytest.approx((1.0, 2.0 + 5 * 0.28 / 2))
    assert above.heading == pytest.approx(math.pi / 2)


def test_of_two_flights_the_lower_has_the_strip_at_its_foot_and_the_upper_the_one_at_its_edge():
    stairway = make_half_turn(height=3.06)
    floors = find_floors([stairway])
    first, second, *_ = stair_rectangles(stairway, floors, 1)
    assert first.length == pytest.approx(8 * 0.28 + EDGE_MARGIN)
    assert second.length == pytest.approx(8 * 0.28 + EDGE_MARGIN)
    lower, upper, _ = stair_rectangles(stairway, floors, 0)
    assert lower.length == pytest.approx(8 * 0.28 + FOOT_MARGIN)
    # From 1.53 m up, two more risers are below the headroom.
    assert upper.length == pytest.approx(2 * 0.28)


@pytest.mark.parametrize(("height", "num_below"), [(3.9, 2), (4.1, 1)])
def test_a_landing_counts_on_the_floor_below_as_long_as_one_cannot_walk_under_it(height, num_below):
    """Halfway up, at 1.95 and 2.05 m. The flight that begins there counts on no floor below."""
    stairway = make_half_turn(height=height)
    floors = find_floors([stairway])
    assert len(stair_rectangles(stairway, floors, 0)) == num_below
    *_, landing, _ = stair_rectangles(stairway, floors, 1)
    assert (landing.length, landing.width) == (1.2, 2.5)
    assert landing.center == pytest.approx((8 * 0.28 + 0.6, 0.65))


def test_a_landing_keeps_its_heading():
    flights = (make_flight(), make_flight(base=(4.0, 0.0, 1.7)))
    landing = Landing(center=[3.0, 0.0, 1.7], size=(1.5, 1.0), heading=0.4)
    stairway = make_stairway(*flights, landings=(landing,))
    *_, rectangle = stair_rectangles(stairway, find_floors([stairway]), 1)
    assert rectangle == Rectangle(center=(3.0, 0.0), heading=0.4, length=1.5, width=1.0)


def test_a_floor_that_a_stairway_passes_by_is_left_alone():
    stairway = make_stairway(make_flight(num_risers=18))
    floors = tuple(Floor(level=level, height=3.06 * level, is_explored=True) for level in range(3))
    stack = FloorStack(floors=floors, levels={1: (0, 1)})
    assert stair_rectangles(stairway, stack, 2) == ()


def test_stairs_are_put_into_a_map_and_nothing_else_of_it_changes():
    stairway = make_stairway(make_flight(base=(2.0, 2.0, 0.0), num_risers=5))
    cells = np.zeros((40, 50), dtype=np.int8)
    cells[0], cells[1] = -1, 100
    grid = OccupancyGrid(cells=cells, resolution=0.1, origin=(0.0, 0.0))
    blocked = block_stairs(grid, [stairway], find_floors([stairway]), 0)
    assert (blocked.resolution, blocked.origin) == (grid.resolution, grid.origin)
    assert np.array_equal(blocked.cells[:2], cells[:2])
    assert (blocked.value_at((2.5, 2.0)), blocked.value_at((1.9, 2.0)), blocked.value_at((2.5, 2.7))) == (
        100,
        0,
        0,
    )


def test_a_mask_without_a_map_has_a_metre_around_the_stairs():
    stairway = make_stairway(make_flight(base=(0.03, 0.0, 0.0), run=0.30, num_risers=5))
    floors = find_floors([stairway])
    mask = make_keepout_mask(ForbiddenGround(stairways=(stairway,)), floors, 0, resolution=0.1)
    assert mask.resolution == 0.1
    # The strip before the foot begins at -0.02 m; the last nosing is at 1.23 m; the width is 1.2 m.
    assert mask.origin == pytest.approx((-1.1, -1.6))
    assert mask.cells.shape == (32, 34)
    assert make_keepout_mask(ForbiddenGround(stairways=(stairway,)), floors, 0).resolution == 0.05
    assert set(np.unique(mask.cells)) == {-1, 100}
    rows, columns = np.nonzero(mask.cells == 100)
    centers = mask.centers(rows, columns)
    assert centers.min(axis=0) == pytest.approx([0.05, -0.55])
    assert centers.max(axis=0) == pytest.approx([1.15, 0.55])


def test_stairs_that_lie_kilometres_apart_get_no_mask_that_fills_the_memory():
    pair = [make_stairway(make_flight(base=(x, 0.0, 0.0)), stairway_id=x + 1) for x in (0, 20_000)]
    pair.append(make_stairway(make_flight(base=(0.0, 9_000.0, 0.0)), stairway_id=7))
    with pytest.raises(MapError, match=r"floor 0 would be 20\.0 x 9\.0 km large"):
        make_keepout_mask(ForbiddenGround(stairways=tuple(pair)), find_floors(pair), 0)
