"""Groups of observations and the flights fitted to them, kept from one query to the next.

What a query costs is what changed since the last one: observations that came in or whose pose moved, the
groups in reach of these, and the fits of groups that have other members now. The result is the same, bit for
bit, as if all had been grouped and fitted anew.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import IntArray, Mask
from stairmap.modeling.association import ObservationGroup, Reach, close_groups, find_groups
from stairmap.modeling.fitting import FittedFlight, fit_flight
from stairmap.modeling.known_poses import PoseChange
from stairmap.modeling.look_table import is_withdrawn
from stairmap.modeling.observation_table import ObservationTable, PlacedObservations

MIN_CONFIRMED_STEPS = 3
"""A stairway is reported when this many of its steps were seen at least twice."""

MIN_AGREEING_SHARE = 0.55
"""Share of a flight's observations whose rise and run must agree with it."""

MAX_INCOMING_SHARE = 0.25
"""Where more than this share of all observations are new or moved, all are grouped anew: looking for those
that need not be would cost more."""


class GroupFit:
    """A group, the flight that it confirms, and what the mapper has found out about it since.

    Attributes
    ----------
    group
        The observations.
    fitted
        Their flight; ``None`` while it is not confirmed.
    widened
        The flight as uncertain as drift makes it; ``None`` until asked for.
    num_looks
        How many looks have been compared with the flight.
    absent_ns, present_ns
        Stamps of those that were at it and missed it, or saw it.
    is_withdrawn
        Whether looks speak against it.
    """

    def __init__(self, group: ObservationGroup, fitted: FittedFlight | None) -> None:
        self.group, self.fitted = group, fitted
        self.widened: FittedFlight | None = None
        self.num_looks = 0
        self.absent_ns: IntArray = np.zeros(0, dtype=np.int64)
        self.present_ns: IntArray = np.zeros(0, dtype=np.int64)
        self.is_withdrawn = False

    def take_looks(self, stamps_ns: IntArray, is_absent: Mask, seen_ns: IntArray) -> None:
        """Let looks at the flight count, beside the observations at ``seen_ns``."""
        self.absent_ns = np.append(self.absent_ns, stamps_ns[is_absent])
        self.present_ns = np.append(self.present_ns, stamps_ns[~is_absent])
        self.is_withdrawn = is_withdrawn(self.absent_ns, np.append(self.present_ns, seen_ns))

    def forget_looks(self) -> None:
        """Begin anew with the looks: some of them are elsewhere now."""
        self.num_looks = 0
        self.absent_ns = self.present_ns = np.zeros(0, dtype=np.int64)
        self.is_withdrawn = False


class FlightGroups:
    """The groups of all observations that have a pose.

    Parameters
    ----------
    table
        The observations.
    min_observations
        Fewest observations of a flight.
    """

    def __init__(self, table: ObservationTable, *, min_observations: int) -> None:
        self._table = table
        self._min_observations = min_observations
        self._placed = PlacedObservations(table)
        self._groups: list[GroupFit] = []

    @property
    def groups(self) -> list[GroupFit]:
        """The groups, largest first; of equal ones, that with the better seed."""
        ranked = sorted(self._groups, key=lambda item: (-item.group.seed_quality, item.group.seed))
        return sorted(ranked, key=lambda item: -len(item.group.members))

    def renew(self, change: PoseChange) -> bool:
        """Take in what the poses of a query say otherwise; return whether anything is new."""
        moved = self._placed.place(change.chosen, change.poses) | change.is_new
        incoming = change.chosen[moved]
        if not len(incoming) and not len(change.lost):
            return False
        is_gone = np.zeros(len(self._table), dtype=np.bool_)
        is_gone[incoming] = is_gone[change.lost] = True
        affected = self._find_affected(incoming, is_gone)
        kept = [item for item, is_affected in zip(self._groups, affected, strict=True) if not is_affected]
        old = [item for item, is_affected in zip(self._groups, affected, strict=True) if is_affected]
        rest = [item.group.members[~is_gone[item.group.members]] for item in old]
        chosen = np.sort(np.concatenate([incoming, *rest]))
        # A fit depends on its members and their places alone.
        unmoved = {
            item.group.members.tobytes(): item for item in old if not is_gone[item.group.members].any()
        }
        for group in find_groups(self._placed, chosen):
            same = unmoved.get(group.members.tobytes())
            if same is not None:
                same.group = group
            kept.append(GroupFit(group, self._fit(group.members)) if same is None else same)
        self._groups = kept
        return True

    def _find_affected(self, incoming: IntArray, is_gone: Mask) -> Mask:
        """(G,) which groups may change."""
        groups = [item.group for item in self._groups]
        touched = np.array([is_gone[group.members].any() for group in groups], dtype=np.bool_)
        if len(incoming) > MAX_INCOMING_SHARE * len(self._table):
            return np.ones(len(groups), dtype=np.bool_)
        reach = Reach(self._placed, incoming)
        return close_groups(groups, touched, reach.low, reach.high)

    def _fit(self, members: IntArray) -> FittedFlight | None:
        """The flight of a group, if it confirms one."""
        if len(members) < self._min_observations:
            return None
        fitted = fit_flight(self._table, self._placed, members)
        is_confirmed = (
            fitted.num_confirmed_steps >= MIN_CONFIRMED_STEPS
            and fitted.num_precise >= self._min_observations
            and fitted.num_agreeing >= MIN_AGREEING_SHARE * len(members)
        )
        return fitted if is_confirmed else None
