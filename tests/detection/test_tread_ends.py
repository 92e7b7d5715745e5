"""Where treads seen from above end, from all pixels on their level."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, nosings, pose_looking
from solid_scenes import frame_of, stairs_solid
from stairmap.config import Config
from stairmap.detection.detector import StairEdgeDetector
from stairmap.detection.stair_pixels import StairPixels
from stairmap.detection.tread_ends import find_tread_ends
from stairmap.simulation.triangle_mesh import make_rectangle, make_wall
from stairmap.transforms import transform_points

LATTICE = {"distance": 2.0, "height": -1.0, "run": -0.28, "rise": 0.17, "num_nosings": 4}
PIXEL = 1 / 260


def level_pixels(near: float, far: float, height: float, num_columns: int = 48) -> StairPixels:
    """Pixels of a level surface in rows of one pixel, in 48 columns."""
    slopes = np.arange(height / near, height / far, PIXEL)
    slopes = slopes[height / slopes <= far]
    s = np.repeat(height / slopes, num_columns).astype(np.float32)
    column = np.tile(np.arange(num_columns), len(slopes))
    return StairPixels(
        forward=s,
        height=np.full(len(s), height, np.float32),
        left=(s * (column - 24) * PIXEL).astype(np.float32),
        row=np.repeat(np.arange(len(slopes))[::-1], num_columns),
        column=column,
    )


def test_a_tread_ends_within_a_row_of_its_nosing() -> None:
    # Tread 1 lies at -0.83 m and ends at its nosing, 1.72 m away.
    ends = find_tread_ends(level_pixels(1.5, 1.72, -0.83), **LATTICE, row_step=1, pixel_size=PIXEL)
    assert len(ends) == 3
    row = 1.72**2 / 0.83 * PIXEL
    np.testing.assert_allclose(ends[:, 0], 1.72, atol=0.5 * row + 1e-4)
    np.testing.assert_allclose(ends[:, 1], -0.83, atol=1e-6)


def test_a_floor_does_not_end_at_a_nosing() -> None:
    ends = find_tread_ends(level_pixels(1.5, 4.0, -0.83), **LATTICE, row_step=1, pixel_size=PIXEL)
    assert (np.abs(ends[:, 0] - 1.72) > 0.1).all()


def test_what_lies_on_no_level_has_no_end() -> None:
    ends = find_tread_ends(level_pixels(1.5, 1.72, -0.915), **LATTICE, row_step=1, pixel_size=PIXEL)
    assert ends.shape == (0, 3)


@pytest.mark.parametrize("walls", [False, True])
def test_a_low_camera_sees_the_lower_steps_of_stairs_that_go_down(walls: bool) -> None:
    stairs = AnalyticStairs(rise=0.17, run=0.28, width=1.1, num_risers=14)
    top = nosings(stairs)[-1].mean(axis=0)
    pose = pose_looking((top[0] + 0.25, 0.0, top[2] + 0.3), yaw=np.pi, down=np.radians(20))
    solids = [stairs_solid(stairs), make_rectangle((-9, -9), (9, 9), 0.0)]
    if walls:
        solids += [make_wall((-1.0, y), (4.0, y), 0.0, 4.0) for y in (-0.6, 0.6)]
    detection = StairEdgeDetector(Config()).detect(frame_of(solids, pose))
    assert len(detection.observations) == 1, [str(reason) for reason in detection.rejections]
    observation = detection.observations[0]
    assert observation.view == "descending"
    assert observation.num_steps >= 6
    assert (observation.rise, observation.run) == pytest.approx((0.17, 0.28), abs=0.003)
    # Its edges lie on nosings, and none is made up.
    true = nosings(stairs).mean(axis=1)
    for edge in observation.edges:
        place = transform_points(pose, edge.nosing).mean(axis=0)
        assert np.min(np.linalg.norm(true[:, [0, 2]] - place[[0, 2]], axis=1)) < 0.03
