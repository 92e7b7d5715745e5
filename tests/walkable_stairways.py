"""Stairways for the tests of navigation: any dimensions, any uncertainty."""

from __future__ import annotations

import numpy as np

from stairmap.stairway import Flight, FlightStd, Landing, Stairway


def make_std(rise=0.002, run=0.003, width=0.02, pitch=0.008):
    return FlightStd(rise=rise, run=run, width=width, pitch=pitch, heading=0.01, base=np.full(3, 0.01))


def make_flight(base=(0.0, 0.0, 0.0), heading=0.0, rise=0.17, run=0.28, width=1.2, num_risers=10, **others):
    others = {"std": make_std(), "bottom_seen": True, "top_seen": True, **others}
    return Flight(
        base=np.array(base), heading=heading, rise=rise, run=run, width=width, num_risers=num_risers, **others
    )


def make_stairway(*flights, stairway_id=1, landings=()):
    return Stairway(
        id=stairway_id,
        flights=flights or (make_flight(),),
        landings=landings,
        num_observations=9,
        first_seen_ns=0,
        last_seen_ns=10**9,
    )


def make_half_turn(height=3.06, width=1.2):
    """Return a stairway of two flights side by side with a landing between them; it rises by ``height``."""
    rise = height / 18
    lower = make_flight(rise=rise, width=width, num_risers=9)
    upper = make_flight(base=(8 * 0.28, 1.3, 9 * rise), heading=np.pi, rise=rise, width=width, num_risers=9)
    landing = Landing(center=[8 * 0.28 + 0.6, 0.65, 9 * rise], size=(1.2, 2.5), heading=0.0)
    return make_stairway(lower, upper, landings=(landing,))
