"""Flights' meshes are where their truth says."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.simulation.render import RayCaster
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stairs import build_flight, build_stairway

USUAL = FlightShape(rise=0.17, run=0.28, width=1.2, num_risers=8)


def heights_below(caster: RayCaster, points: np.ndarray) -> np.ndarray:
    """Height of the first surface below each (N, 3) point, by bisection over visibility."""
    found = []
    for point in points:
        below = point - np.outer(np.linspace(0, 4, 4001), [0, 0, 1.0])
        visible = caster.is_visible(point, below[1:])
        found.append(below[1 + np.argmin(visible), 2] if not visible.all() else np.nan)
    return np.array(found)


@pytest.mark.parametrize(
    "shape",
    [
        USUAL,
        FlightShape(rise=0.19, run=0.25, width=0.9, num_risers=6, overhang=0.03),
        FlightShape(rise=0.19, run=0.25, width=0.9, num_risers=6, open_risers=True),
        FlightShape(rise=0.16, run=0.30, width=1.0, num_risers=10, irregularity=0.01),
        FlightShape(rise=0.16, run=0.30, width=1.0, num_risers=10, soffit=True, right="railing"),
    ],
)
def test_rays_from_above_hit_every_tread_at_its_true_height(shape: FlightShape) -> None:
    mesh, truth = build_flight(shape, base=(1.0, -2.0, 0.5), heading=0.8, random=np.random.default_rng(5))
    caster = RayCaster(mesh)
    nosings = np.array([step.nosing for step in truth.steps])
    behind = nosings.mean(axis=1) + 0.01 * truth.forward
    before = nosings.mean(axis=1)[1:] - 0.01 * truth.forward
    lift = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(heights_below(caster, behind + lift), nosings[:, 0, 2], atol=0.006)
    np.testing.assert_allclose(heights_below(caster, before + lift), nosings[:-1, 0, 2], atol=0.006)


def test_truth_of_an_irregular_flight_is_the_mean_over_its_treads() -> None:
    shape = FlightShape(rise=0.17, run=0.28, width=1.2, num_risers=9, irregularity=0.01)
    _, truth = build_flight(shape, base=(0, 0, 0), heading=0.0, random=np.random.default_rng(1))
    nosings = np.array([step.nosing.mean(axis=0) for step in truth.steps])
    assert truth.rise == pytest.approx(np.diff(nosings[:, 2]).mean())
    assert truth.run == pytest.approx(np.diff(nosings[:, 0]).mean())
    assert 0.004 < np.diff(nosings[:, 2]).std() < 0.02


def test_regular_truth_is_the_shape_and_its_edges_are_its_steps() -> None:
    _, truth = build_flight(USUAL, base=(3, 2, 1), heading=2.0, random=np.random.default_rng(0))
    assert (truth.rise, truth.run, truth.width) == pytest.approx((0.17, 0.28, 1.2))
    np.testing.assert_allclose(truth.edges(), [step.nosing for step in truth.steps], atol=1e-12)


@pytest.mark.parametrize("turn", [0, 90, -90, 180, -180])
def test_flights_start_on_the_landing_that_ends_the_one_before(turn: int) -> None:
    built = build_stairway(
        StairwayShape(flights=(USUAL, USUAL), turns=(turn,)),
        base=(1, 1, 0), heading=0.4, stairway_id=7, random=np.random.default_rng(0),
    )  # fmt: skip
    first, second = built.stairway.flights
    (landing,) = built.stairway.landings
    assert second.base[2] == pytest.approx(first.steps[-1].nosing[0, 2])
    assert landing.center[2] == pytest.approx(second.base[2])
    assert np.cos(second.heading - first.heading - np.radians(turn)) == pytest.approx(1.0)
    forward = np.array([np.cos(landing.heading), np.sin(landing.heading)])
    offset = (second.base - landing.center)[:2] - 1e-6 * second.forward[:2]
    assert abs(offset @ forward) <= landing.size[0] / 2 + 1e-6
    assert abs(offset @ [-forward[1], forward[0]]) <= landing.size[1] / 2 + 1e-6
    caster = RayCaster(built.mesh)
    assert heights_below(caster, landing.center[None] + [0, 0, 0.5])[0] == pytest.approx(
        landing.center[2], abs=0.003
    )
    assert built.stairway.id == 7


def test_impossible_turns_are_refused() -> None:
    with pytest.raises(ValueError, match="need 1 turns"):
        StairwayShape(flights=(USUAL, USUAL))
    with pytest.raises(ValueError, match="a turn is"):
        StairwayShape(flights=(USUAL, USUAL), turns=(45,))
