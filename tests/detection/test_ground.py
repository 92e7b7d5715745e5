"""The ground in one frame: which level is it, how high is the camera above it, and where was it seen."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import pose_looking
from solid_scenes import FLOOR, frame_of
from stairmap.detection.ground import GroundSamples, sample_ground
from stairmap.detection.inverse_depth import inverse_depth_from_frame
from stairmap.geometry import normalized
from stairmap.simulation.triangle_mesh import TriangleMesh, make_rectangle, make_wall


def ground_of(
    *solids: TriangleMesh,
    height: float = 0.7,
    down: float = 0.4,
    roll: float = 0.0,
    slope: tuple[float, float] = (0.0, 0.0),
    camera_height: float | None = None,
) -> GroundSamples | None:
    """The ground before a camera; ``slope`` is how much the given up leans forward and to the left."""
    pose = pose_looking((0.0, 0.0, height), down=down, roll=roll)
    image = inverse_depth_from_frame(frame_of(solids or [FLOOR], pose), max_depth=6.0)
    up = pose[:3, :3].T @ normalized([slope[0], slope[1], 1.0])
    return sample_ground(image, up, camera_height=camera_height)


@pytest.mark.parametrize(
    ("height", "is_found"), [(0.11, False), (0.13, True), (0.7, True), (2.18, True), (2.24, False)]
)
def test_a_camera_is_12_cm_to_2_2_m_above_its_ground(height: float, is_found: bool) -> None:
    found = ground_of(height=height, down=0.15 if height < 0.5 else 0.5)
    assert (found is not None) == is_found
    if found is not None:
        assert found.view.height == pytest.approx(height, abs=0.004)


@pytest.mark.parametrize(
    ("off", "is_found"), [(0.095, True), (-0.095, True), (0.105, False), (-0.105, False)]
)
def test_ground_lies_within_10_cm_of_what_is_known_of_it(off: float, is_found: bool) -> None:
    assert (ground_of(height=0.7, camera_height=0.7 + off) is not None) == is_found


@pytest.mark.parametrize(
    ("slope", "is_found"),
    [
        ((0.13, 0.0), True),
        ((-0.13, 0.0), True),
        ((0.15, 0.0), False),
        ((0.0, 0.13), True),
        ((0.0, 0.15), False),
    ],
)
def test_ground_slopes_by_14_percent_at_most(slope: tuple[float, float], is_found: bool) -> None:
    found = ground_of(slope=slope, down=0.6)
    assert (found is not None) == is_found
    if found is not None:
        # The plane that was found is the floor, however up leaned.
        true_up = pose_looking((0.0, 0.0, 0.7), down=0.6)[2, :3]
        np.testing.assert_allclose(found.view.up, true_up, atol=0.02)
        assert found.view.height == pytest.approx(0.7, abs=0.02)


def test_axes_of_the_ground_are_perpendicular_and_look_ahead() -> None:
    found = ground_of(slope=(0.05, -0.06), roll=0.2)
    assert found is not None
    view = found.view
    axes = np.stack([view.forward, view.left, view.up])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert view.forward[2] > 0.8
    assert (np.diff(view.bearing) < 0).all()


@pytest.mark.parametrize("height", [0.4, 1.1])
def test_rays_cross_the_ground_where_they_meet_the_floor(height: float) -> None:
    found = ground_of(height=height)
    assert found is not None
    assert (np.diff(found.crossing, axis=0) > 0).all()
    near = found.crossing < 3.0
    assert np.nanmax(np.abs(found.height[near])) < 0.01
    # Every fifth column of 320, from the third on.
    assert found.crossing.shape[1] == len(found.view.bearing) == 64


def test_ground_is_seen_in_eighths_of_a_metre_as_far_as_it_goes() -> None:
    # A wall 1.6 m ahead.
    found = ground_of(FLOOR, make_wall((1.6, -5.0), (1.6, 5.0), 0.0, 3.0), down=0.5)
    assert found is not None
    seen = found.view.is_seen
    assert seen.shape == (64, 32)
    middle = seen[32]
    first = int(np.argmax(middle))
    assert middle[first:12].all()
    # A hand above the foot of the wall still counts.
    assert not seen[:, 14:].any()


def test_what_lies_lower_behind_an_edge_does_not_tilt_the_ground() -> None:
    lower = make_rectangle((1.3, -5), (6, 5), -0.1)
    found = ground_of(make_rectangle((-3, -5), (1.3, 5), 0.0), lower, height=0.8, down=0.55)
    assert found is not None
    assert found.view.height == pytest.approx(0.8, abs=0.006)
    true_up = pose_looking((0.0, 0.0, 0.8), down=0.55)[2, :3]
    np.testing.assert_allclose(found.view.up, true_up, atol=0.01)


def test_a_camera_that_looks_up_sees_no_ground() -> None:
    assert ground_of(FLOOR, make_wall((2.0, -5), (2.0, 5), 0.0, 4.0), down=-0.6) is None
