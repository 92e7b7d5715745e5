"""One flight from all its observations: means by variance, outliers held back, honest deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from ideal_observations import make_flight, observe_all, poses_before
from stairmap.detection.observation import StairObservation
from stairmap.modeling.fitting import FittedFlight, fit_flight
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations

FLIGHT = make_flight(heading=0.9)
POSES = poses_before(FLIGHT, 30)


def fit(observations: Sequence[StairObservation]) -> FittedFlight:
    """Fit all of the observations, each taken from the pose of its place in the list."""
    table = ObservationTable()
    for observation in observations:
        table.add(observation)
    placed = PlacedObservations(table, np.array(POSES[: len(observations)]))
    return fit_flight(table, placed, np.arange(len(observations)))


def test_a_single_exact_observation_gives_the_flight() -> None:
    fitted = fit(observe_all(FLIGHT, POSES[:1]))
    assert fitted.flight.num_risers == 8
    assert fitted.num_confirmed_steps == 0
    np.testing.assert_allclose(fitted.flight.base, FLIGHT.base, atol=1e-6)
    assert fitted.flight.heading == pytest.approx(0.9, abs=1e-9)


def test_steps_are_confirmed_by_a_second_observation() -> None:
    assert fit(observe_all(FLIGHT, POSES[:2])).num_confirmed_steps == 8


def test_a_certain_observation_counts_more_than_vague_ones() -> None:
    observations = observe_all(make_flight(heading=0.9, rise=0.18), POSES[:4])
    for observation in observations:
        object.__setattr__(observation, "covariance", np.diag([0.02, 0.02, 0.02, 0.02, 0.02, 0.05]) ** 2)
    certain = observe_all(FLIGHT, POSES[:5])[4]
    object.__setattr__(certain, "covariance", np.diag([0.001, 0.001, 0.005, 0.005, 0.002, 0.005]) ** 2)
    assert fit([*observations, certain]).flight.rise == pytest.approx(0.17, abs=0.001)


def test_one_wrong_observation_in_ten_moves_rise_and_run_by_less_than_a_millimetre() -> None:
    observations = observe_all(FLIGHT, POSES[:10])
    wrong = observe_all(make_flight(heading=0.9, rise=0.20, run=0.25), POSES[:10])[4]
    observations[4] = wrong
    flight = fit(observations).flight
    assert flight.rise == pytest.approx(0.17, abs=0.001)
    assert flight.run == pytest.approx(0.28, abs=0.001)


def test_headings_about_the_wrap_are_averaged_the_short_way() -> None:
    flight = make_flight(base=np.array([-2.0, 0.0, 0.0]), heading=np.pi)
    poses = poses_before(flight, 6)
    observations = observe_all(flight, poses)
    table = ObservationTable()
    for observation in observations:
        table.add(observation)
    turned = []
    for index, pose in enumerate(poses):
        angle = 0.02 * (-1) ** index
        rotation = np.eye(4)
        rotation[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        turned.append(rotation @ pose)
    fitted = fit_flight(table, PlacedObservations(table, np.array(turned)), np.arange(6))
    assert abs(fitted.flight.heading) == pytest.approx(np.pi, abs=1e-3)


def test_deviations_are_positive_and_shrink_with_observations() -> None:
    few = fit(observe_all(FLIGHT, POSES[:3], noise=0.01)).flight.std
    many = fit(observe_all(FLIGHT, POSES, noise=0.01)).flight.std
    for name in ("rise", "run", "heading", "pitch"):
        assert 0 < getattr(many, name) <= getattr(few, name) * 1.05
    assert (many.base > 0).all()
    assert many.base.shape == (3,)
    assert many.width > 0


def test_rise_and_run_are_never_said_to_be_certain() -> None:
    # A sensor's bias and uneven steps do not average out.
    std = fit(observe_all(FLIGHT, POSES)).flight.std
    assert std.rise >= 0.0005
    assert std.run >= 0.0005


def test_base_deviation_turns_with_the_heading() -> None:
    along_x = make_flight(heading=0.0)
    along_y = make_flight(base=np.array([0.0, 2.0, 0.0]), heading=np.pi / 2)
    found = []
    for flight in (along_x, along_y):
        poses = poses_before(flight, 6)
        table = ObservationTable()
        for observation in observe_all(flight, poses):
            table.add(observation)
        placed = PlacedObservations(table, np.array(poses))
        found.append(fit_flight(table, placed, np.arange(6)).flight.std.base)
    assert found[0] == pytest.approx(found[1][[1, 0, 2]], rel=1e-6)


def test_each_step_keeps_its_own_place() -> None:
    # The third nosing of this flight is 12 mm higher than its lattice says.
    observations = observe_all(FLIGHT, POSES[:6])
    for observation, pose in zip(observations, POSES, strict=False):
        raised = observation.edges[2].nosing + 0.012 * pose[2, :3]
        raised.flags.writeable = False
        object.__setattr__(observation.edges[2], "nosing", raised)
    steps = fit(observations).flight.steps
    heights = np.array([step.nosing[0, 2] for step in steps])
    np.testing.assert_allclose(heights[[1, 3]], 0.17 * np.array([2, 4]), atol=0.002)
    assert heights[2] == pytest.approx(0.17 * 3 + 0.012, abs=0.002)
