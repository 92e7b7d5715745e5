"""One flight from what several runs measured of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from stairmap.arrays import Float64Array, Transform
from stairmap.geometry import wrapped_angle
from stairmap.stairway import Flight, FlightStd, Step
from stairmap.transforms import transform_points

MIN_STD = 1e-4
"""No measure counts as surer, m and rad."""

UNKNOWN_STD = 0.05
"""Standard deviation of a measure that tells none, m and rad: enough to let any other one win."""


def moved_flight(flight: Flight, site_from_map: Transform) -> Flight:
    """Return a flight in the map of the site."""
    turn = math.atan2(site_from_map[1, 0], site_from_map[0, 0])
    rotation = np.abs(site_from_map[:3, :3])
    steps = tuple(replace(step, nosing=transform_points(site_from_map, step.nosing)) for step in flight.steps)
    return replace(
        flight,
        base=transform_points(site_from_map, flight.base),
        heading=wrapped_angle(flight.heading + turn),
        std=replace(flight.std, base=rotation @ flight.std.base),
        steps=steps,
    )


def merge_flights(flights: Sequence[Flight], shifts: Sequence[int]) -> Flight:
    """Return one flight of several in one map, each measure weighted by its variance.

    Parameters
    ----------
    flights
        The same flight as several runs have it, moved into the site.
    shifts
        How many steps higher than the first one's foot that of each is; 0 for the first.
    """
    if len(flights) == 1:
        return flights[0]
    rise, rise_std = _mean(flights, lambda flight: (flight.rise, flight.std.rise))
    run, run_std = _mean(flights, lambda flight: (flight.run, flight.std.run))
    pitch_std = _mean(flights, lambda flight: (flight.pitch, flight.std.pitch))[1]
    first_heading = flights[0].heading
    turn, heading_std = _mean(
        flights, lambda flight: (wrapped_angle(flight.heading - first_heading), flight.std.heading)
    )
    low = min(shifts)
    high = max(shift + flight.num_risers for shift, flight in zip(shifts, flights, strict=True))
    width, width_std, bounded = _merge_widths(flights)
    base, base_std = _merge_bases(flights, [shift - low for shift in shifts])
    overhang, overhang_std = _mean_overhang(flights)
    return Flight(
        base=base,
        heading=wrapped_angle(first_heading + turn),
        rise=rise,
        run=run,
        width=width,
        num_risers=high - low,
        left_bounded=bounded[0],
        right_bounded=bounded[1],
        overhang=overhang,
        bottom_seen=_any_end(
            [flight.bottom_seen for flight, shift in zip(flights, shifts, strict=True) if shift == low]
        ),
        top_seen=_any_end(
            [
                flight.top_seen
                for flight, shift in zip(flights, shifts, strict=True)
                if shift + flight.num_risers == high
            ]
        ),
        std=FlightStd(
            rise=rise_std, run=run_std, width=width_std, pitch=pitch_std, heading=heading_std,
            base=base_std, overhang=overhang_std,
        ),
        steps=_merge_steps(flights, [shift - low for shift in shifts], high - low),
    )  # fmt: skip


def _mean(flights: Sequence[Flight], measure: Callable[[Flight], tuple[float, float]]) -> tuple[float, float]:
    values, stds = np.array([measure(flight) for flight in flights]).T
    weights = _weights(stds)
    return float(weights @ values / weights.sum()), float(1 / math.sqrt(weights.sum()))


def _weights(stds: Float64Array) -> Float64Array:
    known = np.where(np.isfinite(stds), np.maximum(stds, MIN_STD), UNKNOWN_STD)
    return np.asarray(1 / known**2)


def _merge_widths(flights: Sequence[Flight]) -> tuple[float, float, tuple[bool, bool]]:
    """Width, its deviation, and which ends were seen: of those that saw both, else of the widest."""
    whole = [flight for flight in flights if flight.left_bounded and flight.right_bounded]
    if whole:
        return *_mean(whole, lambda flight: (flight.width, flight.std.width)), (True, True)
    widest = max(flights, key=lambda flight: flight.width)
    return widest.width, widest.std.width, (widest.left_bounded, widest.right_bounded)


def _merge_bases(flights: Sequence[Flight], shifts: Sequence[int]) -> tuple[Float64Array, Float64Array]:
    feet = np.array(
        [
            transform_points(
                flight.map_from_flight, np.array([-shift * flight.run, 0.0, -shift * flight.rise])
            )
            for flight, shift in zip(flights, shifts, strict=True)
        ]
    )
    weights = _weights(np.array([flight.std.base for flight in flights]))
    total = weights.sum(axis=0)
    return np.asarray((weights * feet).sum(axis=0) / total), np.asarray(1 / np.sqrt(total))


def _mean_overhang(flights: Sequence[Flight]) -> tuple[float, float]:
    known = [flight for flight in flights if math.isfinite(flight.overhang)]
    if not known:
        return math.nan, math.nan
    return _mean(known, lambda flight: (flight.overhang, flight.std.overhang))


def _any_end(seen: Sequence[bool | None]) -> bool | None:
    return True if any(seen) else None if all(value is None for value in seen) else False


def _merge_steps(flights: Sequence[Flight], shifts: Sequence[int], num_risers: int) -> tuple[Step, ...]:
    """Each step as the run saw it that saw it most often, with the views of all."""
    best: dict[int, Step] = {}
    views: dict[int, int] = {}
    for flight, shift in zip(flights, shifts, strict=True):
        for index, step in enumerate(flight.steps):
            number = index + shift
            views[number] = views.get(number, 0) + step.num_observations
            if number not in best or step.num_observations > best[number].num_observations:
                best[number] = step
    return tuple(
        replace(best[number], num_observations=views[number])
        for number in range(num_risers)
        if number in best
    )
