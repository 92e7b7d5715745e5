"""The default modeler: observations and a trajectory in, stairways out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from stairmap.arrays import IntArray
from stairmap.config import Config
from stairmap.detection.observation import StairObservation
from stairmap.modeling.duplicates import without_duplicates
from stairmap.modeling.fitting import FittedFlight
from stairmap.modeling.flight_groups import FlightGroups, GroupFit
from stairmap.modeling.known_poses import KnownPoses, PoseChange, PoseMemory
from stairmap.modeling.landings import join_flights, make_landing
from stairmap.modeling.look_table import LOOK_FIELDS, LookTable
from stairmap.modeling.looks import Look
from stairmap.modeling.observation_table import ObservationTable
from stairmap.modeling.pose_drift import CameraWay, widened_by_drift
from stairmap.stairway import Flight, Stairway
from stairmap.trajectory import Trajectory

MAX_ID = 10_000_000
"""More stairways than this no saved state has given an id: the map would have been full before."""


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
    looks
        Records of ``LOOK_FIELDS``.
    """

    observations: np.ndarray[tuple[int], np.dtype[np.void]]
    edges: np.ndarray[tuple[int], np.dtype[np.void]]
    ids: IntArray
    next_id: int
    looks: np.ndarray[tuple[int], np.dtype[np.void]] = field(
        default_factory=lambda: np.zeros(0, dtype=LOOK_FIELDS)
    )


