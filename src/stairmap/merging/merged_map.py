"""Make the runs of one site one map: stairways that several runs saw become one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from stairmap.errors import MergeError
from stairmap.merging.alignment import SiteAlignment
from stairmap.merging.landmarks import Sighting, lies_on
from stairmap.merging.merged_flight import merge_flights, moved_flight
from stairmap.modeling.landings import make_landing
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import invert_transform


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """What a run knew of a stairway.

    Attributes
    ----------
    run
        Path of the run folder.
    stairway_id
        Its id there.
    num_observations, first_seen_ns, last_seen_ns
        As there.
    """

    run: str
    stairway_id: int
    num_observations: int
    first_seen_ns: int
    last_seen_ns: int

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types."""
        return {
            "run": self.run,
            "stairway": self.stairway_id,
            "num_observations": self.num_observations,
            "first_seen_ns": self.first_seen_ns,
            "last_seen_ns": self.last_seen_ns,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class MergeInput:
    """A run that is merged.

    Attributes
    ----------
    name
        Of its folder.
    stairways
        In its own map.
    sources
        What each of them rests on, by id: the run itself, or those of a map that was merged before.
    num_frames
        Frames that were looked at.
    floors
        Heights of its floors, m: where the robot stood, and where ends of stairs were seen.
    """

    name: str
    stairways: tuple[Stairway, ...]
    sources: Mapping[int, tuple[Source, ...]]
    num_frames: int
    floors: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MergedMap:
    """The stairways of a site, in the map of the first run, and what each rests on, by id."""

    stairways: tuple[Stairway, ...]
    sources: Mapping[int, tuple[Source, ...]]


def sightings_of(run: int, stairways: Sequence[Stairway]) -> tuple[Sighting, ...]:
    """Return the flights of a run as landmarks."""
    return tuple(
        Sighting(
            run=run,
            stairway_id=stairway.id,
            flight_index=index,
            flight=flight,
            num_observations=stairway.num_observations,
        )
        for stairway in stairways
        for index, flight in enumerate(stairway.flights)
    )


def merge_runs(inputs: Sequence[MergeInput], alignment: SiteAlignment) -> MergedMap:
    """Make one map.

    Ids are those of the first run, and new ones after them: merge into the map of last time, named first, and
    its ids stay.

    Parameters
    ----------
    inputs
        The runs.
    alignment
        How their maps lie.

    Raises
    ------
    MergeError
        If a run is among them twice, perhaps as a part of a merged map: it would count twice.
    """
    _check_once(inputs)
    groups = _group_flights(inputs, alignment)
    chains = _group_stairways(inputs, groups)
    next_id = 1 + max((stairway.id for stairway in inputs[0].stairways), default=0)
    stairways, sources = [], {}
    for chain in chains:
        members = sorted({(item.run, item.stairway_id) for group in chain for item, _ in group})
        old = [stairway_id for run, stairway_id in members if run == 0]
        stairway_id, next_id = (min(old), next_id) if old else (next_id, next_id + 1)
        known = [source for run, member in members for source in inputs[run].sources[member]]
        flights = sorted((_merged(group, alignment) for group in chain), key=lambda flight: flight.base[2])
        stairways.append(
            Stairway(
                id=stairway_id,
                flights=tuple(flights),
                landings=tuple(make_landing(lower, upper) for lower, upper in pairwise(flights)),
                num_observations=sum(source.num_observations for source in known),
                first_seen_ns=min(source.first_seen_ns for source in known),
                last_seen_ns=max(source.last_seen_ns for source in known),
            )
        )
        sources[stairway_id] = tuple(known)
    return MergedMap(stairways=tuple(sorted(stairways, key=lambda item: item.id)), sources=sources)


def _check_once(inputs: Sequence[MergeInput]) -> None:
    seen: dict[tuple[str, int], str] = {}
    for given in inputs:
        for source in (source for sources in given.sources.values() for source in sources):
            other = seen.setdefault((source.run, source.stairway_id), given.name)
            if other != given.name:
                raise MergeError(
                    f"the run {source.run} is in {other} and in {given.name}; leave one of them out"
                )


_Group = list[tuple[Sighting, int]]
"""Sightings of one flight, each with how many steps higher than the first one's foot its own is."""


def _group_flights(inputs: Sequence[MergeInput], alignment: SiteAlignment) -> list[_Group]:
    groups: list[_Group] = []
    for run, given in enumerate(inputs):
        for sighting in sightings_of(run, given.stairways):
            for group in groups:
                first, _ = group[0]
                transform = (
                    invert_transform(alignment.site_from_run[first.run]) @ alignment.site_from_run[run]
                )
                shift = lies_on(first.flight, sighting.flight, transform)
                if shift is not None and all(item.run != run for item, _ in group):
                    group.append((sighting, shift))
                    break
            else:
                groups.append([(sighting, 0)])
    return groups


def _group_stairways(inputs: Sequence[MergeInput], groups: Sequence[_Group]) -> list[list[_Group]]:
    """Groups of flights whose stairways have a flight in common, in the order of runs and ids."""
    chain_of: dict[tuple[int, int], list[_Group]] = {}
    chains: list[list[_Group]] = []
    for group in groups:
        keys = [(item.run, item.stairway_id) for item, _ in group]
        found = [chain for chain in chains if any(chain_of.get(key) is chain for key in keys)]
        chain = found[0] if found else []
        if not found:
            chains.append(chain)
        for other in found[1:]:
            chain += other
            chains.remove(other)
            chain_of |= {key: chain for key, value in chain_of.items() if value is other}
        chain.append(group)
        chain_of |= dict.fromkeys(keys, chain)
    return chains


def _merged(group: _Group, alignment: SiteAlignment) -> Flight:
    flights = [moved_flight(item.flight, alignment.site_from_run[item.run]) for item, _ in group]
    return merge_flights(flights, [shift for _, shift in group])
