"""Solid shapes for the page."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.visualization.solid_shapes import SLAB, ascent_arrows, bars, stairway_solid


def volume(triangles):
    return np.einsum("ij,ij->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6


def test_steps_reach_from_the_floor_to_the_last_tread(stairway, flight):
    points = stairway_solid(stairway).reshape(-1, 3)
    local = (points - flight.base) @ flight.map_from_flight[:3, :3]
    assert local[:, 2].min() == pytest.approx(0, abs=1e-9)
    assert local[:, 2].max() == pytest.approx(flight.num_risers * flight.rise)
    assert np.ptp(local[:, 1]) == pytest.approx(flight.width)
    assert local[:, 0].max() == pytest.approx((flight.num_risers - 0.5) * flight.run)


def test_every_nosing_is_an_edge_of_the_solid(stairway):
    corners = {tuple(point) for point in np.round(stairway_solid(stairway).reshape(-1, 3), 6)}
    for end in np.round(stairway.edges().reshape(-1, 3), 6):
        assert tuple(end) in corners


def test_landing_is_a_slab_of_its_size(turning_stairway, stairway):
    (landing,) = turning_stairway.landings
    solid = stairway_solid(turning_stairway)
    flights_only = sum(12 * flight.num_risers for flight in turning_stairway.flights)
    slab = solid[flights_only:]
    assert abs(volume(slab)) == pytest.approx(landing.size[0] * landing.size[1] * SLAB)
    assert slab[..., 2].max() == pytest.approx(landing.center[2])


def test_bars_follow_their_segments():
    segments = np.array([[[0, 0, 0], [2, 0, 0]], [[0, 0, 0], [0, 0, 3]], [[1, 1, 1], [1, 1, 1]]], dtype=float)
    solid = bars(segments, thickness=0.02)
    assert len(solid) == 24
    assert abs(volume(solid[:12])) == pytest.approx(2 * 0.02**2)
    assert abs(volume(solid[12:])) == pytest.approx(3 * 0.02**2)


def test_nothing_makes_no_shapes():
    assert bars(np.empty((0, 2, 3)), thickness=0.1).shape == (0, 3, 3)
    assert ascent_arrows(()).shape == (0, 3, 3)
