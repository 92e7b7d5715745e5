"""Ray casting agrees with geometry."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from stairmap.camera import PinholeCamera
from stairmap.errors import MissingPackageError
from stairmap.simulation.render import RayCaster
from stairmap.simulation.robots import ROBOTS, camera_poses
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block, make_rectangle, make_wall

CAMERA = PinholeCamera(width=320, height=240, fx=292, fy=292, cx=159.5, cy=119.5)


def pose(x: float = 0.0, y: float = 0.0, heading: float = 0.0, pitch: float = 0.0) -> np.ndarray:
    robot = ROBOTS["packbot"]
    return camera_poses(np.array([[x, y, 0.0, heading]]), np.array([[0.02, pitch, 0.0]]), robot)[0]


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (400.0, -900.0, 120.0)])
def test_ideal_depth_agrees_with_the_exact_plane_to_a_tenth_of_a_millimetre(
    origin: tuple[float, ...],
) -> None:
    floor = make_rectangle((-60, -60), (60, 60), 0.0)
    shift = np.eye(4)
    shift[:3, 3] = origin
    caster = RayCaster(floor.transformed(shift))
    map_from_camera = shift @ pose(pitch=0.3, heading=0.7)
    rendering = caster.render(CAMERA, map_from_camera)
    down = CAMERA.rays() @ map_from_camera[2, :3]
    exact = -(map_from_camera[2, 3] - origin[2]) / down
    seen = np.isfinite(rendering.depth) & (exact < 20)
    assert seen.mean() > 0.7
    assert np.abs(rendering.depth - exact)[seen].max() < 1e-4


def test_incidence_and_normals_are_those_of_the_plane() -> None:
    caster = RayCaster(make_rectangle((-30, -30), (30, 30), 0.0))
    map_from_camera = pose(pitch=0.4)
    rendering = caster.render(CAMERA, map_from_camera)
    up = map_from_camera[2, :3]
    seen = np.isfinite(rendering.depth)
    np.testing.assert_allclose(rendering.normals[seen], np.broadcast_to(up, (seen.sum(), 3)), atol=1e-9)
    rays = CAMERA.rays() / np.linalg.norm(CAMERA.rays(), axis=-1, keepdims=True)
    np.testing.assert_allclose(rendering.incidence[seen], np.arccos(-(rays @ up))[seen], atol=1e-9)


def test_pixels_without_a_surface_are_nan() -> None:
    rendering = RayCaster(make_rectangle((-30, -30), (30, 30), 0.0)).render(CAMERA, pose())
    sky = np.isnan(rendering.depth)
    assert sky[:100].all()
    assert np.isnan(rendering.incidence[sky]).all()
    assert (rendering.triangle_ids[sky] == -1).all()


def test_a_lamp_aside_leaves_a_shadow_as_wide_as_triangulation_says() -> None:
    block = make_block((2.0, -0.5, 0.0), (2.1, 0.5, 2.0))
    caster = RayCaster(joined([block, make_wall((4, -5), (4, 5), -3, 5)]))
    level = camera_poses(np.array([[0, 0, 0, 0.0]]), np.zeros((1, 3)), ROBOTS["packbot"])[0]
    lit = caster.render(CAMERA, level).is_lit(np.array([0.075, 0.0, 0.0]))
    width = np.count_nonzero(~lit[120, :160])
    assert width == pytest.approx(CAMERA.fx * 0.075 * (1 / 2.0 - 1 / 4.0), abs=1.5)
    assert lit[120, 160:].all()


def test_a_point_behind_a_wall_is_not_visible() -> None:
    caster = RayCaster(make_wall((2, -5), (2, 5), -3, 5))
    visible = caster.is_visible(np.zeros(3), np.array([[1.5, 0, 0], [2.0, 0.3, 0.1], [3.0, 0, 0]]))
    assert visible.tolist() == [True, True, False]


def test_degenerate_triangles_do_no_harm() -> None:
    mesh = joined(
        [
            TriangleMesh(vertices=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]])),
            make_wall((2, -5), (2, 5), -3, 5),
        ]
    )
    rendering = RayCaster(mesh).render(CAMERA, pose())
    assert set(np.unique(rendering.triangle_ids)) == {1, 2}


def test_an_empty_scene_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one triangle"):
        RayCaster(joined([]))


def test_without_embreex_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("embreex"):
            raise ImportError(name)
        return imported(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(MissingPackageError, match=r"stairmap\[sim\]"):
        RayCaster(make_rectangle((0, 0), (1, 1), 0.0))
