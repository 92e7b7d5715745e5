"""Find how the maps of several runs lie to each other, from the flights and floors that they share.

Every pair of flights that may be the same one proposes how two maps lie. The proposal that puts most flights
on flights wins; among equals, the one that puts the fewest floors between floors, because no building has a
floor half a metre above another. If several are left, nobody knows, and the runs are refused. The maps are
then joined by the surest pairs first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stairmap.arrays import Float64Array, Points, Transform
from stairmap.errors import MergeError
from stairmap.geometry import wrapped_angle
from stairmap.merging.landmarks import (
    Sighting,
    first_from_second,
    lies_on,
    may_be_same,
    sideways_shift,
    step_shifts,
)
from stairmap.transforms import invert_transform, transform_from_parts, transform_points

SAME_PLACE, SAME_TURN = 1.0, np.radians(10)
"""Proposals that differ by less, m and rad, are one."""

SAME_HEIGHT = 0.10
"""Heights of one floor in two maps differ by no more, m: less than the rise of a step, by which stairs with
open ends may be shifted."""

CLEARLY_WORSE = 0.08
"""A proposal is dropped if its flights lie this much farther apart than those of the best one, m: places err
by some 5 cm, and two flights of which one is shifted by a step lie 16 cm apart at best."""

MIN_STOREY = 2.0
"""Two floors of a building lie at least so far apart, m: people stand upright between them."""

RunSightings = Sequence[Sequence[Sighting]]
"""The flights of each run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairAlignment:
    """How the maps of two runs lie to each other.

    Attributes
    ----------
    first, second
        Numbers of the runs.
    first_from_second
        (4, 4) level transform.
    num_common
        Flights that they share.
    num_rivals
        Other ways to put as many flights on flights; with one, nobody knows.
    """

    first: int
    second: int
    first_from_second: Transform
    num_common: int
    num_rivals: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteAlignment:
    """How the maps of all runs lie in the site: in the map of the first run.

    Attributes
    ----------
    site_from_run
        (4, 4) level transform for each run.
    pairs
        What it rests on; empty if it was given.
    """

    site_from_run: tuple[Transform, ...]
    pairs: tuple[PairAlignment, ...] = ()


class _Proposal(NamedTuple):
    """How two maps may lie.

    ``common`` holds (number in first, number in second, steps) of the flights that then coincide, and
    ``misfit`` the largest distance between the places of one of them, m.
    """

    first_from_second: Transform
    common: frozenset[tuple[int, int, int]]
    misfit: float


def find_alignment(
    runs: RunSightings, names: Sequence[str], floors: Sequence[Sequence[float]] | None = None
) -> SiteAlignment:
    """Find how the maps of runs lie to each other.

    Parameters
    ----------
    runs
        The flights of each run.
    names
        Of the runs, for messages.
    floors
        Heights of the floors of each run in its own map, m; ``None``: they are not known.

    Raises
    ------
    MergeError
        If a run shares no flight with the others, or fits them in several ways equally well.
    """
    heights: Sequence[Sequence[float]] = [()] * len(runs) if floors is None else floors
    pairs = [
        pair
        for first in range(len(runs))
        for second in range(first + 1, len(runs))
        if (pair := align_pair(runs[first], runs[second], heights[first], heights[second])) is not None
    ]
    sure = sorted((pair for pair in pairs if not pair.num_rivals), key=lambda pair: -pair.num_common)
    site_from_run: dict[int, Transform] = {0: np.eye(4)}
    used = []
    while len(site_from_run) < len(runs):
        pair = next(
            (item for item in sure if (item.first in site_from_run) != (item.second in site_from_run)), None
        )
        if pair is None:
            raise MergeError(_describe_lost(site_from_run, pairs, names))
        used.append(pair)
        if pair.first in site_from_run:
            site_from_run[pair.second] = site_from_run[pair.first] @ pair.first_from_second
        else:
            site_from_run[pair.first] = site_from_run[pair.second] @ invert_transform(pair.first_from_second)
    return SiteAlignment(
        site_from_run=tuple(site_from_run[number] for number in range(len(runs))), pairs=tuple(used)
    )


def align_pair(
    first: Sequence[Sighting],
    second: Sequence[Sighting],
    first_floors: Sequence[float] = (),
    second_floors: Sequence[float] = (),
) -> PairAlignment | None:
    """Find how two maps lie to each other; ``None`` if they share no flight.

    Parameters
    ----------
    first, second
        Flights of each run.
    first_floors, second_floors
        Heights of the floors that each run knows, in its own map, m.
    """
    proposals: list[tuple[tuple[int, int], _Proposal]] = []
    for one in first:
        for other in second:
            if not may_be_same(one.flight, other.flight):
                continue
            for shift in step_shifts(one.flight, other.flight):
                proposal = first_from_second(one.flight, other.flight, shift)
                common = common_flights(first, second, proposal)
                fitted = _fit_common(first, second, common, proposal)
                shift_up = float(fitted.first_from_second[2, 3])
                between = count_floors_between(first_floors, second_floors, shift_up)
                proposals.append(((len(common), -between), fitted))
    if not proposals:
        return None
    most = max(rank for rank, _ in proposals)
    best = sorted((item for rank, item in proposals if rank == most), key=lambda item: item.misfit)
    places = np.array([sighting.flight.base for sighting in second])
    rivals: list[_Proposal] = []
    for other_way in best[1:]:
        if other_way.misfit > best[0].misfit + CLEARLY_WORSE:
            break
        if not any(_is_same(other_way, known, places) for known in (best[0], *rivals)):
            rivals.append(other_way)
    return PairAlignment(
        first=first[0].run,
        second=second[0].run,
        first_from_second=best[0].first_from_second,
        num_common=most[0],
        num_rivals=len(rivals),
    )


