"""Stairways from observations that each show a whole flight, as a finished map does."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from stairmap.detection.observation import StairObservation
from stairmap.modeling.landings import join_flights, make_landing
from stairmap.stairway import Flight, FlightStd, Stairway, Step

OPEN_WIDTH_STD, BOUNDED_WIDTH_STD = 0.05, 0.01
"""Standard deviation of a width of which an end was not seen, and of one that was, m."""


def stairways_from_observations(observations: Sequence[StairObservation]) -> tuple[Stairway, ...]:
    """Join flights that were each observed once, in a map with z up, to stairways, lowest first."""
    flights = [flight_from_observation(observation) for observation in observations]
    chains = join_flights(flights)
    chains.sort(key=lambda chain: tuple(np.round(flights[chain[0]].base[[2, 0, 1]], 2).tolist()))
    return tuple(
        Stairway(
            id=number,
            flights=tuple(flights[index] for index in chain),
            landings=tuple(make_landing(flights[lower], flights[upper]) for lower, upper in pairwise(chain)),
            num_observations=len(chain),
            first_seen_ns=min(observations[index].stamp_ns for index in chain),
            last_seen_ns=max(observations[index].stamp_ns for index in chain),
        )
        for number, chain in enumerate(chains, start=1)
    )


def flight_from_observation(observation: StairObservation) -> Flight:
    """Return the flight that one observation in a map with z up shows."""
    forward = observation.forward / np.hypot(*observation.forward[:2])
    heading = float(np.arctan2(forward[1], forward[0]))
    num_risers = observation.num_steps
    left_bounded = any(edge.left_bounded for edge in observation.edges)
    right_bounded = any(edge.right_bounded for edge in observation.edges)
    rise, run, along, up, _, turn = np.sqrt(np.diag(observation.covariance)).tolist()
    pitch = np.arctan2(observation.rise, observation.run)
    width_std = BOUNDED_WIDTH_STD if left_bounded and right_bounded else OPEN_WIDTH_STD
    cosine, sine = abs(np.cos(heading)), abs(np.sin(heading))
    return Flight(
        base=observation.origin - [0.0, 0.0, observation.rise],
        heading=heading,
        rise=observation.rise,
        run=observation.run,
        width=observation.width,
        num_risers=num_risers,
        left_bounded=left_bounded,
        right_bounded=right_bounded,
        overhang=observation.overhang if np.isfinite(observation.overhang_std) else float("nan"),
        bottom_seen=observation.floor_seen,
        top_seen=observation.top_seen,
        std=FlightStd(
            rise=rise,
            run=run,
            width=width_std,
            pitch=float(np.hypot(rise * np.cos(pitch), run * np.sin(pitch)))
            / float(np.hypot(observation.rise, observation.run)),
            heading=turn,
            base=np.array(
                [np.hypot(along * cosine, width_std * sine), np.hypot(along * sine, width_std * cosine), up]
            ),
            overhang=observation.overhang_std,
        ),
        steps=_steps(observation),
    )


def _steps(observation: StairObservation) -> tuple[Step, ...]:
    """The steps from the lowest seen to the highest; those between that were not seen lie on the lattice."""
    seen = {edge.step_index: edge for edge in observation.edges}
    left = np.array([-observation.forward[1], observation.forward[0], 0.0])
    half = np.outer([0.5, -0.5], observation.width * left)
    steps = []
    for index in range(min(seen), max(seen) + 1):
        if index in seen:
            edge = seen[index]
            steps.append(Step(nosing=edge.nosing, num_observations=1, std=edge.std))
        else:
            along = observation.run * observation.forward + observation.rise * observation.up
            steps.append(Step(nosing=observation.origin + index * along + half, num_observations=0))
    return tuple(steps)
