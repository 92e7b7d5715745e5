"""Observations are told apart by what they are of."""

from __future__ import annotations

import numpy as np
from true_drives import make_flight

from stairmap.detection.observation import StairEdge, StairObservation
from stairmap.evaluation.drift import find_observed_flight, frames_of_flight
from stairmap.stairway import Flight
from stairmap.transforms import invert_transform, rotation_from_vector, transform_from_parts, transform_points

FLIGHT = make_flight()
OTHER = make_flight(base=np.array([-4.0, 2.0, 0.0]), heading=-2.0)
POSE = transform_from_parts(rotation_from_vector([0.3, -0.8, 1.1]), [0.5, 0.2, 0.9])


def observe(flight: Flight, *, shift: tuple[float, float, float] = (0, 0, 0)) -> StairObservation:
    """Return an observation of a flight's lowest four nosings, in the camera frame."""
    nosings = transform_points(invert_transform(POSE), flight.edges()[:4] + np.array(shift))
    return StairObservation(
        stamp_ns=0, view="ascending", up=POSE[2, :3], forward=POSE[:3, :3].T @ flight.forward,
        edges=tuple(
            StairEdge(
                nosing=nosing, step_index=index, left_bounded=True, right_bounded=True,
                cue="jump", num_pixels=9,
            )
            for index, nosing in enumerate(nosings)
        ),
        rise=flight.rise, run=flight.run, width=flight.width, origin=nosings[0].mean(axis=0),
        covariance=np.zeros((0, 0)), points=np.zeros((0, 3)),
    )  # fmt: skip


def test_an_observation_belongs_to_the_flight_that_its_edges_lie_on() -> None:
    assert find_observed_flight(observe(FLIGHT), POSE, (OTHER, FLIGHT)) == 1
    assert find_observed_flight(observe(OTHER), POSE, (OTHER, FLIGHT)) == 0
    assert find_observed_flight(observe(FLIGHT, shift=(0.05, 0, 0.05)), POSE, (FLIGHT,)) == 0


def test_an_observation_of_something_else_belongs_to_no_flight() -> None:
    assert find_observed_flight(observe(FLIGHT, shift=(0, 0, -0.6)), POSE, (FLIGHT, OTHER)) is None
    assert find_observed_flight(observe(FLIGHT, shift=(2, 0, 0)), POSE, (FLIGHT, OTHER)) is None
    assert find_observed_flight(observe(FLIGHT), POSE, ()) is None


def test_frames_of_a_flight_are_those_with_an_observation_of_it() -> None:
    observed: list[list[int | None]] = [[0], [], [None, 0], [1], [None]]
    np.testing.assert_array_equal(frames_of_flight(observed, 0), [0, 2])
    np.testing.assert_array_equal(frames_of_flight(observed, 2), [])
