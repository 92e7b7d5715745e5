"""Look-alikes have edges and levels, and nothing that is a stairway."""

from __future__ import annotations

import numpy as np
import pytest

from rays import cast_ray, height_below
from stairmap.simulation.more_look_alikes import MORE_LOOK_ALIKES
from stairmap.simulation.render import RayCaster


def caster_of(name: str, seed: int = 0) -> RayCaster:
    scene = MORE_LOOK_ALIKES[name](name, np.random.default_rng(seed))
    assert scene.stairways == ()
    return RayCaster(scene.mesh)


@pytest.mark.parametrize("seed", range(4))
def test_terraces_of_boxes_are_higher_than_any_code_allows_a_riser(seed: int) -> None:
    caster = caster_of("box_terraces", seed)
    heights = [height_below(caster, x, 0.25, 2.6) for x in np.arange(-0.5, 2.9, 0.02)]
    rises = np.diff(heights)
    rises = rises[rises > 0.05]
    assert len(rises) == 4
    assert rises.min() > 0.29


def test_kerbs_are_two_and_far_apart() -> None:
    caster = caster_of("double_kerb")
    assert [round(height_below(caster, x, 0.0, 1.0), 3) for x in (-0.2, 0.2, 1.4, 1.6)] == [
        0,
        0.08,
        0.08,
        0.16,
    ]


def test_tiles_lie_within_two_millimetres_of_level() -> None:
    caster = caster_of("tiled_floor")
    heights = np.array([height_below(caster, x, y, 1.0) for x in (-3.0, 0.1, 2.3) for y in (-1.0, 0.5)])
    assert np.abs(heights).max() < 0.0021


def test_curtains_hang_upright_in_folds() -> None:
    caster = caster_of("curtains")
    low = [cast_ray(caster, [-2, y, 0.5], [1, 0, 0])[0] for y in np.arange(-1.0, 1.0, 0.01)]
    high = [cast_ray(caster, [-2, y, 1.8], [1, 0, 0])[0] for y in np.arange(-1.0, 1.0, 0.01)]
    np.testing.assert_allclose(low, high, atol=1e-6)
    assert 0.08 < np.ptp(low) < 0.2


def test_chairs_are_stacked_steeper_than_any_stairs() -> None:
    caster = caster_of("stacked_chairs")
    fronts = [cast_ray(caster, [-1, -0.6, 0.43 + 0.1 * number], [1, 0, 0])[0] for number in range(6)]
    np.testing.assert_allclose(np.diff(fronts), -0.04, atol=1e-6)


def test_shelves_lie_above_each_other() -> None:
    caster = caster_of("empty_shelves")
    boards = np.linspace(0.08, 1.96, 7)
    fronts = [cast_ray(caster, [-1, 0.6, z + 0.012], [1, 0, 0])[0] for z in boards]
    np.testing.assert_allclose(fronts, 0.0, atol=1e-6)
    backs = [cast_ray(caster, [-1, 0.6, z - 0.05], [1, 0, 0])[0] for z in boards[1:]]
    np.testing.assert_allclose(backs, 0.45, atol=1e-6)


def test_boxes_on_shelves_stand_back() -> None:
    caster = caster_of("shelves_with_boxes")
    fronts = {round(cast_ray(caster, [-1, y, 0.2], [1, 0, 0])[0], 3) for y in np.arange(-1.1, 0.9, 0.1)}
    assert len(fronts) > 3


def test_benches_have_slats_with_gaps() -> None:
    caster = caster_of("slatted_benches")
    heights = {round(height_below(caster, x, 0.0, 0.9), 2) for x in np.arange(0.001, 0.44, 0.01)}
    assert heights == {0.46, 0.0}
