"""A site with stairways, and what runs in maps of their own see of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from stairmap.merging.merged_flight import moved_flight
from stairmap.merging.merged_map import MergeInput, Source
from stairmap.stairway import Flight, FlightStd, Stairway
from stairmap.transforms import invert_transform, transform_from_parts

STD = FlightStd(rise=0.001, run=0.001, width=0.01, pitch=0.003, heading=0.005, base=np.full(3, 0.02))


def level_transform(x=0.0, y=0.0, z=0.0, yaw=0.0):
    cos, sin = math.cos(yaw), math.sin(yaw)
    return transform_from_parts(np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]), np.array([x, y, z]))


def make_flight(base=(0.0, 0.0, 0.0), heading=0.0, rise=0.17, run=0.28, width=1.2, num_risers=10, **values):
    values = {"bottom_seen": True, "top_seen": True, "std": STD, **values}
    return Flight(
        base=np.array(base), heading=heading, rise=rise, run=run, width=width, num_risers=num_risers, **values
    )


def cut_flight(flight, first, end):
    """A flight of which only the steps from ``first`` to ``end`` were seen."""
    return replace(
        flight,
        base=flight.base + first * (flight.forward * flight.run + np.array([0, 0, flight.rise])),
        num_risers=end - first,
        bottom_seen=flight.bottom_seen and first == 0,
        top_seen=flight.top_seen and end == flight.num_risers,
    )


def see(flights, site_from_run, *, seed, name="run", num_observations=5):
    """The run that saw these flights of the site in its own map, with noise; a stairway each."""
    random = np.random.default_rng(seed)
    stairways = []
    for number, flight in enumerate(flights, start=1):
        moved = moved_flight(flight, invert_transform(site_from_run))
        noisy = replace(
            moved,
            base=moved.base + random.normal(0, 0.02, 3),
            heading=moved.heading + random.normal(0, 0.005),
            rise=moved.rise + random.normal(0, 0.001),
            run=moved.run + random.normal(0, 0.001),
        )
        stairways.append(
            Stairway(
                id=number, flights=(noisy,), num_observations=num_observations,
                first_seen_ns=100 * seed, last_seen_ns=100 * seed + number,
            )
        )  # fmt: skip
    return as_input(stairways, name)


def as_input(stairways, name):
    return MergeInput(
        name=name, stairways=tuple(stairways), num_frames=10,
        sources={
            item.id: (
                Source(run=f"/{name}", stairway_id=item.id, num_observations=item.num_observations,
                       first_seen_ns=item.first_seen_ns, last_seen_ns=item.last_seen_ns),
            )
            for item in stairways
        },
    )  # fmt: skip