def count_floors_between(first: Sequence[float], second: Sequence[float], shift: float) -> int:
    """Return how many floors of the second map, raised by ``shift``, lie between those of the first.

    A floor that is a storey away from all others counts as little as one that is the same: the first run may
    not have been there.
    """
    apart = [min((abs(height + shift - other) for other in first), default=MIN_STOREY) for height in second]
    return sum(SAME_HEIGHT < distance < MIN_STOREY for distance in apart)


def common_flights(
    first: Sequence[Sighting], second: Sequence[Sighting], first_from_second_map: Transform
) -> list[tuple[int, int, int]]:
    """Return (number in first, number in second, steps) of flights that a transform puts on each other.

    Each flight is on one other at most.
    """
    found: list[tuple[int, int, int]] = []
    taken: set[int] = set()
    for index, one in enumerate(first):
        for other_index, other in enumerate(second):
            if other_index in taken:
                continue
            shift = lies_on(one.flight, other.flight, first_from_second_map)
            if shift is not None:
                found.append((index, other_index, shift))
                taken.add(other_index)
                break
    return found


def _fit_common(
    first: Sequence[Sighting],
    second: Sequence[Sighting],
    common: Sequence[tuple[int, int, int]],
    proposal: Transform,
) -> _Proposal:
    """The proposal that suits all common flights: turn and shift by least squares over their places."""
    if len(common) < 2:
        return _Proposal(proposal, frozenset(common), 0.0)
    targets, sources, turns = [], [], []
    for index, other_index, shift in common:
        one, other = first[index].flight, second[other_index].flight
        local = np.array([shift * one.run, sideways_shift(one, other), shift * one.rise])
        targets.append(transform_points(one.map_from_flight, local))
        sources.append(other.base)
        turns.append(wrapped_angle(one.heading - other.heading))
    turn = _fit_turn(np.array(targets), np.array(sources), turns)
    cos, sin = np.cos(turn), np.sin(turn)
    rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    fitted = transform_from_parts(rotation, np.mean(targets, axis=0) - rotation @ np.mean(sources, axis=0))
    apart = np.linalg.norm(transform_points(fitted, np.array(sources)) - np.array(targets), axis=1)
    return _Proposal(fitted, frozenset(common), float(apart.max()))


def _fit_turn(targets: Float64Array, sources: Float64Array, turns: Sequence[float]) -> float:
    """Turn from headings where flights are near each other, from places where they are far apart."""
    p, q = (targets - targets.mean(axis=0))[:, :2], (sources - sources.mean(axis=0))[:, :2]
    # A place errs by some 5 cm, a heading by half a degree, which is 5 cm in 6 m.
    by_heading = 6.0**2
    sin = float(np.sum(q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]) + by_heading * np.sum(np.sin(turns)))
    cos = float(np.sum(p * q) + by_heading * np.sum(np.cos(turns)))
    return float(np.arctan2(sin, cos))


def _is_same(one: _Proposal, other: _Proposal, places: Points) -> bool:
    """Whether two proposals agree: no flight is shifted by other steps, and places lie near each other."""
    shifts = {pair[:2]: pair[2] for pair in one.common}
    if any(shifts.get(pair[:2], pair[2]) != pair[2] for pair in other.common):
        return False
    first, second = one.first_from_second, other.first_from_second
    turn = np.arctan2(first[1, 0], first[0, 0]) - np.arctan2(second[1, 0], second[0, 0])
    apart = transform_points(first, places) - transform_points(second, places)
    return abs(wrapped_angle(float(turn))) < SAME_TURN and bool(
        np.linalg.norm(apart, axis=1).max() < SAME_PLACE
    )


def _describe_lost(known: dict[int, Transform], pairs: Sequence[PairAlignment], names: Sequence[str]) -> str:
    lost = [number for number in range(len(names)) if number not in known]
    unsure = [pair for pair in pairs if pair.num_rivals and (pair.first in lost) != (pair.second in lost)]
    if unsure:
        pair = max(unsure, key=lambda item: item.num_common)
        return (
            f"{names[pair.first]} and {names[pair.second]} fit each other in {pair.num_rivals + 1} ways with "
            f"{pair.num_common} common flight{'s' if pair.num_common > 1 else ''} each; tell which with "
            "--alignment FILE"
        )
    listed = ", ".join(names[number] for number in lost)
    return (
        f"no stairway joins {listed} with {names[0]}: none has the same dimensions; pass --alignment FILE, "
        "which places each run in the site"
    )
