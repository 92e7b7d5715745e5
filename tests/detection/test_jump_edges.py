"""Nosings that show as jumps of depth: above the camera, from above, and without risers."""

from __future__ import annotations

import numpy as np
import pytest

from side_profiles import Profile, descending_profile, scan, stairs_profile
from stairmap.arrays import Float64Array
from stairmap.detection.crease_edges import find_creases
from stairmap.detection.elevation import Elevation
from stairmap.detection.jump_edges import find_riser_tops, find_tread_fronts
from stairmap.detection.profile_segments import ProfileSegments, find_segments, label_cells

BACK_WALL = ((5.0, -3.0), (5.0, 4.0))


def seen(profile: Profile, noise: float = 0.0) -> tuple[Elevation, ProfileSegments]:
    elevation = scan(profile, noise=noise, num_strips=1)
    told = max(noise, 1e-4)
    return elevation, find_segments(elevation, label_cells(elevation, noise=told), noise=told)


def riser_tops(profile: Profile, noise: float = 0.0) -> Float64Array:
    elevation, segments = seen(profile, noise)
    _, in_crease = find_creases(segments)
    found = find_riser_tops(elevation, segments, in_crease[:, 0])
    return found[np.argsort(found[:, 0])]


def tread_fronts(profile: Profile, view_sign: int, noise: float = 0.0) -> Float64Array:
    elevation, segments = seen(profile, noise)
    _, in_crease = find_creases(segments)
    found = find_tread_fronts(elevation, segments, in_crease[:, 1], view_sign=view_sign)
    return found[np.argsort(found[:, 0])]


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_riser_tops_are_the_nosings_above_the_camera_within_a_row(noise: float) -> None:
    tops = riser_tops([*stairs_profile(distance=1.5, height=-0.05, num=4), BACK_WALL], noise)
    row = 1.65 / 330
    np.testing.assert_allclose(tops[-3:, 0], 1.5 + 0.28 * np.arange(1, 4), atol=0.01)
    np.testing.assert_allclose(tops[-3:, 1], -0.05 + 0.17 * np.arange(1, 4), atol=2.5 * row)


def test_the_top_of_a_wall_before_nothing_is_no_nosing() -> None:
    assert len(riser_tops([((2.0, -0.5), (2.0, 0.2))])) == 0


def test_the_top_of_a_wall_before_something_5_cm_farther_is_no_nosing() -> None:
    assert len(riser_tops([((2.0, -0.5), (2.0, 0.2)), ((2.05, 0.0), (2.05, 3.0))])) == 0


def test_risers_in_a_crease_have_no_top_of_their_own() -> None:
    elevation, segments = seen([*stairs_profile(distance=1.0, height=-0.9, num=4), BACK_WALL])
    creases, in_crease = find_creases(segments)
    tops = find_riser_tops(elevation, segments, in_crease[:, 0])
    for top in tops:
        assert np.abs(creases[:, :2] - top[:2]).max(axis=1).min() > 0.05


@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_tread_fronts_of_descending_stairs_are_where_treads_end(noise: float) -> None:
    fronts = tread_fronts(descending_profile(distance=0.9, height=-0.8, num=4), -1, noise)
    # The upper floor's end and those of the treads that are in view over the edge before them.
    np.testing.assert_allclose(fronts[:3, 0], 0.9 + 0.28 * np.arange(3), atol=0.03)
    np.testing.assert_allclose(fronts[:3, 1], -0.8 - 0.17 * np.arange(3), atol=0.02)


def test_treads_without_risers_begin_where_one_looks_through_beneath_them() -> None:
    profile = stairs_profile(distance=1.0, height=-0.75, num=4, has_risers=False, floor=False)
    fronts = tread_fronts([*profile, ((0.05, -1.0), (6.0, -1.0))], 1)
    assert len(fronts) >= 3
    np.testing.assert_allclose(np.diff(fronts[:3, 0]), 0.28, atol=0.03)
    np.testing.assert_allclose(np.diff(fronts[:3, 1]), 0.17, atol=0.015)


def test_a_floor_that_ends_at_a_wall_has_no_front() -> None:
    profile = [((0.05, -0.8), (2.0, -0.8)), ((2.0, -0.8), (2.0, 3.0))]
    assert len(tread_fronts(profile, -1)) == 0
    assert len(tread_fronts(profile, 1)) == 0


def test_nothing_in_view_has_no_nosings() -> None:
    assert riser_tops([]).shape == (0, 3)
    assert tread_fronts([], 1).shape == (0, 3)
