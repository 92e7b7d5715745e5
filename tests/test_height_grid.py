"""Points of a grid of heights."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.height_grid import MIN_FACE, PLATE_STEP, HeightGrid
from stairmap.transforms import transform_from_parts


def test_cells_are_plates_and_steps_have_faces() -> None:
    heights = np.array([[0.0, 0.0], [0.2, np.nan]])
    grid = HeightGrid(stamp_ns=0, heights=heights, resolution=0.04, map_from_grid=np.eye(4))
    points = grid.points()
    level = points[np.isin(points[:, 2], np.float32([0.0, 0.2]))]
    assert len(level) == 3 * 4
    assert not np.any((points[:, 0] > 0.04) & (points[:, 1] > 0.04))
    face = points[(points[:, 2] > 0.001) & (points[:, 2] < 0.199)]
    np.testing.assert_allclose(face[:, 0], 0.04)
    assert np.all(face[:, 1] < 0.04)
    assert np.diff(np.unique(face[:, 2].round(6))).max() <= PLATE_STEP + 1e-6
    assert len(np.unique(face[:, 2])) >= 10


@pytest.mark.parametrize(
    ("step", "has_face"), [(MIN_FACE - 0.002, False), (MIN_FACE + 0.002, True), (3.2, False)]
)
def test_noise_and_walls_make_no_faces(step: float, has_face: bool) -> None:
    heights = np.array([[0.0, step]])
    grid = HeightGrid(stamp_ns=0, heights=heights, resolution=0.02, map_from_grid=np.eye(4))
    assert (len(grid.points()) > 2) == has_face


def test_points_and_the_middle_are_in_the_map() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    pose = transform_from_parts(turn, [5.0, 1.0, 0.0])
    heights = np.full((10, 20), 0.3)
    grid = HeightGrid(stamp_ns=0, heights=heights, resolution=0.1, map_from_grid=pose)
    points = grid.points()
    np.testing.assert_allclose(points.min(axis=0), [3.0, 1.0, 0.3], atol=0.02)
    np.testing.assert_allclose(points.max(axis=0), [5.0, 2.0, 0.3], atol=0.02)
    np.testing.assert_allclose(grid.map_from_middle[:3, 3], [4.0, 1.5, 0.3], atol=1e-6)


def test_a_grid_without_a_cell_has_no_points() -> None:
    grid = HeightGrid(stamp_ns=0, heights=np.full((4, 4), np.nan), resolution=0.1, map_from_grid=np.eye(4))
    assert grid.points().shape == (0, 3)
    assert grid.map_from_middle[2, 3] == 0.0


@pytest.mark.parametrize(("shape", "resolution"), [((4,), 0.1), ((4, 4), 0.0), ((4, 4), np.nan)])
def test_what_is_no_grid_is_refused(shape: tuple[int, ...], resolution: float) -> None:
    with pytest.raises(ValueError, match="expected a grid of heights"):
        HeightGrid(stamp_ns=0, heights=np.zeros(shape), resolution=resolution, map_from_grid=np.eye(4))
