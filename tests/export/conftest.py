from __future__ import annotations

import numpy as np
import pytest

from stairmap.detection.observation import Detection, Rejection, StairEdge, StairObservation
from stairmap.stairway import Flight, FlightStd, Landing, Stairway, Step


@pytest.fixture
def stairway() -> Stairway:
    std = FlightStd(rise=0.002, run=0.003, width=0.02, pitch=0.01, heading=0.01, base=[0.01, 0.01, 0.01])
    flight = Flight(
        base=[1.0, 2.0, 0.5], heading=0.3, rise=0.165, run=0.292, width=1.175, num_risers=9,
        right_bounded=False, std=std, steps=(Step(nosing=np.arange(6).reshape(2, 3), num_observations=3),),
    )  # fmt: skip
    upper = Flight(base=[4.0, 3.0, 1.985], heading=1.9, rise=0.17, run=0.28, width=1.0, num_risers=4, std=std)
    landing = Landing(center=[3.6, 2.8, 1.985], size=(1.2, 1.3), heading=0.3)
    return Stairway(
        id=3, flights=(flight, upper), landings=(landing,), num_observations=57,
        first_seen_ns=1_300_000_000_000_000_001, last_seen_ns=1_300_000_009_000_000_000,
    )  # fmt: skip


@pytest.fixture
def detection() -> Detection:
    edges = tuple(
        StairEdge(
            nosing=[[-0.5, 0.3 - 0.1 * i, 2 + 0.3 * i], [0.5, 0.3 - 0.1 * i, 2 + 0.3 * i]], step_index=i,
            left_bounded=True, right_bounded=True, cue="jump", num_pixels=50,
        )
        for i in range(3)
    )  # fmt: skip
    observation = StairObservation(
        stamp_ns=12, view="ascending", up=[0, -1, 0], forward=[0, 0, 1], edges=edges, rise=0.1, run=0.3,
        width=1.0, origin=[0, 0.3, 2], covariance=np.zeros((0, 0)), points=np.zeros((0, 3)),
    )  # fmt: skip
    rejection = Rejection(rule="up", measured=float("nan"), limit=6.0, unit="deg")
    return Detection(stamp_ns=12, observations=(observation,), rejections=(rejection,))
