"""A coarse lattice becomes a measured one: rise and run of noise-free renderings are exact to 1 mm."""

from __future__ import annotations

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from solid_scenes import frame_of, room, stairs_solid
from stairmap.arrays import Transform
from stairmap.detection.inverse_depth import fit_surface_normals, inverse_depth_from_frame
from stairmap.detection.lattice import Lattice
from stairmap.detection.orientation import level_axes
from stairmap.detection.refinement import RefinedLattice, refine_lattice
from stairmap.frame import DepthFrame
from stairmap.geometry import angle_between
from stairmap.simulation.triangle_mesh import TriangleMesh

STAIRS = AnalyticStairs(rise=0.17, run=0.28, width=1.4, num_risers=6)
ABOVE_ALL_STEPS = pose_looking((-0.9, 0.1, 1.4), yaw=0.05, down=0.45, roll=0.05)


def refine(
    frame: DepthFrame,
    pose: Transform,
    stairs: AnalyticStairs,
    *,
    error: float = 0.0,
    heading_error: float = 0.0,
    overhang: float = 0.0,
) -> RefinedLattice:
    """Refine the true lattice of stairs along the map's +x, wrong by ``error`` m in distance and height,
    less in run and rise, and turned by ``heading_error`` rad; its distances are those of the risers."""
    up = pose[2, :3].copy()
    _, left = level_axes(up)
    forward = pose[0, :3] + heading_error * left
    forward = forward - (forward @ up) * up
    forward /= np.linalg.norm(forward)
    image = inverse_depth_from_frame(frame, max_depth=6.0)
    x, _, z = pose[:3, 3]
    lattice = Lattice(
        distance=overhang - x + error,
        height=stairs.rise - z - error,
        run=stairs.run + 0.3 * error,
        rise=stairs.rise - 0.2 * error,
        indices=np.arange(stairs.num_risers),
        strips=np.ones(20, dtype=bool),
    )
    refined = refine_lattice(
        image,
        lattice,
        up,
        forward,
        np.zeros((0, 3)),
        noise=fit_surface_normals(image).noise,
        columns=(0, image.camera.width),
    )
    assert refined is not None
    return refined


def view(*solids: TriangleMesh, pose: Transform = ABOVE_ALL_STEPS) -> DepthFrame:
    return frame_of([*solids, room()], pose)


COARSE = pytest.param(
    0.01, marks=pytest.mark.xfail(reason="the first round's few rows miss a lattice that is 10 mm off")
)


@pytest.mark.parametrize("error", [0.0, 0.004, COARSE])
@pytest.mark.parametrize(
    "stairs",
    [
        STAIRS,
        AnalyticStairs(rise=0.10, run=0.36, width=1.0, num_risers=6),
        AnalyticStairs(rise=0.22, run=0.22, width=2.0, num_risers=5),
    ],
    ids=["usual", "shallow", "steep"],
)
def test_rise_and_run_are_exact_to_a_millimetre(stairs: AnalyticStairs, error: float) -> None:
    refined = refine(view(stairs_solid(stairs)), ABOVE_ALL_STEPS, stairs, error=error)
    assert refined.rise == pytest.approx(stairs.rise, abs=0.001)
    assert refined.run == pytest.approx(stairs.run, abs=0.001)


def test_the_lattice_lies_on_the_nosings() -> None:
    refined = refine(view(stairs_solid(STAIRS)), ABOVE_ALL_STEPS, STAIRS, error=0.004)
    index = np.rint((refined.distance - 0.9) / refined.run)
    assert refined.distance == pytest.approx(0.9 + index * STAIRS.run, abs=0.004)
    assert refined.height == pytest.approx(0.17 - 1.4 + index * STAIRS.rise, abs=0.004)


