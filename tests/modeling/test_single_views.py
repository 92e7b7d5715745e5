"""Stairways of a finished map, in which each flight is observed once and as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ideal_observations import make_flight, observe
from stairmap.detection.observation import StairObservation
from stairmap.modeling.single_views import flight_from_observation, stairways_from_observations

IN_MAP = np.eye(4)
VARIANCES = np.array([0.001, 0.002, 0.003, 0.004, 0.005, 0.006]) ** 2
"""Of rise, run, place along and up, tilt and heading."""


def seen(stamp_ns: int = 0, **changes: object) -> StairObservation:
    observation = observe(make_flight(**changes), IN_MAP, stamp_ns)
    return replace(observation, covariance=np.diag(VARIANCES))


def test_stairways_are_numbered_by_height_then_x_then_y() -> None:
    places = [(9.0, 0.0, 3.0), (0.0, 20.0, 0.0), (0.0, 10.0, 0.0), (-30.0, 40.0, 0.0), (0.0, 0.0, -3.0)]
    found = stairways_from_observations([seen(base=np.array(place)) for place in places])
    assert [stairway.id for stairway in found] == [1, 2, 3, 4, 5]
    bases = [tuple(np.round(stairway.flights[0].base, 6).tolist()) for stairway in found]
    assert bases == [places[4], places[3], places[2], places[1], places[0]]


def test_flights_with_a_landing_between_them_are_one_stairway() -> None:
    upper = np.array([2.0 + 7 * 0.28 + 1.2, 0.0, 8 * 0.17])
    (stairway,) = stairways_from_observations([seen(7, base=upper), seen(3)])
    assert [round(float(flight.base[2]), 2) for flight in stairway.flights] == [0.0, 1.36]
    assert len(stairway.landings) == 1
    assert stairway.num_observations == 2
    assert (stairway.first_seen_ns, stairway.last_seen_ns) == (3, 7)


@pytest.mark.parametrize("heading", [0.0, np.pi / 2, 0.7, -2.5])
def test_a_flight_has_the_measures_and_deviations_of_its_observation(heading: float) -> None:
    true = make_flight(heading=heading)
    flight = flight_from_observation(seen(heading=heading))
    np.testing.assert_allclose(flight.base, true.base, atol=1e-9)
    measures = (flight.heading, flight.rise, flight.run, flight.width)
    assert measures == pytest.approx((heading, 0.17, 0.28, 1.2))
    assert flight.num_risers == 8
    std = flight.std
    assert (std.rise, std.run, std.heading, std.width) == pytest.approx((0.001, 0.002, 0.006, 0.01))
    length = np.hypot(0.17, 0.28)
    assert std.pitch == pytest.approx(np.hypot(0.001 * 0.28, 0.002 * 0.17) / length**2)
    # Along the heading by the place's deviation, across by the width's.
    along, across = abs(np.cos(heading)), abs(np.sin(heading))
    expected = [np.hypot(0.003 * along, 0.01 * across), np.hypot(0.003 * across, 0.01 * along), 0.004]
    assert std.base == pytest.approx(expected)


@pytest.mark.parametrize(
    ("left", "right", "width_std"), [(True, True, 0.01), (True, False, 0.05), (False, True, 0.05)]
)
def test_a_width_is_less_sure_where_an_end_was_not_seen(left: bool, right: bool, width_std: float) -> None:
    observation = seen()
    edges = [replace(edge, left_bounded=False, right_bounded=False) for edge in observation.edges]
    edges[3] = replace(edges[3], left_bounded=left, right_bounded=right)
    flight = flight_from_observation(replace(observation, edges=tuple(edges)))
    assert (flight.left_bounded, flight.right_bounded) == (left, right)
    assert flight.std.width == width_std


def test_ends_and_overhang_are_those_that_the_observation_knows() -> None:
    told = replace(seen(), floor_seen=True, top_seen=False, overhang=0.03, overhang_std=0.002)
    flight = flight_from_observation(told)
    assert (flight.bottom_seen, flight.top_seen) == (True, False)
    assert (flight.overhang, flight.std.overhang) == (0.03, 0.002)
    other = flight_from_observation(replace(told, floor_seen=False, top_seen=True, overhang_std=np.nan))
    assert (other.bottom_seen, other.top_seen) == (False, True)
    assert np.isnan(other.overhang)


def test_a_step_that_was_not_seen_lies_on_the_lattice_between_the_others() -> None:
    flight = make_flight(heading=0.7)
    observation = observe(flight, IN_MAP, 0, steps=[0, 1, 3, 4], edge_std=(0.004, 0.002))
    steps = flight_from_observation(observation).steps
    assert [step.num_observations for step in steps] == [1, 1, 0, 1, 1]
    np.testing.assert_allclose([step.nosing for step in steps], flight.edges()[:5], atol=1e-9)
    assert steps[1].std == (0.004, 0.002)
