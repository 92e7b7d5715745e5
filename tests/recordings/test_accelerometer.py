"""Up from an accelerometer."""

from __future__ import annotations

import numpy as np

from stairmap.recordings.accelerometer import UpFilter


def test_a_level_camera_at_rest_is_held_from_below():
    up = UpFilter()
    assert up.value is None
    up.add(np.array([0.0, -9.81, 0.0]))
    assert np.allclose(up.value, [0, -1, 0])


def test_noise_is_averaged():
    random = np.random.default_rng(0)
    up = UpFilter()
    for _ in range(100):
        up.add(np.array([0.0, -9.81, 0.0]) + 0.3 * random.normal(size=3))
    assert np.degrees(np.arccos(-up.value[1])) < 1.5


def test_readings_of_a_shaken_camera_are_left_out():
    up = UpFilter()
    up.add(np.array([0.0, -9.81, 0.0]))
    up.add(np.array([9.0, -9.81, 0.0]))
    up.add(np.array([0.0, 0.0, 0.0]))
    assert np.allclose(up.value, [0, -1, 0])


def test_readings_are_turned_into_the_axes_of_the_camera():
    camera_from_sensor = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    up = UpFilter(camera_from_sensor)
    up.add(np.array([9.81, 0.0, 0.0]))
    assert np.allclose(up.value, [0, -1, 0])
