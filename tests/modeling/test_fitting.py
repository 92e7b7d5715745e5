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


# Single steps


def test_a_riser_12_mm_off_comes_out_with_its_deviation() -> None:
    raised = dict.fromkeys(range(4, 8), 0.012)
    flight = fit(observe_all(FLIGHT, POSES, noise=0.003, edge_std=(0.004, 0.003), raised=raised)).flight
    heights = np.array([step.nosing[0, 2] for step in flight.steps])
    risers = np.diff(heights)
    assert risers[3] == pytest.approx(0.182, abs=0.004)
    np.testing.assert_allclose(np.delete(risers, 3), 0.17, atol=0.004)
    assert risers[3] - 0.17 > 2 * np.hypot(flight.steps[3].std[1], flight.steps[4].std[1])
    along, up = np.array([step.std for step in flight.steps]).T
    assert up.min() > 0.0006 and along.max() < 0.008


def test_single_steps_have_no_deviation_where_their_detector_states_none() -> None:
    flight = fit(observe_all(FLIGHT, POSES)).flight
    assert np.isnan([step.std for step in flight.steps]).all()


def test_a_step_along_the_stairs_is_placed_along_the_heading() -> None:
    observations = observe_all(FLIGHT, POSES[:6], edge_std=(0.002, 0.002))
    for observation, pose in zip(observations, POSES, strict=False):
        moved = observation.edges[2].nosing + 0.010 * (pose[:3, :3].T @ FLIGHT.forward)
        moved.flags.writeable = False
        object.__setattr__(observation.edges[2], "nosing", moved)
    steps = fit(observations).flight.steps
    along = np.array([(step.nosing.mean(axis=0) - FLIGHT.base) @ FLIGHT.forward for step in steps])
    assert along[2] == pytest.approx(2 * 0.28 + 0.010, abs=0.001)
    np.testing.assert_allclose(along[[0, 1, 3, 4]], 0.28 * np.array([0, 1, 3, 4]), atol=0.0015)


def test_thousands_of_observations_place_steps_as_well_as_hundreds() -> None:
    poses = [POSES[index % 30] for index in range(2400)]
    observations = observe_all(FLIGHT, poses, noise=0.003, edge_std=(0.004, 0.003), raised={3: 0.012})
    table = ObservationTable()
    for observation in observations:
        table.add(observation)
    flight = fit_flight(table, PlacedObservations(table, np.array(poses)), np.arange(2400)).flight
    assert flight.steps[3].nosing[0, 2] == pytest.approx(4 * 0.17 + 0.012, abs=0.001)
    assert flight.steps[3].num_observations == 2400


# Overhang


def test_overhang_is_the_mean_of_observations_that_know_it() -> None:
    observations = observe_all(FLIGHT, POSES[:8], overhang=(0.030, 0.004))
    observations += observe_all(FLIGHT, POSES[8:12], first_stamp=8, overhang=(0.002, 0.030))
    observations += observe_all(FLIGHT, POSES[12:20], first_stamp=12, overhang=(0.0, float("nan")))
    flight = fit(observations).flight
    assert flight.overhang == pytest.approx(0.030, abs=0.001)
    assert 0.002 < flight.std.overhang < 0.010


def test_overhang_is_unknown_where_no_observation_knows_it() -> None:
    flight = fit(observe_all(FLIGHT, POSES[:8])).flight
    assert np.isnan([flight.overhang, flight.std.overhang]).all()


# Ends


def test_a_flight_says_which_of_its_ends_were_seen() -> None:
    for floor, top in ((True, False), (False, True), (True, True), (False, False)):
        flight = fit(observe_all(FLIGHT, POSES[:5], floor_seen=floor, top_seen=top)).flight
        assert (flight.bottom_seen, flight.top_seen) == (floor, top)


def test_the_top_of_views_that_saw_fewer_steps_is_theirs() -> None:
    observations = observe_all(FLIGHT, POSES[:6], steps=range(5), floor_seen=True)
    observations += observe_all(FLIGHT, POSES[6:12], first_stamp=6, steps=range(2, 8), top_seen=True)
    flight = fit(observations).flight
    assert (flight.num_risers, flight.bottom_seen, flight.top_seen) == (8, True, True)


