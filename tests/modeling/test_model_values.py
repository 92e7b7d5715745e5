"""What is made of hard observations and looks, in numbers: who changes a weight on purpose writes them anew.

Views are of few steps each, with noise, from poses that err, and some of another flight: all weights and
limits of association and fit have a say in the result.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analytic_stairs import AnalyticStairs, pose_looking
from ideal_observations import MS, make_flight, mapper_of, observe, poses_before, trajectory_of, turned_map
from solid_scenes import frame_of, room, stairs_solid
from stairmap.config import load_config
from stairmap.modeling.looks import Look, look_at
from stairmap.simulation.triangle_mesh import make_block
from stairmap.stairway import Flight, FlightStd, Stairway


def hard_views(*, heading: float, num: int, **config: float) -> tuple[Stairway, ...]:
    """Model flights of which each frame shows a few steps, from poses that drift and err."""
    random = np.random.default_rng(11)
    lower = make_flight(base=np.array([2.0, -1.0, 0.3]), heading=heading)
    behind = lower.base + 4.1 * lower.forward + [0.0, 0.0, 8 * 0.17]
    upper = make_flight(base=behind, heading=heading + 0.5, num_risers=7)
    observations, poses = [], []
    for index in range(num):
        flight = (lower, lower, upper)[index % 3]
        pose = poses_before(flight, num)[index]
        first = int(random.integers(0, 4))
        steps = [step for step in range(first, min(first + 5, flight.num_risers)) if random.random() < 0.85]
        seen = observe(
            flight, pose, index * 100 * MS, steps=steps, noise=0.012,
            floor_seen=first == 0 and index % 2 == 0, top_seen=first == 3 and index % 4 == 1,
            bounded=index % 5 > 0,
            edge_std=(0.006, 0.004) if index % 4 else (float("nan"), float("nan")),
            overhang=(0.02 + 0.001 * (index % 3), 0.004 if index % 2 else float("nan")),
            raised={2: 0.015, 5: -0.01},
        )  # fmt: skip
        std = random.uniform(0.5, 4.0, 6) * np.sqrt(np.diag(seen.covariance))
        seen = replace(seen, rise=seen.rise + (0.03 if index % 7 == 3 else 0.0), covariance=np.diag(std**2))
        observations.append(seen)
        shift = random.normal(0, [0.02, 0.02, 0.015])
        poses.append(turned_map(0.01 * random.normal() + 0.0005 * index, tuple(shift)) @ pose)
    settings = load_config(None, [f"modeling.{name}={value}" for name, value in config.items()])
    return mapper_of(observations, settings).stairways(trajectory_of(poses))


def measures(flight: Flight) -> list[float]:
    """Lengths, mm, and angles, mrad; then standard deviations; then the steps'."""
    std = flight.std
    assert std is not None
    values = [
        *flight.base, flight.heading, flight.rise, flight.run, flight.width, flight.overhang,
        *std.base, std.heading, std.rise, std.run, std.width, std.pitch, std.overhang,
        *flight.steps[2].nosing.ravel(), *flight.steps[2].std,
        *flight.steps[-1].nosing[0], *flight.steps[-1].std,
    ]  # fmt: skip
    counts = [
        flight.num_risers, *(step.num_observations for step in flight.steps), flight.bottom_seen,
        flight.top_seen, flight.left_bounded, flight.right_bounded,
    ]  # fmt: skip
    return [*(round(1e3 * float(value), 2) for value in values), *(float(count or 0) for count in counts)]


def drawn_ahead() -> list[list[float]]:
    """Flights that head past the wrap of angles, with nothing said of drift."""
    return [measures(flight) for stairway in hard_views(heading=3.1, num=45) for flight in stairway.flights]


def drawn_drifting() -> list[list[float]]:
    """Few views of flights in a map that drifts."""
    stairways = hard_views(heading=-1.0, num=24, pose_drift=0.01, pose_heading_drift_deg=0.3)
    return [measures(flight) for stairway in stairways for flight in stairway.flights]


STD = FlightStd(
    rise=0.001, run=0.001, width=0.01, pitch=0.005, heading=0.03, base=np.array([0.02, 0.01, 0.015])
)
FLIGHT = make_flight(base=np.zeros(3), std=STD, overhang=0.02)
LONG = make_flight(base=np.array([0.0, 0.05, 0.02]), std=STD, heading=0.04, num_risers=13)
BOX = make_block([-0.6, 0.1, 0.0], [-0.3, 0.5, 0.9])


