"""A robot on wheels that comes to a dock: mask, obstacles, floor and drop, as Nav2 hears them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ros_environment import Drive, RosEnvironment

from analytic_stairs import pose_looking
from drop_scenes import dock
from ideal_observations import make_flight
from solid_scenes import frame_of

pytestmark = pytest.mark.usefixtures("wheels")

CAMERA_HEIGHT, DEPTH = 0.6, 0.8


@pytest.fixture
def drive(tmp_path: Path) -> Drive:
    """From 2.6 to 0.9 m before the edge of a dock at x = 0."""
    poses = [
        pose_looking((-distance, 0.0, CAMERA_HEIGHT), down=np.radians(25.0))
        for distance in np.linspace(2.6, 0.9, 25)
    ]
    frames = [frame_of([dock(DEPTH)], pose, has_up=False) for pose in poses]
    camera = frames[0].camera
    depth = [np.nan_to_num(frame.depth * 1000.0) for frame in frames]
    np.savez(
        tmp_path / "dock.npz",
        depth=np.rint(depth).astype(np.uint16),
        map_from_camera=poses,
        intrinsics=[camera.fx, camera.fy, camera.cx, camera.cy],
    )
    return Drive(tmp_path / "dock.npz", make_flight())


def test_a_dock_is_told_as_nav2_hears_it(ros: RosEnvironment) -> None:
    ros.start_node()
    (outcome,) = ros.run_robot([{}])
    assert outcome["answered"]
    heard = outcome["planner"]
    front = [drop for drop in heard["drops"] if abs(drop["left"][0]) < 0.08 and abs(drop["right"][0]) < 0.08]
    assert len(front) == 1, heard["drops"]
    assert front[0]["depth"] == pytest.approx(DEPTH, abs=0.06)
    (floor,) = heard["floors"]
    assert floor["height"] == pytest.approx(0.0, abs=0.03)
    assert heard["current_floor"] == floor["id"]
    for mask in (heard["masks"]["current"], heard["masks"][f"floor {floor['id']}"]):
        assert mask["frame_id"] == "map"
        assert mask["values"] == [-1, 100]
        forbidden = np.array(mask["forbidden"])
        before_edge = forbidden[np.abs(forbidden[:, 1]) < 0.2, 0]
        assert before_edge.min() < -0.27
        assert before_edge.max() > 0.0
    assert "first_obstacles" in heard
    first, last = np.array(heard["first_obstacles"]), np.array(heard["obstacles"])
    for points in (first, last):
        near = points[np.abs(points[:, 1]) < 0.3]
        assert len(near) > 10
        assert np.abs(near[:, 0]).max() < 0.15
        assert 0.0 < near[:, 2].min() < near[:, 2].max() < 0.4
