"""What an edge of the ground is, ray by ray: each limit with a case on either side."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.drops import find_drops, find_edge_places, find_void_places, find_voids
from stairmap.detection.ground import NUM_RANGE_BINS, GroundSamples, GroundView

SPACING = 0.03
"""Forward distance between rays, m, where not said otherwise."""


def samples_of(heights, *, edge=1.0, before=12, spacing=SPACING, bearings=(0.0,), camera_height=1.0):
    """Rays against the ground: ``before`` of them on it, the last at ``edge`` m, and then these heights.

    ``heights`` are one list for all bearings, or one for each.
    """
    heights = np.atleast_2d(np.array(heights, dtype=float))
    heights = np.broadcast_to(heights, (len(bearings), heights.shape[1])).T
    height = np.concatenate([np.zeros((before, len(bearings))), heights])
    row = np.arange(len(height)) - before + 1
    crossing = np.asarray(edge)[None] + spacing * row[:, None]
    return GroundSamples(
        view=GroundView(
            height=camera_height,
            up=[0, 0, 1],
            forward=[1, 0, 0],
            bearing=np.array(bearings),
            is_seen=np.zeros((len(bearings), NUM_RANGE_BINS), dtype=bool),
        ),
        crossing=np.broadcast_to(crossing, height.shape).astype(np.float32),
        height=height.astype(np.float32),
    )


def has_edge(heights, **how):
    return bool(len(find_edge_places(samples_of(heights, **how)).column))


def with_ground(chosen, heights, **how):
    """Whether there is an edge when the rays before it have these heights."""
    samples = samples_of(heights, **how)
    height = samples.height.copy()
    height[12 - len(chosen) : 12, 0] = chosen
    changed = GroundSamples(view=samples.view, crossing=samples.crossing, height=height)
    return bool(len(find_edge_places(changed).column))


LOWER = [-0.5] * 10
MIXED = -0.07
"""Neither on the ground nor a drop."""


@pytest.mark.parametrize(
    ("edge", "depth", "is_told"),
    [(1.0, 0.098, False), (1.0, 0.102, True), (3.0, 0.158, False), (3.0, 0.1635, True)],
)
def test_a_drop_is_10_cm_deep_or_4_cm_and_4_for_each_metre_of_distance(edge, depth, is_told):
    assert has_edge([-depth] * 10, edge=edge, spacing=0.01) is is_told


@pytest.mark.parametrize(("num_ground", "is_told"), [(3, True), (2, False)])
def test_three_of_the_last_six_rays_before_an_edge_are_on_the_ground(num_ground, is_told):
    before = [MIXED] * (12 - num_ground) + [0.0] * num_ground
    assert with_ground(before, LOWER) is is_told
    # A seventh ray does not count.
    far = [0.0] * 6 + [MIXED] * (6 - num_ground) + [0.0] * num_ground
    assert with_ground(far, LOWER) is is_told


@pytest.mark.parametrize(("num_below", "is_told"), [(5, True), (4, False)])
def test_five_of_eight_rays_behind_an_edge_end_below_the_ground(num_below, is_told):
    assert has_edge([-0.5] * num_below + [0.3] * 10) is is_told
    # A ninth ray does not count.
    assert has_edge([-0.5] * 4 + [0.3] * 4 + [-0.5] + [0.3] * 9) is False


@pytest.mark.parametrize(("num_mixed", "is_told"), [(3, True), (4, False)])
def test_at_most_three_rays_lie_between_the_ground_and_what_is_lower(num_mixed, is_told):
    assert has_edge([MIXED] * num_mixed + LOWER) is is_told


@pytest.mark.parametrize(("edge", "is_told"), [(3.49, True), (3.51, False)])
def test_edges_are_looked_for_up_to_3_5_m(edge, is_told):
    assert has_edge(LOWER, edge=edge) is is_told


@pytest.mark.parametrize(("num_missing", "is_told"), [(8, True), (9, False)])
def test_less_than_30_cm_of_ground_are_not_measured_at_an_edge(num_missing, is_told):
    # 0.27 m, or 0.315 m with the wider spacing.
    spacing = 0.03 if is_told else 0.0315
    assert has_edge([np.nan] * num_missing + LOWER, spacing=spacing) is is_told


@pytest.mark.parametrize(("spacing", "beyond"), [(0.04, 0.02), (0.09, 0.045), (0.11, 0.05), (0.28, 0.05)])
def test_an_edge_lies_halfway_to_the_first_lower_ray_but_at_most_5_cm_behind_the_ground(spacing, beyond):
    places = find_edge_places(samples_of(LOWER, edge=3.4, spacing=spacing))
    assert places.place[0] == pytest.approx([3.4 + beyond, 0.0], abs=1e-5)
    assert places.depth[0] == pytest.approx(0.5)


@pytest.mark.parametrize(("edge", "high", "low"), [(0.5, 0.029, 0.033), (3.0, 0.055, 0.064)])
@pytest.mark.parametrize("sign", [1, -1])
def test_ground_is_what_lies_within_25_mm_and_12_for_each_metre_of_its_plane(edge, high, low, sign):
    ground = (sign * high, True), (sign * low, False)
    for height, is_told in ground:
        assert with_ground([height] * 12, LOWER, edge=edge, spacing=0.01) is is_told


@pytest.mark.parametrize(("spacing", "is_told"), [(0.08, True), (0.10, False)])
def test_what_falls_in_even_steps_is_an_edge_where_it_is_steeper_than_22_degrees(spacing, is_told):
    falls = [-0.12, -0.24, -0.36, -0.48]
    assert has_edge([*falls, *[-0.48] * 6], spacing=spacing) is is_told


@pytest.mark.parametrize(("share", "is_told"), [(0.72, True), (0.68, False)])
def test_two_steps_make_seven_tenths_of_the_fall_at_an_edge(share, is_told):
    falls = 0.6 * np.array([share / 2, share / 2, (1 - share) / 2, (1 - share) / 2])
    heights = [*-np.cumsum(falls), *[-0.6] * 6]
    assert has_edge(heights, spacing=0.2, edge=2.6) is is_told


def test_only_the_nearest_edge_along_a_bearing_is_told():
    places = find_edge_places(samples_of([*[-0.5] * 8, *[0.0] * 8, *LOWER]))
    assert places.place[:, 0] == pytest.approx([1.015], abs=1e-5)


def test_bearings_put_an_edge_to_the_left_and_to_the_right():
    places = find_edge_places(samples_of(LOWER, edge=2.0, bearings=(0.3, 0.0, -0.3)))
    assert places.column.tolist() == [0, 1, 2]
    assert places.place == pytest.approx(2.015 * np.array([[1, 0.3], [1, 0], [1, -0.3]]), abs=1e-5)


# Edges over several bearings


def edges_at(distances, bearings):
    """Drops where the ground ends at these distances along bearings; NaN where it goes on."""
    told = np.array(distances, dtype=float)
    heights = np.where(np.isnan(told)[:, None], 0.0, np.array(LOWER))
    return find_drops(samples_of(heights, edge=np.nan_to_num(told, nan=1.0), bearings=bearings))


@pytest.mark.parametrize(("length", "num"), [(0.19, 0), (0.21, 1)])
def test_an_edge_is_20_cm_long(length, num):
    bearings = np.linspace(length / 2, -length / 2, 9) / 1.015
    drops = edges_at([1.0] * 9, bearings)
    assert len(drops) == num
    for drop in drops:
        assert drop.edge == pytest.approx(
            np.array([[1.015, length / 2, -1], [1.015, -length / 2, -1]]), abs=1e-4
        )
        assert (drop.depth, drop.num_rays) == (0.5, 9)


@pytest.mark.parametrize(("num_places", "num"), [(4, 0), (5, 1)])
def test_five_bearings_show_an_edge(num_places, num):
    assert len(edges_at([1.0] * num_places, np.linspace(0.2, -0.2, num_places))) == num


@pytest.mark.parametrize(("num_skipped", "num"), [(2, 1), (3, 2)])
def test_an_edge_goes_on_over_two_bearings_that_do_not_show_it(num_skipped, num):
    distances = [1.0] * 9 + [np.nan] * num_skipped + [1.0] * 9
    # So narrow that places on both sides of a gap of three are near enough.
    bearings = 0.028 * np.arange(len(distances))[::-1]
    assert len(edges_at(distances, bearings)) == num


@pytest.mark.parametrize(
    ("edge", "step", "num"), [(0.6, 0.115, 1), (0.6, 0.125, 2), (3.0, 0.355, 1), (3.0, 0.37, 2)]
)
def test_neighbouring_places_lie_within_12_cm_or_12_percent_of_their_distance(edge, step, num):
    left, right = 0.06 * np.arange(6)[::-1] + step, -0.06 * np.arange(6)
    bearings = np.concatenate([left, right]) / (edge + 0.015)
    assert len(edges_at([edge] * 12, bearings)) == num


@pytest.mark.parametrize(("bend", "num"), [(0.042, 1), (0.049, 2)])
def test_an_edge_within_3_cm_and_15_mm_for_each_metre_of_a_line_is_straight(bend, num):
    # At 1 m: 45 mm. The bend is in the middle.
    bearings = np.linspace(0.3, -0.3, 11)
    away = bend * (1 - np.abs(np.linspace(-1, 1, 11)))
    assert len(edges_at(1.0 + away, bearings)) == num


def test_drops_come_the_nearest_first():
    bearings = np.linspace(0.6, -0.6, 21)
    distances = [1.6] * 9 + [np.nan] * 3 + [1.0] * 9
    assert [round(drop.distance, 1) for drop in edges_at(distances, bearings)] == [1.4, 1.9]


# Voids


def has_void(num_missing, behind=(0.0,) * 6, **how):
    return bool(len(find_void_places(samples_of([np.nan] * num_missing + list(behind), **how)).column))


@pytest.mark.parametrize(("num_missing", "is_told"), [(3, True), (2, False)])
def test_the_next_measured_ray_behind_a_void_is_the_fourth_from_the_ground(num_missing, is_told):
    assert has_void(num_missing, spacing=0.2, edge=1.8, before=6) is is_told


@pytest.mark.parametrize(("spacing", "is_told"), [(0.0505, True), (0.0495, False)])
def test_a_void_reaches_over_half_a_metre_of_ground(spacing, is_told):
    assert has_void(9, spacing=spacing) is is_told


@pytest.mark.parametrize(("edge", "is_told"), [(2.49, True), (2.51, False)])
def test_voids_are_looked_for_up_to_2_5_m(edge, is_told):
    assert has_void(20, edge=edge) is is_told


@pytest.mark.parametrize(("num_ground", "is_told"), [(6, True), (5, False)])
def test_the_last_six_rays_before_a_void_are_on_the_ground(num_ground, is_told):
    assert has_void(20, before=num_ground) is is_told
    samples = samples_of([np.nan] * 20)
    height = samples.height.copy()
    height[12 - num_ground - 1] = 0.1
    raised = GroundSamples(view=samples.view, crossing=samples.crossing, height=height)
    assert bool(len(find_void_places(raised).column)) is is_told


@pytest.mark.parametrize(("away", "is_told"), [(1.48, False), (1.52, True)])
def test_what_stands_within_half_a_metre_behind_the_ground_is_no_void(away, is_told):
    """The ray behind the gap crosses the ground at 1.63 m and ends nearer, on a thing."""
    height = 1.0 - away / (1.0 + 21 * SPACING)
    assert has_void(20, behind=(height,) * 6) is is_told


def test_a_void_lies_5_cm_behind_the_ground_and_reaches_to_the_border_of_the_image():
    places = find_void_places(samples_of([np.nan] * 20, edge=1.2, bearings=(0.2, -0.2)))
    assert places.place == pytest.approx(1.25 * np.array([[1, 0.2], [1, -0.2]]), abs=1e-5)
    assert np.isnan(places.depth).all()


@pytest.mark.parametrize(("length", "num"), [(0.39, 0), (0.41, 1)])
def test_the_edge_of_a_void_is_40_cm_long(length, num):
    bearings = np.linspace(length / 2, -length / 2, 15) / 1.05
    assert len(find_voids(samples_of([np.nan] * 20, bearings=bearings))) == num