@pytest.mark.parametrize("rake", [0.02, 0.03])
def test_raked_risers_do_not_tilt_it(rake: float) -> None:
    frame = view(stairs_solid(STAIRS, rake=rake))
    refined = refine(frame, ABOVE_ALL_STEPS, STAIRS)
    assert refined.rise == pytest.approx(STAIRS.rise, abs=0.001)
    assert refined.run == pytest.approx(STAIRS.run, abs=0.0015)
    assert np.degrees(angle_between(refined.up, ABOVE_ALL_STEPS[2, :3])) < 0.2


@pytest.mark.parametrize("overhang", [0.015, 0.03])
def test_overhanging_nosings_do_not_tilt_it(overhang: float) -> None:
    frame = view(stairs_solid(STAIRS, overhang=overhang))
    refined = refine(frame, ABOVE_ALL_STEPS, STAIRS, overhang=overhang)
    assert refined.rise == pytest.approx(STAIRS.rise, abs=0.001)
    assert refined.run == pytest.approx(STAIRS.run, abs=0.001)
    assert np.degrees(angle_between(refined.up, ABOVE_ALL_STEPS[2, :3])) < 0.2


def test_a_heading_3_degrees_off_is_turned_square_to_the_risers() -> None:
    refined = refine(view(stairs_solid(STAIRS)), ABOVE_ALL_STEPS, STAIRS, heading_error=np.radians(3))
    assert np.degrees(angle_between(refined.forward, ABOVE_ALL_STEPS[0, :3])) < 0.1
    assert refined.run == pytest.approx(STAIRS.run, abs=0.001)


def test_axes_stay_perpendicular_unit_vectors() -> None:
    refined = refine(view(stairs_solid(STAIRS)), ABOVE_ALL_STEPS, STAIRS, heading_error=0.05)
    assert refined.up @ refined.forward == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(refined.up) == pytest.approx(1.0)
    assert np.linalg.norm(refined.forward) == pytest.approx(1.0)


def test_one_step_that_is_20_mm_too_high_pulls_rise_by_less_than_2_mm() -> None:
    odd = AnalyticStairs(rise=0.17, run=0.28, width=1.4, num_risers=1)
    raised = stairs_solid(odd).vertices.copy()
    raised[raised[:, 2] > 0, 2] += 0.02
    raised[raised[:, 0] > 0.1, 0] = 0.28
    shift = np.array([2 * 0.28, 0.0, 2 * 0.17])
    lump = TriangleMesh(vertices=raised + shift, triangles=stairs_solid(odd).triangles)
    refined = refine(view(stairs_solid(STAIRS), lump), ABOVE_ALL_STEPS, STAIRS)
    assert refined.rise == pytest.approx(STAIRS.rise, abs=0.002)
    assert refined.run == pytest.approx(STAIRS.run, abs=0.002)


def test_the_covariance_is_symmetric_and_positive() -> None:
    covariance = refine(view(stairs_solid(STAIRS)), ABOVE_ALL_STEPS, STAIRS).covariance
    assert covariance.shape == (6, 6)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-15)
    assert np.linalg.eigvalsh(covariance).min() > 0
    # Five steps with 4 mm of irregularity each tell rise and run to 1 or 2 mm.
    assert 0.0003 < np.sqrt(covariance[0, 0]) < 0.004
    assert 0.0003 < np.sqrt(covariance[1, 1]) < 0.004


def test_a_lattice_on_nothing_is_refused() -> None:
    image = inverse_depth_from_frame(view(stairs_solid(STAIRS)), max_depth=6.0)
    lattice = Lattice(
        distance=1.0, height=1.0, run=0.28, rise=0.17, indices=np.arange(3), strips=np.ones(20, bool)
    )
    up, forward = ABOVE_ALL_STEPS[2, :3].copy(), ABOVE_ALL_STEPS[0, :3].copy()
    found = refine_lattice(
        image, lattice, up, forward, np.zeros((0, 3)), noise=1e-4, columns=(0, image.camera.width)
    )
    assert found is None
