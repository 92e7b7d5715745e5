"""Up a scan, a nosing is where the surface seen so far ends: before something farther, or in a corner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from side_profiles import Profile, descending_profile, grid_of, scan, stairs_profile
from stairmap.arrays import Float64Array
from stairmap.detection.elevation import Elevation
from stairmap.detection.nosing_search import (
    Corners,
    find_corners,
    find_turns,
)

MIN_CORNER = np.radians(40.0)
MIN_JUMP = 0.1
MIN_NOTHING_ROWS = 8
MIN_PAIRS = 5
"""Limits that hold, written again: who changes one changes it here as well."""

BACK_WALL = ((5.0, -3.0), (5.0, 4.0))
ROW = 1.65 / 329


def corners_of(profile: Profile, noise: float = 0.0, **how: float) -> Corners:
    """Corners of the single scan of a profile."""
    elevation = scan(profile, noise=noise, num_strips=1, **how)  # type: ignore[arg-type]
    return find_corners(elevation, noise=max(noise, 1e-4))


def places(corners: Corners, chosen: Float64Array) -> Float64Array:
    """(N, 2) distance and height of some corners, the lowest first."""
    found = np.stack([corners.distance, corners.height], axis=1)[chosen]
    return found[np.argsort(found[:, 1])]


def jumps(profile: Profile, noise: float = 0.0, **how: float) -> Float64Array:
    corners = corners_of(profile, noise, **how)
    return places(corners, corners.is_jump & ~corners.is_end)


def creases(profile: Profile, noise: float = 0.0) -> Float64Array:
    corners = corners_of(profile, noise)
    return places(corners, ~corners.is_jump)


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_nosings_below_the_camera_are_creases(noise: float) -> None:
    found = creases(stairs_profile(distance=1.0, height=-0.9, num=4), noise)
    true = np.stack([1.0 + 0.28 * np.arange(4), -0.9 + 0.17 * np.arange(4)], axis=1)
    for nosing in true:
        assert np.abs(found - nosing).max(axis=1).min() < 0.012
    assert len(found) <= 5


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_nosings_above_the_camera_are_jumps_within_a_row(noise: float) -> None:
    found = jumps([*stairs_profile(distance=1.5, height=-0.05, num=4), BACK_WALL], noise)
    true = np.stack([1.5 + 0.28 * np.arange(1, 4), -0.05 + 0.17 * np.arange(1, 4)], axis=1)
    for nosing in true:
        nearest = found[np.abs(found - nosing).max(axis=1).argmin()]
        assert nearest[0] == pytest.approx(nosing[0], abs=0.01)
        # The edge is taken half a row above the last that shows it.
        assert nearest[1] == pytest.approx(nosing[1], abs=0.55 * ROW * nosing[0] + 6 * noise)


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_ends_of_treads_are_the_nosings_of_stairs_that_descend(noise: float) -> None:
    profile = descending_profile(distance=0.9, height=-0.8, num=4)
    found = jumps(profile, noise)
    true = np.stack([0.9 + 0.28 * np.arange(3), -0.8 - 0.17 * np.arange(3)], axis=1)
    for nosing in true:
        assert np.abs(found - nosing).max(axis=1).min() < 0.02


def test_slabs_without_risers_end_in_jumps_too() -> None:
    profile = stairs_profile(distance=1.0, height=-0.75, num=4, has_risers=False, floor=False)
    found = jumps([*profile, ((0.05, -1.4), (6.0, -1.4))])
    # Each slab's back edge hides what is behind; two of them lie below the line of sight over the next one.
    assert len(found) >= 2
    steps = np.diff(found[:, 0])
    np.testing.assert_allclose(steps, np.rint(steps / 0.28) * 0.28, atol=0.03)


def test_inner_corners_are_none() -> None:
    # A floor before a wall: concave.
    profile = [((0.05, -0.8), (2.0, -0.8)), ((2.0, -0.8), (2.0, 3.0))]
    assert len(corners_of(profile)) == 0


def test_floors_and_walls_alone_have_none() -> None:
    assert len(corners_of([((0.05, -0.8), (9.0, -0.8))], top=-0.1)) == 0
    assert len(corners_of([((2.0, -3.0), (2.0, 4.0))])) == 0
    assert len(corners_of([])) == 0


def test_a_ceiling_has_none() -> None:
    # Looking up: the ceiling comes nearer towards the top of the image, and ends at nothing.
    room = [((4.0, -1.0), (4.0, 1.4)), ((0.05, 1.4), (4.0, 1.4))]
    assert len(corners_of(room, top=2.0, bottom=-0.2)) == 0
    # Seen over a rail's lower edge it jumps nearer, which is no nosing either.
    beam = [*room, ((2.0, 1.0), (2.0, 1.4))]
    assert len(corners_of(beam, top=0.69, bottom=-0.2)) == 0


@pytest.mark.parametrize(("gap", "is_found"), [(0.08, False), (0.13, True)])
def test_a_jump_is_10_cm_or_more(gap: float, is_found: bool) -> None:
    assert MIN_JUMP == 0.10
    profile = [((2.0, -0.5), (2.0, 0.2)), ((2.0 + gap, -0.5), (2.0 + gap, 3.0))]
    found = jumps(profile)
    assert (len(found) == 1) == is_found
    if is_found:
        np.testing.assert_allclose(found[0], [2.0, 0.2], atol=1.1 * ROW)


@pytest.mark.parametrize(("noise", "is_found"), [(1e-4, True), (0.01, False)])
def test_a_jump_within_the_noise_is_none(noise: float, is_found: bool) -> None:
    # From 2 to 2.15 m inverse distance falls by 0.035, five times 0.007.
    elevation = scan([((2.0, -0.5), (2.0, 0.2)), ((2.15, -0.5), (2.15, 3.0))], num_strips=1)
    corners = find_corners(elevation, noise=noise)
    assert (np.count_nonzero(corners.is_jump) == 1) == is_found


@pytest.mark.parametrize("noise", [0.0065, 0.0075])
def test_five_standard_deviations_make_a_jump(noise: float) -> None:
    elevation = scan([((2.0, -0.5), (2.0, 0.2)), ((2.15, -0.5), (2.15, 3.0))], num_strips=1)
    fall = 1 / 2.0 - 1 / 2.15
    corners = find_corners(elevation, noise=noise)
    assert bool(corners.is_jump.any()) == (fall > 5.0 * noise)


def test_a_level_that_recedes_is_no_jump_however_fast() -> None:
    # Rows near the horizon: the floor is 0.2 m farther from row to row.
    assert len(jumps([((0.05, -0.25), (9.0, -0.25))], top=-0.03)) == 0


@pytest.mark.parametrize("rows", [1, 2, 3, 5])
def test_a_jump_that_a_sensor_made_a_ramp_of_is_one_jump(rows: int) -> None:
    elevation = scan([((2.0, -0.5), (2.0, 0.2)), ((3.0, -0.5), (3.0, 3.0))], num_strips=1)
    kernel = np.ones(rows) / rows
    q = np.convolve(np.pad(elevation.inverse_distance[:, 0], rows, mode="edge"), kernel, mode="same")
    blurred = replace(elevation, inverse_distance=q[rows:-rows, None])
    corners = find_corners(blurred, noise=1e-4)
    found = places(corners, corners.is_jump & ~corners.is_end)
    assert len(found) == 1
    assert found[0, 0] == pytest.approx(2.0, abs=0.06)
    assert found[0, 1] / 2.0 == pytest.approx(0.1, abs=(0.6 + 0.5 * rows) * ROW)


def test_a_reduced_images_edges_are_moved_back() -> None:
    profile = [((2.0, -0.5), (2.0, 0.2)), ((3.0, -0.5), (3.0, 3.0))]
    plain, shifted = jumps(profile), jumps(profile, edge_shift=0.4)
    assert plain[0, 1] - shifted[0, 1] == pytest.approx(0.4 * ROW * 2.0, rel=0.01)


@pytest.mark.parametrize(("missing", "is_found"), [(MIN_NOTHING_ROWS - 1, False), (MIN_NOTHING_ROWS, True)])
def test_an_edge_before_nothing_at_all_is_an_end(missing: int, is_found: bool) -> None:
    elevation = scan([((2.0, -3.0), (2.0, 3.0))], num_strips=1)
    q = elevation.inverse_distance.copy()
    q[100 : 100 + missing] = 0.0
    corners = find_corners(replace(elevation, inverse_distance=q), noise=1e-4)
    assert bool(corners.is_end.any()) == is_found
    if is_found:
        edge = elevation.slope[99] + 0.5 * elevation.grid.row_size
        assert (corners.distance[0], corners.height[0]) == (pytest.approx(2.0), pytest.approx(2.0 * edge))
        assert corners.is_jump[corners.is_end].all()


def test_the_images_upper_border_is_no_end() -> None:
    assert len(corners_of([((2.0, -3.0), (2.0, 4.0))], top=0.3)) == 0
    # Seven or eight rows of nothing below it.
    elevation = scan([((2.0, -3.0), (2.0, 0.5))], num_strips=1)
    for kept, is_found in ((MIN_NOTHING_ROWS - 1, False), (MIN_NOTHING_ROWS, True)):
        q = elevation.inverse_distance.copy()
        q[:] = 0.5
        q[len(q) - kept :] = 0.0
        corners = find_corners(replace(elevation, inverse_distance=q), noise=1e-4)
        assert bool(corners.is_end.any()) == is_found


@pytest.mark.parametrize(("angle_deg", "is_found"), [(30.0, False), (45.0, True), (90.0, True)])
def test_a_crease_bends_by_40_degrees_or_more(angle_deg: float, is_found: bool) -> None:
    assert np.degrees(MIN_CORNER) == pytest.approx(40.0)
    back = np.radians(90.0 - angle_deg)
    end = (1.5 + 1.5 * np.cos(back), -0.5 + 1.5 * np.sin(back))
    profile = [((1.5, -2.0), (1.5, -0.5)), ((1.5, -0.5), end)]
    assert (len(creases(profile)) == 1) == is_found


def test_a_crease_is_where_both_surfaces_meet() -> None:
    found = creases([((1.5, -2.0), (1.5, -0.503)), ((1.5, -0.503), (3.0, -0.503))])
    np.testing.assert_allclose(found, [[1.5, -0.503]], atol=0.002)


def test_a_nosing_that_overhangs_is_still_a_crease() -> None:
    # The lip hides the top of the riser; across it the surfaces are 40 mm apart.
    lip = [((1.54, -2.0), (1.54, -0.54)), ((1.5, -0.54), (1.5, -0.5)), ((1.5, -0.5), (3.0, -0.5))]
    found = creases(lip)
    assert np.abs(found - [1.5, -0.5]).max(axis=1).min() < 0.05


@pytest.mark.parametrize(("gap", "is_wall"), [(0.15, True), (0.25, False)])
def test_the_ramp_that_a_sensor_makes_of_a_jump_bends_once(gap: float, is_wall: bool) -> None:
    # Lines through pieces of the ramp are more than 70 mm apart, or bend where nothing does.
    level = -0.5 * (1.5 + gap) / 1.5
    wall = ((1.5 + gap, level - 0.5), (1.5 + gap, level + 0.5))
    tread = ((1.5 + gap, level), (3.0, level))
    elevation = scan([((1.5, -2.0), (1.5, -0.5)), wall if is_wall else tread], num_strips=1)
    q = np.convolve(np.pad(elevation.inverse_distance[:, 0], 3, mode="edge"), np.ones(3) / 3, mode="same")
    corners = find_corners(replace(elevation, inverse_distance=q[3:-3, None]), noise=1e-4)
    assert np.count_nonzero(~corners.is_jump) == 1


def crease_of_height(distance: float, height: float) -> Float64Array:
    """Creases of a riser of which only this much was measured, and the tread behind it."""
    profile = [((distance, -2.0), (distance, -0.5)), ((distance, -0.5), (distance + 2.0, -0.5))]
    elevation = scan(profile, num_strips=1)
    z = elevation.slope * distance
    q = np.where((z < -0.5 - height)[:, None], 0.0, elevation.inverse_distance)
    corners = find_corners(replace(elevation, inverse_distance=q), noise=1e-4)
    return places(corners, ~corners.is_jump)


@pytest.mark.parametrize(("distance", "rows"), [(1.3, 6), (2.0, 4), (2.6, 4)])
def test_seven_tenths_of_60_mm_of_a_surface_tell_its_inclination(distance: float, rows: int) -> None:
    # Whatever the distance: 60 mm are 9, 6 and 5 rows there, of which one may lie on the tread.
    assert rows == round(0.7 * round(0.06 / (ROW * distance)))
    assert len(crease_of_height(distance, (rows - 0.5) * ROW * distance)) == 1
    assert len(crease_of_height(distance, (rows - 1.5) * ROW * distance)) == 0


@pytest.mark.parametrize(("share", "is_found"), [(0.93, True), (1.07, False)])
def test_a_crease_whose_angle_is_known_to_14_degrees_counts(share: float, is_found: bool) -> None:
    # Six rows at 2 m: the inclination of a line through them, of noise 1, is off by the square root of 12/6³.
    limit = np.radians(14.0) * ROW * 0.5 / np.sqrt(12.0 / 6**3)
    elevation = scan([((2.0, -2.0), (2.0, -0.5)), ((2.0, -0.5), (4.0, -0.5))], num_strips=1)
    corners = find_corners(elevation, noise=share * limit)
    assert bool(np.any(~corners.is_jump)) == is_found


def test_surfaces_that_are_far_apart_do_not_meet_in_a_crease() -> None:
    # A riser, and a tread that begins 0.2 m behind it.
    apart = [((1.5, -2.0), (1.5, -0.7)), ((1.7, -0.7), (3.0, -0.7))]
    assert len(creases(apart)) == 0


def test_noise_that_hides_the_angle_leaves_no_crease() -> None:
    profile = [((1.5, -2.0), (1.5, -0.5)), ((1.5, -0.5), (3.0, -0.5))]
    elevation = scan(profile, num_strips=1)
    told = {noise: find_corners(elevation, noise=noise) for noise in (1e-4, 0.05)}
    assert np.count_nonzero(~told[1e-4].is_jump) == 1
    assert np.count_nonzero(~told[0.05].is_jump) == 0


def test_a_corner_knows_its_scan() -> None:
    elevation = scan([((2.0, -0.5), (2.0, 0.2)), ((3.0, -0.5), (3.0, 3.0))], num_strips=4)
    q = elevation.inverse_distance.copy()
    q[:, [0, 3]] = 1 / 3.0
    corners = find_corners(replace(elevation, inverse_distance=q), noise=1e-4)
    assert np.sort(corners.strip[corners.is_jump]).tolist() == [1, 2]
    assert corners.strip.dtype == np.int64


def edges_turned_by(angle_deg: float, num: int = 4, num_strips: int = 16) -> tuple[Elevation, Corners]:
    """Level edges that stand turned to the left by an angle, each seen in every scan."""
    slope = np.linspace(-1.0, 0.5, 300)
    grid = grid_of(slope, num_strips, spread=0.4)
    bearing = np.linspace(0.38, -0.38, num_strips)
    elevation = Elevation(grid=grid, bearing=bearing, inverse_distance=np.zeros((300, num_strips)))
    k, strip = (values.ravel() for values in np.mgrid[:num, :num_strips])
    # The edge's normal is turned by the angle: s·cos + t·sin = d, t = bearing·s.
    angle = np.radians(angle_deg)
    s = (1.2 + 0.3 * k) / (np.cos(angle) + bearing[strip] * np.sin(angle))
    corners = Corners(
        distance=s,
        height=-0.8 + 0.17 * k,
        strip=strip,
        is_jump=np.ones(len(s), bool),
        is_end=np.zeros(len(s), bool),
    )
    return elevation, corners


@pytest.mark.parametrize("angle_deg", [-50.0, -20.0, -3.0, 0.0, 7.0, 40.0, 60.0])
def test_edges_tell_how_far_they_are_turned(angle_deg: float) -> None:
    found = find_turns(*edges_turned_by(angle_deg), max_turns=1)
    assert np.degrees(found) == pytest.approx([angle_deg], abs=0.1)


def test_edges_seen_almost_end_on_tell_nothing() -> None:
    assert find_turns(*edges_turned_by(70.0), max_turns=1) == []


def test_edges_before_nothing_tell_nothing() -> None:
    elevation, corners = edges_turned_by(20.0)
    nothing = replace(corners, is_end=np.ones(len(corners), bool))
    assert find_turns(elevation, nothing, max_turns=1) == []


def both(first: Corners, second: Corners) -> Corners:
    return Corners(
        **{
            name: np.concatenate([getattr(first, name), getattr(second, name)])
            for name in ("distance", "height", "strip", "is_jump", "is_end")
        }
    )


def test_the_commonest_direction_of_edges_comes_first() -> None:
    elevation, many = edges_turned_by(10.0, num=5)
    _, few = edges_turned_by(-30.0, num=2)
    # On other levels, so that no pair is of both.
    mixed = both(many, replace(few, height=few.height + 1.5))
    assert np.degrees(find_turns(elevation, mixed, max_turns=3)[:2]) == pytest.approx([10.0, -30.0], abs=0.5)
    assert np.degrees(find_turns(elevation, mixed, max_turns=1)) == pytest.approx([10.0], abs=0.5)


def test_edges_that_slope_are_of_no_stairs() -> None:
    elevation, corners = edges_turned_by(0.0)
    sloping = replace(corners, height=corners.height + 0.03 * corners.strip)
    assert find_turns(elevation, sloping, max_turns=1) == []


def test_few_pairs_of_corners_tell_no_direction() -> None:
    for num_strips, is_told in ((3, False), (4, True)):
        # Three strips make three pairs, four make six.
        elevation, corners = edges_turned_by(5.0, num=1, num_strips=num_strips)
        close = replace(elevation, bearing=np.linspace(0.1, -0.1, num_strips))
        s = 1.2 / (np.cos(np.radians(5)) + close.bearing[corners.strip] * np.sin(np.radians(5)))
        found = find_turns(close, replace(corners, distance=s), max_turns=1)
        assert (len(found) == 1) == is_told
    assert 3 < MIN_PAIRS <= 6


def test_no_corners_tell_no_direction() -> None:
    elevation, corners = edges_turned_by(5.0)
    nothing = Corners(**{name: getattr(corners, name)[:0] for name in (
        "distance", "height", "strip", "is_jump", "is_end")})  # fmt: skip
    assert len(nothing) == 0
    assert find_turns(elevation, nothing, max_turns=2) == []