class StairwayMapper:
    """Models every stairway of a map.

    Observations stay in the camera frame. Each query places them by the trajectory it is given,
    groups them into flights, and fits these; so a loop closure moves every stairway, and two that
    drift had torn apart become one again. Ids stay with the observations.

    A query does anew what observations, looks and poses changed since the last one, and gives the same as one
    that does everything anew, ids apart: these depend on what was reported before.

    Parameters
    ----------
    config
        Uses the section ``modeling``.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._next_id = 1
        self._start(ObservationTable(), LookTable(), np.zeros(0, dtype=np.int64))

    def _start(self, table: ObservationTable, looks: LookTable, ids: IntArray) -> None:
        """Go on from these, with nothing known of poses."""
        self._table, self._looks, self._ids = table, looks, ids
        self._groups = FlightGroups(table, min_observations=self._config.modeling.min_observations)
        self._memory, self._way = PoseMemory(), CameraWay()
        self._poses_of_observations, self._poses_of_looks = KnownPoses(), KnownPoses()
        self._num_asked, self._num_looked = (0, 0), 0
        self._fitted: tuple[FittedFlight, ...] = ()
        self._answer: tuple[Stairway, ...] | None = ()

    def add(self, observation: StairObservation) -> None:
        """Take in one observation, at a cost that does not depend on how many came before."""
        if observation.edges:
            self._table.add(observation)

    def add_look(self, look: Look) -> None:
        """Take in what a frame saw of a stairway that was modelled before it (``look_at_flights``).

        A flight that the last looks at it missed is withdrawn (``look_table.is_withdrawn``); it comes back
        when later observations or looks see it again.
        """
        self._looks.add(look)

    def state(self) -> MapperState:
        """Return a copy of what is known, ids included."""
        ids = np.zeros(len(self._table), dtype=np.int64)
        ids[: len(self._ids)] = self._ids
        return MapperState(
            observations=self._table.observations.copy(),
            edges=self._table.edges.copy(),
            ids=ids,
            next_id=self._next_id,
            looks=self._looks.records.copy(),
        )

    def restore(self, state: MapperState) -> None:
        """Go on from a state: the same observations then give the same stairways under the same ids.

        Raises
        ------
        ValueError
            If its records are not of this version, or do not belong together.
        """
        if state.ids.shape != (len(state.observations),):
            raise ValueError(f"{len(state.observations)} observations have {len(state.ids)} ids")
        ids = np.array(state.ids, dtype=np.int64)
        if not 1 <= state.next_id <= MAX_ID or (len(ids) and not 0 <= ids.min() <= ids.max() < state.next_id):
            raise ValueError(
                f"expected ids from 0 to {state.next_id - 1:,}, the last one given, below {MAX_ID:,}"
            )
        self._start(
            ObservationTable.from_records(state.observations, state.edges),
            LookTable.from_records(state.looks),
            ids,
        )
        self._next_id = state.next_id

    def stairways(self, trajectory: Trajectory) -> tuple[Stairway, ...]:
        """Return the confirmed stairways as a trajectory places them, by id.

        A flight is confirmed by three steps that were each seen twice, by
        ``modeling.min_observations`` observations that measured their rise well and agree with it,
        and by the agreement of more than half of all it has. It is withdrawn when later ones
        disagree: views of a spiral do; and when looks that must have seen it did not.

        Parameters
        ----------
        trajectory
            Poses of the camera; observations and looks without a pose in it are left out.
        """
        fitted = self._fit_flights(trajectory)
        if self._answer is None:
            self._answer = self._make_stairways(fitted)
        return self._answer

    def flights(self, trajectory: Trajectory) -> tuple[Flight, ...]:
        """Return the flights of the confirmed stairways, for looks at them.

        Unlike ``stairways`` it gives out no ids: how often it is asked changes no answer.
        """
        return tuple(item.flight for item in self._fit_flights(trajectory))

    def _fit_flights(self, trajectory: Trajectory) -> tuple[FittedFlight, ...]:
        """The confirmed flights as a trajectory places them."""
        num_asked = (len(self._table), len(self._looks))
        if num_asked == self._num_asked and self._memory.has_same(trajectory):
            return self._fitted
        goes_on = self._memory.goes_on(trajectory)
        stamps, look_stamps = self._table.observations["stamp_ns"], self._looks.records["stamp_ns"]
        change = self._poses_of_observations.renew(stamps, trajectory, memory=self._memory, goes_on=goes_on)
        look_change = self._poses_of_looks.renew(
            look_stamps, trajectory, memory=self._memory, goes_on=goes_on
        )
        self._memory.keep(trajectory)
        self._num_asked = num_asked
        self._groups.renew(change)
        groups = [item for item in self._groups.groups if item.fitted is not None]
        self._look_again(groups, look_change)
        self._widen(groups, trajectory, goes_on=goes_on)
        fitted = [item.widened for item in groups if item.widened is not None and not item.is_withdrawn]
        self._fitted, self._answer = tuple(without_duplicates(fitted)), None
        return self._fitted

    def _look_again(self, groups: list[GroupFit], change: PoseChange) -> None:
        """Compare the looks with the flights, as far as either is new."""
        moved = self._looks.place(change.chosen, change.poses) & ~change.is_new
        is_known = self._poses_of_looks.is_known
        num = len(self._looks)
        # A look that moved or came into the trajectory late may be of another flight now.
        is_late = change.is_new & (change.chosen < self._num_looked)
        if len(change.lost) or moved.any() or is_late.any():
            for item in groups:
                item.forget_looks()
        self._num_looked = num
        for item in groups:
            if item.fitted is None or item.num_looks == num:
                continue
            chosen = item.num_looks + np.flatnonzero(is_known[item.num_looks :])
            item.num_looks = num
            chosen = chosen[self._looks.are_at(item.fitted.flight, chosen)]
            if len(chosen):
                records = self._looks.records[chosen]
                seen = self._table.observations["stamp_ns"][item.group.members]
                item.take_looks(records["stamp_ns"], records["is_absent"], seen)

    def _widen(self, groups: list[GroupFit], trajectory: Trajectory, *, goes_on: bool) -> None:
        """Make place and heading of flights as uncertain as the configured drift makes them."""
        modeling = self._config.modeling
        heading_drift = float(np.radians(modeling.pose_heading_drift_deg))
        has_drift = modeling.pose_drift > 0 or heading_drift > 0
        if has_drift:
            self._way.follow(trajectory, goes_on=goes_on)
        for item in groups:
            if item.fitted is None or (item.widened is not None and (goes_on or not has_drift)):
                continue
            item.widened = item.fitted
            if has_drift:
                stamps = self._table.observations["stamp_ns"][item.group.members]
                flight = widened_by_drift(
                    item.fitted.flight,
                    float(self._way.until(stamps).mean()),
                    drift=modeling.pose_drift,
                    heading_drift=heading_drift,
                )
                item.widened = replace(item.fitted, flight=flight)

    def _make_stairways(self, fitted: Sequence[FittedFlight]) -> tuple[Stairway, ...]:
        """Join flights, give each stairway its id."""
        stamps = self._table.observations["stamp_ns"]
        previous = np.zeros(len(self._table), dtype=np.int64)
        previous[: len(self._ids)] = self._ids
        # What is not reported keeps its id, for the case that it comes back.
        self._ids = previous.copy()
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
        counts = np.bincount(previous)
        counts[0] = 0
        for candidate in np.argsort(-counts, kind="stable").tolist():
            if counts[candidate] == 0:
                break
            if candidate not in taken:
                return int(candidate)
        new_id = self._next_id
        self._next_id += 1
        return new_id