def looks() -> list[list[float]]:
    """Looks from several places at stairs that stand, are gone, or are half hidden."""
    stairs, box = stairs_solid(AnalyticStairs()), BOX
    found = []
    for flight, place, how, solids in (
        (FLIGHT, (-1.5, 0.1, 0.8), {"yaw": -0.03, "down": 0.15}, (stairs,)),
        (FLIGHT, (-1.5, 0.1, 0.8), {"yaw": -0.03, "down": 0.15}, (box,)),
        (LONG, (-0.9, -0.3, 1.3), {"yaw": 0.1, "down": 0.4}, (stairs,)),
        (LONG, (-2.6, 0.2, 0.6), {"yaw": 0.0, "down": -0.1}, (stairs, box)),
        (FLIGHT, (8 * 0.28 + 0.5, 0.0, 8 * 0.17 + 1.0), {"yaw": np.pi, "down": 0.75}, (stairs,)),
    ):
        pose = pose_looking(place, **how)
        look = look_at(flight, frame_of([room(), *solids], pose), pose)
        assert look is not None
        found.append(numbers(look))
    return found


def numbers(look: Look) -> list[float]:
    return [
        look.num_on, look.num_hidden, look.num_through, look.num_unmeasured,
        *np.round(1e3 * look.middle, 2), *np.round(1e3 * look.forward, 2),
    ]  # fmt: skip


VALUES = {
    drawn_ahead: [
        [
            2005.95,
            -979.5,
            292.61,
            3108.52,
            174.22,
            279.98,
            1200.0,
            20.53,
            22.37,
            20.96,
            20.6,
            7.48,
            6.56,
            2.69,
            5.0,
            17.42,
            2.55,
            1429.66,
            -1560.76,
            817.58,
            1469.34,
            -361.42,
            817.58,
            4.47,
            5.38,
            32.78,
            -1514.55,
            1678.88,
            6.55,
            9.34,
            8.0,
            6.0,
            14.0,
            21.0,
            28.0,
            22.0,
            21.0,
            12.0,
            5.0,
            1.0,
            0.0,
            1.0,
            1.0,
        ],
        [
            -2089.21,
            -848.15,
            1646.88,
            -2677.51,
            172.31,
            281.58,
            1200.0,
            22.0,
            25.12,
            30.47,
            23.66,
            11.6,
            6.68,
            3.54,
            5.0,
            18.14,
            3.73,
            -2322.19,
            -1635.74,
            2166.98,
            -2859.32,
            -562.66,
            2166.98,
            5.01,
            6.64,
            -3328.01,
            -2139.19,
            2846.09,
            6.47,
            9.38,
            7.0,
            3.0,
            5.0,
            12.0,
            14.0,
            14.0,
            8.0,
            5.0,
            1.0,
            0.0,
            1.0,
            1.0,
        ],
    ],
    drawn_drifting: [
        [
            1996.67,
            -992.48,
            295.64,
            -995.51,
            172.45,
            279.76,
            1200.0,
            20.5,
            322.97,
            323.22,
            322.95,
            168.88,
            8.15,
            2.96,
            5.0,
            21.64,
            3.49,
            2804.52,
            -1135.5,
            818.39,
            1797.68,
            -1788.4,
            818.39,
            3.95,
            5.93,
            3413.23,
            -2074.21,
            1498.4,
            5.63,
            8.86,
            7.0,
            3.0,
            9.0,
            14.0,
            14.0,
            12.0,
            12.0,
            6.0,
            1.0,
            0.0,
            1.0,
            1.0,
        ],
        [
            4217.67,
            -4412.01,
            1651.85,
            -507.06,
            171.42,
            280.6,
            1200.0,
            22.0,
            370.65,
            371.48,
            368.7,
            192.98,
            6.89,
            4.31,
            5.0,
            19.13,
            4.02,
            4993.88,
            -4156.84,
            2169.63,
            4411.15,
            -5205.85,
            2169.63,
            5.48,
            6.69,
            5978.35,
            -4703.72,
            2856.2,
            6.79,
            9.82,
            7.0,
            3.0,
            3.0,
            6.0,
            7.0,
            7.0,
            4.0,
            3.0,
            1.0,
            0.0,
            1.0,
            1.0,
        ],
    ],
    looks: [
        [42.0, 0.0, 0.0, 0.0, 25.57, -336.28, 2459.25, -30.0, -149.37, 988.33],
        [0.0, 18.0, 24.0, 0.0, 25.57, -336.28, 2459.25, -30.0, -149.37, 988.33],
        [126.0, 0.0, 0.0, 0.0, -157.66, -932.48, 2436.64, 59.96, -388.72, 919.4],
        [29.0, 34.0, 0.0, 0.0, 82.82, -179.8, 4318.18, -39.99, 99.75, 994.21],
        [56.0, 0.0, 0.0, 0.0, -0.0, -32.64, 2374.99, 0.0, 681.64, -731.69],
    ],
}
"""Of each drive, or of all looks, the numbers that it gave."""


@pytest.mark.parametrize("view", VALUES, ids=lambda view: view.__name__)
def test_hard_views_give_the_numbers_they_gave(view: Callable[[], list[list[float]]]) -> None:
    found = view()
    assert len(found) == len(VALUES[view])
    for values, expected in zip(found, VALUES[view], strict=True):
        np.testing.assert_allclose(values, expected, rtol=1e-3, atol=0.05)
