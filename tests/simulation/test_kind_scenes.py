"""Scenes of each kind have the geometry that they state, by ray casts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rays import cast_ray, height_below
from stairmap.simulation.kind_drives import KIND_SCENES
from stairmap.simulation.kind_scenes import (
    make_ascending_scene,
    make_descending_scene,
    make_escalator_scene,
    make_sloping_scene,
)
from stairmap.simulation.render import RayCaster
from stairmap.simulation.scene import Scene
from stairmap.simulation.stair_shapes import FlightShape
from stairmap.stairway import Flight

SHAPE = FlightShape(rise=0.17, run=0.29, width=1.2, num_risers=5)
RANDOM = np.random.default_rng(0)


def the_flight(scene: Scene) -> Flight:
    ((flight,),) = (stairway.flights for stairway in scene.stairways)
    return flight


@pytest.mark.parametrize(("overhang", "lip"), [(0.015, 0.020), (0.030, 0.030), (0.045, 0.045)])
def test_a_tread_overhangs_with_a_lip_before_a_riser(overhang: float, lip: float) -> None:
    scene = make_ascending_scene("overhang", replace(SHAPE, overhang=overhang, lip=lip), RANDOM)
    caster, flight = RayCaster(scene.mesh), the_flight(scene)
    assert flight.overhang == overhang
    for index, step in enumerate(flight.steps):
        x, _, z = step.nosing.mean(axis=0)
        for below, front in ((0.002, x), (lip - 0.002, x), (lip + 0.002, x + overhang)):
            found = cast_ray(caster, [x - 0.15, 0.1, z - below], [1.0, 0.0, 0.0])
            assert found[0] == pytest.approx(front, abs=1e-6), (index, below)


def test_an_odd_riser_lifts_its_step_and_all_above_it() -> None:
    scene = make_ascending_scene("irregular", replace(SHAPE, odd_risers=((2, -0.012),)), RANDOM)
    caster, flight = RayCaster(scene.mesh), the_flight(scene)
    heights = [height_below(caster, index * 0.29 + 0.1, 0.0, 2.0) for index in range(4)]
    np.testing.assert_allclose(heights, [0.17, 0.34, 0.498, 0.668], atol=1e-6)
    np.testing.assert_allclose([step.nosing[0, 2] for step in flight.steps[:4]], heights, atol=1e-6)
    assert flight.rise == pytest.approx(0.17 - 0.012 / 4)


def test_falling_treads_are_lower_at_their_front_and_the_floors_level() -> None:
    scene = make_ascending_scene("sloping", replace(SHAPE, tread_slope=0.03, overhang=0.02), RANDOM)
    caster = RayCaster(scene.mesh)
    for index in range(4):
        for offset in (0.001, 0.15, 0.28):
            expected = (index + 1) * 0.17 + 0.03 * offset
            found = height_below(caster, index * 0.29 + offset, 0.2, 3.0)
            assert found == pytest.approx(expected, abs=1e-5), (index, offset)
    assert height_below(caster, 4 * 0.29 + 0.2, 0.0, 3.0) == pytest.approx(5 * 0.17, abs=1e-6)
    assert height_below(caster, -1.0, 0.0, 1.0) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("along", "across"), [(0.04, 0.0), (0.0, -0.03), (0.02, 0.01)])
def test_on_sloping_ground_floor_and_treads_fall_alike(along: float, across: float) -> None:
    scene = make_sloping_scene("sloping", SHAPE, RANDOM, along=along, across=across)
    caster, flight = RayCaster(scene.mesh), the_flight(scene)
    floor = [height_below(caster, x, y, 1.0) for x, y in ((-1.0, 0.0), (-2.0, 0.5), (-2.0, 0.0))]
    np.testing.assert_allclose(floor, [-along, -2 * along + 0.5 * across, -2 * along], atol=1e-6)
    for index, step in enumerate(flight.steps):
        left, right = step.nosing
        assert left[2] - right[2] == pytest.approx(across * 1.2)
        for offset, y in ((0.001, 0.0), (0.2, 0.3)):
            expected = step.nosing[:, 2].mean() + along * offset + across * y
            found = height_below(caster, index * 0.29 + offset, y, 3.0)
            assert found == pytest.approx(expected, abs=1e-5)
        assert step.nosing[:, 2].mean() - flight.base[2] == pytest.approx((index + 1) * 0.17)
    # A vertical riser: the same x at its foot and at its head.
    x, _, z = flight.steps[2].nosing.mean(axis=0)
    for below in (0.01, 0.12):
        assert cast_ray(caster, [x - 0.15, 0.0, z - below], [1, 0, 0])[0] == pytest.approx(x, abs=1e-6)
    assert flight.rise == pytest.approx(0.17)


@pytest.mark.parametrize("is_walled", [True, False])
def test_stairs_down_begin_at_the_edge_of_a_floor(is_walled: bool) -> None:
    scene = make_descending_scene(
        "descending", replace(SHAPE, odd_risers=((1, 0.02),)), RANDOM, is_walled=is_walled
    )
    caster, flight = RayCaster(scene.mesh), the_flight(scene)
    np.testing.assert_allclose(flight.steps[-1].nosing.mean(axis=0), 0, atol=1e-9)
    assert flight.forward[0] == pytest.approx(-1.0)
    assert height_below(caster, -1.0, 0.0, 1.0) == pytest.approx(0.0, abs=1e-6)
    assert height_below(caster, -0.001, 0.0, 1.0) == pytest.approx(0.0, abs=1e-6)
    for step in flight.steps[:-1]:
        x, _, z = step.nosing.mean(axis=0)
        assert height_below(caster, x - 0.005, 0.0, 0.5) == pytest.approx(z, abs=1e-6)
    assert height_below(caster, float(flight.base[0]) + 0.5, 0.0, 0.5) == pytest.approx(-0.87, abs=1e-6)
    beside = cast_ray(caster, [0.5, 0.0, -0.05], [0.0, 1.0, 0.0])[1]
    assert (beside == pytest.approx(0.6, abs=1e-6)) == is_walled


@pytest.mark.parametrize("is_walled", [True, False])
def test_only_walled_stairs_have_something_behind_the_top_nosing(is_walled: bool) -> None:
    caster = RayCaster(make_ascending_scene("free", SHAPE, RANDOM, is_walled=is_walled).mesh)
    over_the_top = cast_ray(caster, [-1.5, 0.0, 0.35], [1.16 + 1.5, 0.0, 0.85 - 0.35 + 0.02])
    assert np.isfinite(over_the_top).all() == is_walled
    assert height_below(caster, 1.16 + 1.0, 0.0, 2.0) == pytest.approx(0.85, abs=1e-6)
    assert height_below(caster, -1.0, 0.0, 1.0) == pytest.approx(0.0, abs=1e-6)


def test_an_escalator_flattens_out_at_both_ends() -> None:
    scene, below, above = make_escalator_scene("escalator", np.random.default_rng(3))
    caster, flight = RayCaster(scene.mesh), the_flight(scene)
    nosings = np.concatenate([below, [step.nosing for step in flight.steps], above]).mean(axis=1)
    rises = np.diff(nosings[:, 2])
    np.testing.assert_allclose(rises[[0, -1]], [0.75 * flight.rise, 0.25 * flight.rise])
    np.testing.assert_allclose(rises[1:-2], flight.rise)
    assert flight.pitch == pytest.approx(np.radians(30))
    np.testing.assert_allclose(np.diff(nosings[:, 0]), flight.run)
    # A rib every 12 mm, 6 mm wide: its top is the tread, 4 mm below it lies the groove.
    first = -flight.width / 2
    for x, _, z in nosings:
        assert height_below(caster, x + 0.2, first + 0.003, z + 1) == pytest.approx(z, abs=1e-5)
        assert height_below(caster, x + 0.2, first + 0.009, z + 1) == pytest.approx(z - 0.004, abs=1e-5)
    (foot, _, z), (head, _, top) = nosings[0], nosings[-1]
    low = z - flight.rise / 4
    assert height_below(caster, foot - 0.6, first + 0.003, 1.0) == pytest.approx(low, abs=1e-5)
    assert height_below(caster, head + 0.6, first + 0.003, top + 1) == pytest.approx(top, abs=1e-5)
    side = cast_ray(caster, [*nosings[4, :2], nosings[4, 2] + 0.5], [0.0, 1.0, 0.0])
    assert side[1] == pytest.approx(flight.width / 2, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "check"),
    [
        ("overhang_thin", lambda flight: flight.overhang == 0.030),
        ("overhang_wide", lambda flight: flight.overhang == 0.045),
        ("sloping_ground", lambda flight: flight.rise == pytest.approx(0.17)),
        ("sloping_aside", lambda flight: np.ptp(flight.steps[0].nosing[:, 2]) == pytest.approx(0.039)),
        ("terrace_down", lambda flight: flight.num_risers == 6 and flight.base[2] < -1),
        ("few_down", lambda flight: flight.num_risers == 4 and flight.base[2] < -0.6),
        ("wide_steps", lambda flight: (flight.num_risers, flight.width) == (3, 4.0)),
        ("last_step_free", lambda flight: flight.num_risers == 5),
        ("odd_riser", lambda flight: flight.steps[2].nosing[0, 2] == pytest.approx(3 * 0.17 + 0.012)),
    ],
)
def test_a_drive_shows_its_kind(name: str, check: object) -> None:
    flight = the_flight(KIND_SCENES[name](name, np.random.default_rng(0)))
    assert callable(check) and check(flight)
