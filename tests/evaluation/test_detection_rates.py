"""Heat maps reach as far as they say, and no camera stands in a wall."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from stairmap.evaluation.detection_rates import QUICK_GRID, RateGrid, make_stages, measure_panel


def test_the_grid_goes_to_six_metres() -> None:
    assert max(RateGrid().distances) == 6.0
    assert np.diff(RateGrid().distances) == pytest.approx(np.full(11, 0.5))


def test_cameras_stand_in_the_room_at_every_cell() -> None:
    stairs, look_alikes = make_stages(seed=0)
    random, grid = np.random.default_rng(0), RateGrid()
    for distance, angle in product(grid.distances, grid.angles):
        for stage in stairs:
            eye = stage.sample_pose(distance, angle, 1.3, random)[:3, 3]
            assert stage.caster.is_visible(eye, np.array([[-2.0, 0.0, 1.0]]))[0], (distance, angle)
        for stage in look_alikes:
            eye = stage.sample_pose(distance, angle, 1.3, random)[:3, 3]
            assert (np.abs(eye[:2] - [-0.5, 0.0]) < [5.5, 4.0]).all()


def test_stairs_are_recalled_near_and_not_where_no_sensor_reaches() -> None:
    (panel,) = measure_panel(QUICK_GRID, ("kinect_v1", 160), 0.45, ("stairmap",))
    assert panel.recall.shape == (2, 3)
    assert panel.recall[0, 0] == 1.0
    assert panel.false_rate.max() == 0.0