# What counts for the confirmation


@pytest.mark.parametrize(("error", "agrees"), [(0.0155, True), (0.0165, False)])
@pytest.mark.parametrize("name", ["rise", "run"])
def test_an_observation_agrees_within_10_mm_and_three_deviations(
    name: str, error: float, agrees: bool
) -> None:
    observations = observe_all(FLIGHT, POSES[:20])
    off = observations[4]
    object.__setattr__(off, name, getattr(off, name) + error)
    assert fit(observations).num_agreeing == (20 if agrees else 19)


@pytest.mark.parametrize(("std", "num_precise"), [(0.0064, 5), (0.0066, 0)])
def test_an_observation_that_measured_its_rise_badly_confirms_nothing(std: float, num_precise: int) -> None:
    observations = observe_all(FLIGHT, POSES[:5])
    for observation in observations:
        covariance = observation.covariance.copy()
        covariance[0, 0] = std**2
        object.__setattr__(observation, "covariance", covariance)
    fitted = fit(observations)
    assert (fitted.num_precise, fitted.num_agreeing) == (num_precise, 5)


# Deviations of the place


def test_a_base_far_below_what_most_saw_is_less_sure_by_rise_and_run() -> None:
    tall = make_flight(heading=0.9, num_risers=16)
    near = fit(observe_all(tall, POSES[:20]) + observe_all(tall, POSES[20:], first_stamp=20)).flight
    for upper, lower in ((range(10, 16), range(16)), (range(4, 16), range(8))):
        above = observe_all(tall, POSES[:20], steps=upper)
        far = fit(above + observe_all(tall, POSES[20:], first_stamp=20, steps=lower)).flight
        assert near.num_risers == far.num_risers == 16
        lever = upper[0] * 20 / 30
        assert far.std.base[2] == pytest.approx(np.hypot(near.std.base[2], lever * far.std.rise), rel=0.02)


def test_pitch_deviation_follows_from_those_of_rise_and_run() -> None:
    std = fit(observe_all(FLIGHT, POSES, noise=0.01)).flight.std
    pitch = FLIGHT.pitch
    expected = np.hypot(std.rise * np.cos(pitch), std.run * np.sin(pitch)) / np.hypot(0.17, 0.28)
    assert std.pitch == pytest.approx(expected, rel=0.02)


def test_heading_is_weighted_by_how_well_each_frame_knows_it() -> None:
    sure, vague = (
        observe_all(FLIGHT, POSES[:1]),
        observe_all(make_flight(heading=1.0), POSES[1:2], first_stamp=1),
    )
    for observation, std in ((sure[0], 0.002), (vague[0], 0.05)):
        covariance = observation.covariance.copy()
        covariance[5, 5] = std**2
        object.__setattr__(observation, "covariance", covariance)
    assert fit(sure + vague).flight.heading == pytest.approx(0.9, abs=0.006)


def test_the_deviation_of_a_heading_is_what_frames_state_and_what_their_poses_scatter_by() -> None:
    observations = observe_all(FLIGHT, POSES[:6])
    for observation in observations:
        covariance = observation.covariance.copy()
        covariance[5, 5] = np.radians(0.3) ** 2
        object.__setattr__(observation, "covariance", covariance)
    # Six neighbouring frames count as one, and a pose's heading scatters by 0.2 degrees.
    expected = np.radians(np.hypot(0.3, 0.2))
    assert fit(observations).flight.std.heading == pytest.approx(expected, rel=1e-3)


def test_the_deviation_of_a_height_is_what_frames_state_and_what_their_poses_scatter_by() -> None:
    observations = observe_all(FLIGHT, POSES[:6])
    for observation in observations:
        covariance = observation.covariance.copy()
        covariance[3, 3] = 0.008**2
        object.__setattr__(observation, "covariance", covariance)
    # A pose's height scatters by 6 mm.
    assert fit(observations).flight.std.base[2] == pytest.approx(0.010, rel=0.01)
