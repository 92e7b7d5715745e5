"""Frames as viewers show them."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.observation import Rejection
from stairmap.transforms import transform_points
from stairmap.visualization.frame_view import FrameView, frame_view_from_detection, level_from_camera


@pytest.fixture
def seen(views):
    view = views[4]
    return frame_view_from_detection(4, view.frame, view.map_from_camera, view.detection)


def test_stair_edges_lie_on_the_nosings_of_the_map(seen, flight):
    edges = seen.map_edges()
    assert len(edges) >= 3
    nosings = flight.edges().mean(axis=1)
    for middle in edges.mean(axis=1):
        offsets = nosings - middle
        across = offsets @ [[flight.forward[0], 0], [flight.forward[1], 0], [0, 1]]
        assert np.linalg.norm(across, axis=1).min() < 0.05


def test_cloud_is_thinned_evenly_and_lies_where_depth_says(seen):
    thinned = seen.camera_points(max_points=2000)
    assert 500 < len(thinned) <= 2000
    all_points = seen.frame.points().reshape(-1, 3)
    wanted = {tuple(point) for point in np.round(all_points[np.isfinite(all_points[:, 2])], 6)}
    assert all(tuple(point) in wanted for point in np.round(thinned, 6))


def test_line_of_a_frame_tells_measures_or_reasons(seen):
    assert seen.describe().startswith("frame 4: ascending, ")
    assert "rise 1" in seen.describe()
    rejection = Rejection(rule="min_steps", measured=1.0, limit=3.0, unit="1")
    empty = FrameView(
        number=7, stamp_ns=0, map_from_camera=np.eye(4), observations=(), rejections=(rejection,)
    )
    assert empty.describe() == "frame 7: no stairs; min_steps: 1, limit 3"
    assert empty.map_edges().shape == (0, 2, 3)
    assert empty.camera_points(max_points=10).shape == (0, 3)


@pytest.mark.parametrize("up", [None, [0, -1, 0], [0.3, -0.9, -0.2], [0, 0, 1], [0, 0, -1]])
def test_without_a_pose_the_camera_looks_along_x_with_gravity_down(up):
    pose = level_from_camera(None if up is None else np.array(up, dtype=float))
    rotation = pose[:3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1)
    direction = np.array([0, -1, 0] if up is None else up, dtype=float)
    assert np.allclose(rotation @ direction / np.linalg.norm(direction), [0, 0, 1])
    ahead = transform_points(pose, np.array([[0.0, 0.0, 1.0]]))[0]
    assert ahead[0] >= -1e-9
    assert ahead[1] == pytest.approx(0, abs=1e-9)
