"""A nosing below the camera is where a riser's distance meets a tread's height."""

from __future__ import annotations

import numpy as np
import pytest

from side_profiles import Profile, scan, stairs_profile
from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.crease_edges import find_creases
from stairmap.detection.profile_segments import RISER, TREAD, find_segments, label_cells


def creases_of(profile: Profile, *, noise: float = 0.0) -> tuple[Float64Array, IntArray, IntArray]:
    """Creases of strip 0, and the kinds of the segments that make them."""
    elevation = scan(profile, noise=noise)
    told = max(noise, 1e-4)
    segments = find_segments(elevation, label_cells(elevation, noise=told), noise=told)
    nosings, pairs = find_creases(segments)
    mine = nosings[:, 2] == 0
    return nosings[mine], segments.kind[pairs[mine, 0]], segments.kind[pairs[mine, 1]]


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_creases_are_the_nosings_of_steps_below_the_camera(noise: float) -> None:
    nosings, lower, upper = creases_of(stairs_profile(distance=1.0, height=-0.9, num=5), noise=noise)
    assert (lower == RISER).all()
    assert (upper == TREAD).all()
    index = np.arange(5)
    found = nosings[:, :2][np.argsort(nosings[:, 0])]
    np.testing.assert_allclose(found[:4, 0], (1.0 + 0.28 * index)[:4], atol=0.015)
    np.testing.assert_allclose(found[:4, 1], (-0.9 + 0.17 * index)[:4], atol=0.015)


def test_a_nosing_that_overhangs_by_30_mm_is_still_a_crease() -> None:
    profile = list(stairs_profile(distance=1.0, height=-0.9, num=4))
    for index in range(4):
        s, z = 1.0 + 0.28 * index, -0.9 + 0.17 * index
        profile += [((s - 0.03, z - 0.03), (s - 0.03, z)), ((s - 0.03, z), (s, z))]
    nosings, _, _ = creases_of(profile)
    assert len(nosings) >= 3


def test_a_wall_that_stands_on_the_floor_is_no_crease() -> None:
    nosings, _, _ = creases_of([((0.1, -0.8), (2.0, -0.8)), ((2.0, -0.8), (2.0, 3.0))])
    assert len(nosings) == 0


def test_a_riser_above_the_camera_makes_no_crease() -> None:
    nosings, _, _ = creases_of(stairs_profile(distance=1.5, height=0.2, num=4))
    assert len(nosings) == 0


def test_a_floor_seen_over_a_low_wall_is_no_crease() -> None:
    # The wall's top is at 1 m, what is seen past it begins half a metre behind.
    nosings, _, _ = creases_of([((1.0, -0.9), (1.0, -0.5)), ((1.2, -0.75), (6.0, -0.75))])
    assert len(nosings) == 0
