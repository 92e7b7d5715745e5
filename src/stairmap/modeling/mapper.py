"""The default modeler: observations and a trajectory in, stairways out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stairmap.arrays import IntArray
from stairmap.config import Config
from stairmap.detection.observation import StairObservation
from stairmap.modeling.association import find_flights
from stairmap.modeling.duplicates import without_duplicates
from stairmap.modeling.fitting import FittedFlight, fit_flight
from stairmap.modeling.landings import join_flights, make_landing
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations
from stairmap.modeling.pose_drift import travelled_at, widened_by_drift
from stairmap.stairway import Stairway
from stairmap.trajectory import Trajectory

MIN_CONFIRMED_STEPS = 3
"""A stairway is reported when so many of its steps were seen at least twice."""

MIN_AGREEING_SHARE = 0.55
"""Share of a flight's observations whose rise and run must agree with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapperState:
    """All that a mapper knows, to go on from in another process.

    Attributes
    ----------
    observations, edges
        Records of ``OBSERVATION_FIELDS`` and ``EDGE_FIELDS``.
    ids
        (N,) id of the stairway that each observation belongs to, 0 for none.
    next_id
        Id of the next new stairway.
    """

    observations: np.ndarray[tuple[int], np.dtype[np.void]]
    edges: np.ndarray[tuple[int], np.dtype[np.void]]
    ids: IntArray
    next_id: int


class StairwayMapper:
    """Models every stairway of a map.

    Observations stay in the camera frame. Each query places them by the trajectory it is given,
    groups them into flights, and fits these; so a loop closure moves every stairway, and two that
    drift had torn apart become one again. Ids stay with the observations.

    Parameters
    ----------
    config
        Uses the section ``modeling``.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._table = ObservationTable()
        self._ids: IntArray = np.zeros(0, dtype=np.int64)
        self._next_id = 1

    def add(self, observation: StairObservation) -> None:
        """Take in one observation, at a cost that does not depend on how many came before."""
        if observation.edges:
            self._table.add(observation)

    def state(self) -> MapperState:
        """Return a copy of what is known, ids included."""
        ids = np.zeros(len(self._table), dtype=np.int64)
        ids[: len(self._ids)] = self._ids
        return MapperState(
            observations=self._table.observations.copy(),
            edges=self._table.edges.copy(),
            ids=ids,
            next_id=self._next_id,
        )

    def restore(self, state: MapperState) -> None:
        """Go on from a state: the same observations then give the same stairways under the same ids.

        Raises
        ------
        ValueError
            If its records are not of this version, or do not belong together.
        """
        if len(state.ids) != len(state.observations):
            raise ValueError(f"{len(state.observations)} observations have {len(state.ids)} ids")
        self._table = ObservationTable.from_records(state.observations, state.edges)
        self._ids = np.array(state.ids, dtype=np.int64)
        self._next_id = state.next_id

    def stairways(self, trajectory: Trajectory) -> tuple[Stairway, ...]:
        """Return the confirmed stairways as a trajectory places them, by id.

        A flight is confirmed by three steps that were each seen twice, by
        ``modeling.min_observations`` observations that measured their rise well and agree with it,
        and by the agreement of more than half of all it has. It is withdrawn when later ones
        disagree: views of a spiral do.

        Parameters
        ----------
        trajectory
            Poses of the camera; observations without a pose in it are left out.
        """
        if len(self._table) == 0:
            return ()
        stamps = self._table.observations["stamp_ns"]
        known = np.flatnonzero(trajectory.has_pose(stamps))
        if len(known) == 0:
            return ()
        poses = np.tile(np.eye(4), (len(stamps), 1, 1))
        poses[known] = trajectory.poses_at(stamps[known])
        placed = PlacedObservations(self._table, poses)
        groups = find_flights(placed, known)
        fitted = []
        for members in groups:
            if len(members) < self._config.modeling.min_observations:
                continue
            flight = fit_flight(self._table, placed, members)
            if (
                flight.num_confirmed_steps >= MIN_CONFIRMED_STEPS
                and flight.num_precise >= self._config.modeling.min_observations
                and flight.num_agreeing >= MIN_AGREEING_SHARE * len(members)
            ):
                fitted.append(self._with_drift(flight, trajectory))
        return self._make_stairways(without_duplicates(fitted))

    def _with_drift(self, fitted: FittedFlight, trajectory: Trajectory) -> FittedFlight:
        """The flight, its place and heading as uncertain as the configured drift makes them."""
        modeling = self._config.modeling
        heading_drift = float(np.radians(modeling.pose_heading_drift_deg))
        if modeling.pose_drift == 0 and heading_drift == 0:
            return fitted
        stamps = self._table.observations["stamp_ns"][fitted.members]
        travelled = float(travelled_at(trajectory, stamps).mean())
        flight = widened_by_drift(
            fitted.flight, travelled, drift=modeling.pose_drift, heading_drift=heading_drift
        )
        return replace(fitted, flight=flight)

    def _make_stairways(self, fitted: list[FittedFlight]) -> tuple[Stairway, ...]:
        """Join flights, give each stairway its id."""
        stamps = self._table.observations["stamp_ns"]
        previous = np.zeros(len(self._table), dtype=np.int64)
        previous[: len(self._ids)] = self._ids
        self._ids = np.zeros(len(self._table), dtype=np.int64)
        taken: set[int] = set()
        stairways = []
        chains = join_flights([item.flight for item in fitted])
        chains.sort(key=lambda chain: min(int(fitted[index].members[0]) for index in chain))
        for chain in chains:
            members = np.concatenate([fitted[index].members for index in chain])
            stairway_id = self._id_of(previous[members], taken)
            taken.add(stairway_id)
            self._ids[members] = stairway_id
            flights = tuple(fitted[index].flight for index in chain)
            stairways.append(
                Stairway(
                    id=stairway_id,
                    flights=flights,
                    landings=tuple(make_landing(lower, upper) for lower, upper in pairwise(flights)),
                    num_observations=len(members),
                    first_seen_ns=int(stamps[members].min()),
                    last_seen_ns=int(stamps[members].max()),
                )
            )
        return tuple(sorted(stairways, key=lambda stairway: stairway.id))

    def _id_of(self, previous: IntArray, taken: set[int]) -> int:
        """The id that most of these observations had before, or a new one."""
        counts = np.bincount(previous, minlength=1)
        counts[0] = 0
        for candidate in np.argsort(-counts):
            if counts[candidate] == 0:
                break
            if int(candidate) not in taken:
                return int(candidate)
        new_id = self._next_id
        self._next_id += 1
        return new_id
