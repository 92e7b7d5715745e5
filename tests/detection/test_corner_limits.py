"""What is a corner of a scan, and what a direction of corners: each limit with a case on either side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from side_profiles import grid_of, scan
from stairmap.detection.elevation import Elevation
from stairmap.detection.nosing_search import Corners, find_corners, find_turns

SLOPE = np.linspace(-0.5, 0.5, 201)
ROW = 0.005


def scan_of(q: np.ndarray) -> Corners:
    """Corners of one scan of these inverse distances, rows of ``SLOPE``."""
    elevation = Elevation(grid=grid_of(SLOPE, 1), bearing=np.zeros(1), inverse_distance=q[:, None])
    return find_corners(elevation, noise=1e-5)


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6, 7, 8])
def test_something_farther_is_looked_for_2_3_5_and_7_rows_past_an_edge(rows: int) -> None:
    # One ray that is near and one that is far, and nothing else.
    q = np.zeros(201)
    q[120], q[120 + rows] = 0.5, 0.3
    corners = scan_of(q)
    assert np.count_nonzero(~corners.is_end) == (rows in {2, 3, 5, 7})


@pytest.mark.parametrize(("distance", "rows"), [(0.7, 10), (2.0, 6), (5.0, 3)])
@pytest.mark.parametrize(("share", "is_found"), [(0.97, True), (1.03, False)])
def test_a_crease_is_fitted_over_60_mm_but_3_rows_at_least_and_10_at_most(
    distance: float, rows: int, share: float, is_found: bool
) -> None:
    # 60 mm are 17, 6 and 2 rows. Of so many the inclination is known as well as this, for noise of 1.
    std = np.sqrt(12.0 / rows**3) / ROW * distance
    elevation = scan(
        [
            ((distance, -9.0), (distance, -0.3 * distance)),
            ((distance, -0.3 * distance), (9.0, -0.3 * distance)),
        ],
        num_strips=1,
        num_rows=201,
        top=0.0,
        bottom=-1.0,
    )
    corners = find_corners(elevation, noise=share * np.radians(14.0) / std)
    assert bool(np.any(~corners.is_jump)) == is_found


def has_crease(at: tuple[float, float], lower_deg: float, upper_deg: float) -> bool:
    """Whether two planes that meet in a corner at a place, of these inclinations, are taken for a nosing."""
    s, z = at
    low, high = np.radians(lower_deg), np.radians(upper_deg)
    profile = [
        ((s - 0.4 * np.cos(low), z - 0.4 * np.sin(low)), at),
        (at, (s + 0.8 * np.cos(high), z + 0.8 * np.sin(high))),
    ]
    middle = z / s
    elevation = scan(profile, num_strips=1, num_rows=400, bottom=middle - 1.0, top=middle + 1.0)
    corners = find_corners(elevation, noise=1e-5)
    # Where a piece of the scan holds both planes, lines through it meet elsewhere.
    near = np.hypot(corners.distance - s, corners.height - z) < 1e-6
    return bool(np.any(~corners.is_jump & near))


@pytest.mark.parametrize(("lower_deg", "is_found"), [(33.0, True), (27.0, False)])
def test_a_front_leans_back_by_no_more_than_60_degrees(lower_deg: float, is_found: bool) -> None:
    assert has_crease((1.0, -1.2), lower_deg, -20.0) == is_found


@pytest.mark.parametrize(("lower_deg", "is_found"), [(147.0, True), (153.0, False)])
def test_a_front_leans_over_by_no_more_than_60_degrees(lower_deg: float, is_found: bool) -> None:
    assert has_crease((1.5, 1.2), lower_deg, 50.0) == is_found


@pytest.mark.parametrize(("upper_deg", "is_found"), [(-27.0, True), (-33.0, False)])
def test_a_tread_falls_towards_its_back_by_no_more_than_30_degrees(upper_deg: float, is_found: bool) -> None:
    assert has_crease((1.0, -1.2), 90.0, upper_deg) == is_found


@pytest.mark.parametrize(
    ("last", "distance"),
    [(80, 0.3 / 0.1 + 0.05), (60, 0.3 / 0.2 * 0.2 / 0.1975)],
    ids=["5 cm at most", "half a row"],
)
def test_a_level_is_followed_to_its_edge_by_5_cm_at_most(last: int, distance: float) -> None:
    q = SLOPE / -0.3
    q[last + 1 :] = 0.1
    corners = scan_of(np.maximum(q, 0.0))
    # Half a row past the last ray the level would be 77 and 19 mm farther than that ray.
    (place,) = corners.distance[corners.is_jump & ~corners.is_end]
    assert place == pytest.approx(distance, abs=1e-4)


@pytest.mark.parametrize(("slope", "is_level"), [(-0.025, True), (-0.0175, False)])
def test_what_is_seen_less_than_2_percent_from_above_may_be_upright(slope: float, is_level: bool) -> None:
    # A level 24 mm below the camera that ends at this slope.
    slopes = np.linspace(slope - 0.3, slope + 0.1, 161)
    row = 0.0025
    q = slopes / -0.04
    q[121:] = 0.1
    grid = replace(grid_of(slopes, 1), row_size=row)
    elevation = Elevation(grid=grid, bearing=np.zeros(1), inverse_distance=q[:, None])
    corners = find_corners(elevation, noise=1e-5)
    (place,) = corners.distance[corners.is_jump & ~corners.is_end]
    own = -0.04 / slopes[120]
    assert (place > own) == is_level


def of_pairs(
    *pairs: tuple[float, float], strips: tuple[int, int] = (4, 5), climb: float = 0.0
) -> list[float]:
    """Directions told by pairs of corners: each is turned by an angle, degrees, and stands at a distance, m.

    ``climb`` is how much higher the second corner of a pair lies.
    """
    slope = np.linspace(-1.0, 0.5, 301)
    grid = grid_of(slope, 16, spread=0.4)
    bearing = np.linspace(0.38, -0.38, 16)
    elevation = Elevation(grid=grid, bearing=bearing, inverse_distance=np.zeros((301, 16)))
    strip = np.tile(strips, len(pairs))
    angle, away = (np.repeat(values, 2) for values in np.array(pairs).T)
    angle = np.radians(angle)
    s = away / (np.cos(angle) + bearing[strip] * np.sin(angle))
    # No pair is as high as another.
    height = np.repeat(0.5 * np.arange(len(pairs)), 2) + np.tile([0.0, climb], len(pairs))
    corners = Corners(
        distance=s,
        height=height,
        strip=strip,
        is_jump=np.ones(len(s), bool),
        is_end=np.zeros(len(s), bool),
    )
    return [float(turn) for turn in np.degrees(find_turns(elevation, corners, max_turns=4))]


@pytest.mark.parametrize(("num", "is_told"), [(4, False), (5, True)])
def test_five_pairs_tell_a_direction(num: int, is_told: bool) -> None:
    assert bool(of_pairs(*[(20.0, 1.5)] * num)) == is_told


@pytest.mark.parametrize(("apart", "is_told"), [(1, True), (2, True), (3, True), (4, False)])
def test_corners_of_a_pair_are_at_most_three_strips_apart(apart: int, is_told: bool) -> None:
    assert bool(of_pairs(*[(20.0, 1.5)] * 6, strips=(4, 4 + apart))) == is_told


@pytest.mark.parametrize("distance", [0.5, 3.0])
@pytest.mark.parametrize(("share", "is_told"), [(0.96, True), (1.04, False)])
def test_corners_of_a_pair_are_as_high_to_12_mm_and_one_and_a_half_rows(
    distance: float, share: float, is_told: bool
) -> None:
    for sign in (1.0, -1.0):
        climb = sign * share * (0.012 + 1.5 * 0.005 * distance)
        assert bool(of_pairs(*[(0.0, distance)] * 6, climb=climb)) == is_told


@pytest.mark.parametrize(("turn", "is_told"), [(64.0, True), (66.0, False)])
def test_edges_are_turned_by_65_degrees_at_most(turn: float, is_told: bool) -> None:
    for sign in (1.0, -1.0):
        assert bool(of_pairs(*[(sign * turn, 1.5)] * 6)) == is_told


@pytest.mark.parametrize(("other", "is_told"), [(9.3, True), (9.7, False)])
def test_pairs_within_7_degrees_of_the_commonest_are_of_its_direction(other: float, is_told: bool) -> None:
    # In the middle of a bin of 5 degrees four, which are too few, and three more.
    assert bool(of_pairs(*[(2.5, 1.5)] * 4, *[(other, 1.5)] * 3)) == is_told


@pytest.mark.parametrize(("other", "num"), [(12.8, 1), (13.2, 2)])
def test_directions_within_10_and_a_half_degrees_are_one(other: float, num: int) -> None:
    found = of_pairs(*[(2.5, 1.5)] * 9, *[(other, 1.5)] * 6)
    assert found == pytest.approx([2.5, other][:num], abs=0.01)
