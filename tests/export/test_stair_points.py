"""Exact stairs as points and heights, and their place in a map."""

from __future__ import annotations

import numpy as np
import pytest

from stairmap.export.cloud_cleaning import are_on_stairs
from stairmap.export.stair_points import StairClass, height_layer, points_from_stairways
from stairmap.simulation.stairs import true_std
from stairmap.stairway import Flight, Landing, Stairway, Step
from stairmap.transforms import invert_transform, transform_points

FLIGHT = Flight(
    base=np.array([3.0, -1.0, 0.5]), heading=0.7, rise=0.17, run=0.28, width=1.1, num_risers=6, std=true_std()
)
LANDING = Landing(center=np.array([5.2, 0.9, 1.52]), size=(1.0, 1.1), heading=0.7)
STAIRWAY = Stairway(
    id=1, flights=(FLIGHT,), landings=(LANDING,), num_observations=1, first_seen_ns=0, last_seen_ns=0
)


def in_flight(points: np.ndarray) -> np.ndarray:
    return transform_points(invert_transform(FLIGHT.map_from_flight), points)


def test_points_lie_on_treads_and_risers() -> None:
    stairs = points_from_stairways([STAIRWAY])
    s, t, z = in_flight(stairs.points[stairs.classes == StairClass.TREAD]).T
    assert np.abs(t).max() == pytest.approx(0.55)
    assert z / 0.17 == pytest.approx(np.rint(z / 0.17), abs=1e-6)
    assert ((s >= (np.rint(z / 0.17) - 1) * 0.28 - 1e-9) & (s <= np.rint(z / 0.17) * 0.28 + 1e-9)).all()
    assert z.max() == pytest.approx(5 * 0.17)

    s, _, z = in_flight(stairs.points[stairs.classes == StairClass.RISER]).T
    assert s / 0.28 == pytest.approx(np.rint(s / 0.28), abs=1e-6)
    assert (z.min(), z.max()) == pytest.approx((0.0, 6 * 0.17), abs=1e-9)


def test_points_are_dense_and_landings_are_among_them() -> None:
    stairs = points_from_stairways([STAIRWAY], spacing=0.05)
    landing = stairs.points[stairs.classes == StairClass.LANDING]

    assert landing[:, 2] == pytest.approx(1.52)
    assert len(landing) == 21 * 23


def test_steps_that_were_not_seen_are_trusted_less() -> None:
    steps = tuple(
        Step(nosing=nosing, num_observations=int(i != 2)) for i, nosing in enumerate(FLIGHT.edges())
    )
    flight = Flight(
        base=FLIGHT.base,
        heading=0.7,
        rise=0.17,
        run=0.28,
        width=1.1,
        num_risers=6,
        std=true_std(),
        steps=steps,
    )
    stairway = Stairway(id=1, flights=(flight,), num_observations=1, first_seen_ns=0, last_seen_ns=0)
    stairs = points_from_stairways([stairway])

    step = np.rint(in_flight(stairs.points)[:, 2] / 0.17) - 1
    treads = stairs.classes == StairClass.TREAD
    assert stairs.trust[treads & (step == 2)] == pytest.approx(0.5)
    assert stairs.trust[treads & (step != 2)] == pytest.approx(1.0)


def test_height_layer_holds_the_height_of_each_tread() -> None:
    layer = height_layer(STAIRWAY)
    for step in range(5):
        local = np.array([(step + 0.5) * 0.28, 0.3, 0.0])
        x, y, _ = transform_points(FLIGHT.map_from_flight, local)
        column, row = np.floor((np.array([x, y]) - layer.origin) / layer.resolution).astype(int)
        assert layer.elevation[row, column] == pytest.approx(0.5 + (step + 1) * 0.17, abs=1e-6)
        assert layer.classes[row, column] == StairClass.TREAD
    known = np.isfinite(layer.elevation)
    assert ((layer.classes > 0) == known).all()
    assert ((layer.trust > 0) == known).all()
    assert known.sum() * layer.resolution**2 == pytest.approx(5 * 0.28 * 1.1 + 1.1, rel=0.05)


def placed(s: float, t: float, z: float) -> np.ndarray:
    return transform_points(FLIGHT.map_from_flight, np.array([[s, t, z]]))


@pytest.mark.parametrize(
    ("place", "is_on"),
    [
        ((0.42, 0.0, 0.34), True),
        ((0.42, 0.0, 0.43), True),
        ((0.42, 0.0, 0.20), True),
        ((0.42, 0.0, 1.24), False),
        ((0.42, 0.0, 0.0), False),
        ((0.42, 0.7, 0.34), False),
        ((-0.5, 0.0, 0.0), False),
        ((-0.05, 0.0, 0.0), False),
        ((-0.05, 0.0, 0.1), True),
        ((1.45, 0.0, 1.02), False),
        ((1.45, 0.0, 0.9), True),
        ((2.5, 0.0, 1.02), False),
    ],
)
def test_only_what_belongs_to_the_steps_is_taken_away(place: tuple[float, float, float], is_on: bool) -> None:
    assert are_on_stairs(placed(*place), [STAIRWAY]).tolist() == [is_on]


RISE, RUN, TOP, END = 0.17, 0.28, 6 * 0.17, 5 * 0.28


@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        # A rise below the third tread, and 0.7 of one above it.
        ((0.7, 0.0, 3 * RISE - 0.165), (0.7, 0.0, 3 * RISE - 0.175)),
        ((0.7, 0.0, 3 * RISE + 0.115), (0.7, 0.0, 3 * RISE + 0.123)),
        # 2 cm beside the steps.
        ((0.7, 0.565, 3 * RISE), (0.7, 0.575, 3 * RISE)),
        ((0.7, -0.565, 3 * RISE), (0.7, -0.575, 3 * RISE)),
        # Before the first riser: 0.3 runs, from 0.2 rises to 1.7, no margin beside it.
        ((-0.080, 0.0, 0.1), (-0.088, 0.0, 0.1)),
        ((-0.05, 0.0, 0.038), (-0.05, 0.0, 0.030)),
        ((-0.05, 0.0, 0.285), (-0.05, 0.0, 0.293)),
        ((-0.05, 0.545, 0.1), (-0.05, 0.555, 0.1)),
        # Behind the last nosing: 0.3 runs, from a rise below the floor to 0.2 below it.
        ((END + 0.080, 0.0, TOP - 0.1), (END + 0.088, 0.0, TOP - 0.1)),
        ((END + 0.05, 0.0, TOP - 0.038), (END + 0.05, 0.0, TOP - 0.030)),
        ((END + 0.05, 0.0, TOP - 0.165), (END + 0.05, 0.0, TOP - 0.175)),
        # On the first tread and on the last.
        ((0.005, 0.0, RISE), (-0.1, 0.0, RISE)),
        ((END - 0.005, 0.0, TOP - RISE), (END + 0.1, 0.0, TOP - RISE)),
    ],
)
def test_what_is_taken_away_ends_at_its_limits(
    inside: tuple[float, float, float], outside: tuple[float, float, float]
) -> None:
    points = np.concatenate([placed(*inside), placed(*outside)])
    assert are_on_stairs(points, [STAIRWAY]).tolist() == [True, False]
