"""Scans fall into treads and risers."""

from __future__ import annotations

import numpy as np
import pytest

from side_profiles import scan, stairs_profile
from stairmap.detection.elevation import Elevation
from stairmap.detection.profile_segments import (
    NOTHING,
    RISER,
    TREAD,
    ProfileSegments,
    find_segments,
    is_kind,
    label_cells,
)

NOISE = 5e-4


def segments_of(elevation: Elevation, noise: float = NOISE) -> ProfileSegments:
    return find_segments(elevation, label_cells(elevation, noise=noise), noise=noise)


def labels_at(elevation: Elevation, slopes: list[float], noise: float = NOISE) -> list[int]:
    labels = label_cells(elevation, noise=noise)[:, 0]
    return [int(labels[np.argmin(np.abs(elevation.slope - slope))]) for slope in slopes]


def test_stairs_below_the_camera_are_labelled_riser_and_tread_in_turn() -> None:
    elevation = scan(stairs_profile(distance=1.0, height=-0.9))
    slopes = []
    for index in range(4):
        s, z = 1.0 + 0.28 * index, -0.9 + 0.17 * index
        slopes += [(z - 0.085) / s, z / (s + 0.14)]
    assert labels_at(elevation, slopes[2:]) == [RISER, TREAD] * 3


def test_a_wall_is_a_riser_and_a_floor_a_tread() -> None:
    elevation = scan([((0.1, -0.8), (2.0, -0.8)), ((2.0, -0.8), (2.0, 3.0))])
    assert labels_at(elevation, [0.3, 0.0, -0.2, -0.5, -0.7]) == [RISER, RISER, RISER, TREAD, TREAD]


@pytest.mark.parametrize("angle_deg", [28.0, 35.0, 45.0, 55.0])
def test_a_slope_is_neither_tread_nor_riser(angle_deg: float) -> None:
    far = 3.0
    elevation = scan([((0.1, -0.8), (far, -0.8 + (far - 0.1) * np.tan(np.radians(angle_deg))))])
    assert set(label_cells(elevation, noise=NOISE)[5:-5, 0]) == {NOTHING}


def test_what_is_level_above_the_camera_is_no_tread() -> None:
    elevation = scan([((0.1, 0.4), (9.0, 0.4))])
    assert TREAD not in label_cells(elevation, noise=NOISE)


def test_cells_without_a_measurement_get_no_label_even_where_there_is_no_noise() -> None:
    elevation = scan([((2.0, -0.6), (2.0, 0.2))])
    assert (elevation.inverse_distance == 0).any()
    labels = label_cells(elevation, noise=0.0)
    assert not labels[elevation.inverse_distance == 0].any()
    assert labels_at(elevation, [0.0, -0.2], noise=0.0) == [RISER, RISER]


def test_noise_of_a_sensor_leaves_labels_of_steps_at_2_m() -> None:
    # 3 mm at 2 m, as a Kinect's strip of 16 columns has.
    elevation = scan(stairs_profile(distance=1.6, height=-0.7), noise=NOISE, num_strips=20)
    labels = label_cells(elevation, noise=NOISE)
    row = int(np.argmin(np.abs(elevation.slope - (-0.7 + 0.085) / 1.88)))
    assert (labels[row] == RISER).mean() > 0.9


def test_segments_measure_each_step() -> None:
    segments = segments_of(scan(stairs_profile(distance=1.0, height=-0.9)))
    first = segments.strip == 0
    risers = segments.distance[first & is_kind(segments, RISER)]
    treads = segments.height[first & is_kind(segments, TREAD)]
    np.testing.assert_allclose(risers[:6], 1.0 + 0.28 * np.arange(6), atol=0.012)
    # The floor, then the treads of which enough rows are in view.
    np.testing.assert_allclose(treads[:5], -1.07 + 0.17 * np.arange(5), atol=0.012)


def test_segments_go_from_low_rays_to_high_ones_within_each_strip() -> None:
    elevation = scan(stairs_profile(distance=1.0, height=-0.9), num_strips=4)
    segments = segments_of(elevation)
    assert len(segments) % 4 == 0
    assert (np.diff(segments.strip) >= 0).all()
    assert (segments.first_row >= segments.last_row).all()
    same = np.diff(segments.strip) == 0
    assert (segments.first_row[1:] < segments.last_row[:-1])[same].all()
    assert (segments.num_rows == segments.first_row - segments.last_row + 1).all()
    for low, middle, high in (
        (segments.near, segments.distance, segments.far),
        (segments.low, segments.height, segments.high),
    ):
        assert (low <= middle + 1e-4).all()
        assert (middle <= high + 1e-4).all()


def test_risers_one_above_the_other_with_no_tread_in_view_are_separate() -> None:
    segments = segments_of(scan(stairs_profile(distance=1.5, height=0.1, num=4)))
    risers = segments.distance[(segments.strip == 0) & is_kind(segments, RISER)]
    np.testing.assert_allclose(risers, 1.5 + 0.28 * np.arange(len(risers)), atol=0.02)
    assert len(risers) == 4


def test_two_walls_one_behind_the_other_are_two_segments() -> None:
    segments = segments_of(scan([((2.0, -3.0), (2.0, 0.0)), ((2.2, -3.0), (2.2, 3.0))]))
    risers = segments.distance[(segments.strip == 0) & is_kind(segments, RISER)]
    np.testing.assert_allclose(risers, [2.0, 2.2], atol=0.005)


def test_an_empty_elevation_has_no_segments() -> None:
    assert len(segments_of(scan([]))) == 0
