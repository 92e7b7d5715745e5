"""Edges of the ground over a drive, in numbers: who changes a limit on purpose writes them anew."""

from __future__ import annotations

import numpy as np

from analytic_stairs import pose_looking
from solid_scenes import frame_of
from stairmap.arrays import Transform
from stairmap.drop import Drop
from stairmap.session import MapSession
from stairmap.simulation.triangle_mesh import joined, make_block, make_rectangle

TURN = 0.6
"""How far the scene and the drive are turned in the map, rad."""


def in_turned_map(pose: Transform) -> Transform:
    """A pose in a map where everything is turned, and lies elsewhere."""
    other = np.eye(4)
    other[:2, :2] = [[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]]
    other[:3, 3] = (3.0, -2.0, 0.4)
    return np.asarray(other @ pose)


CORNER = joined([make_block((-8, -4, -1.0), (0, 0.9, 0.0)), make_rectangle((-8, -4), (8, 6), -0.45)])
"""Ground that ends ahead, at x = 0, and to the left, at y = 0.9, over ground 0.45 m lower."""


def drive(session: MapSession, first: int, num: int) -> tuple[Drop, ...]:
    """Come nearer to the corner, looking to either side by turns, with poses that err by a centimetre."""
    for number in range(first, first + num):
        random = np.random.default_rng(number)
        place = np.array([-2.3 + 0.08 * number, -0.2 + 0.02 * number, 0.7])
        yaw = 0.25 + 0.3 * (-1) ** number
        frame = frame_of(
            [CORNER], pose_looking(tuple(place), yaw=yaw, down=0.45), stamp_ns=number * 10**8, has_up=False
        )
        believed = pose_looking(tuple(place + random.normal(0, 0.01, 3)), yaw=yaw, down=0.45)
        session.add(frame, in_turned_map(believed))
    return session.drops()


def numbers(drops: tuple[Drop, ...]) -> list[list[float]]:
    return [
        [
            float(drop.id), float(drop.num_observations), drop.first_seen_ns / 1e8, drop.last_seen_ns / 1e8,
            *np.round(1e3 * drop.edge.ravel(), 1).tolist(), 1e3 * (drop.depth or 0.0),
        ]
        for drop in drops
    ]  # fmt: skip


EXPECTED = [
    [
        [1.0, 5.0, 0.0, 4.0, 1217.9, -2131.1, 406.7, 2438.4, -1300.8, 406.7, 450.0],
        [2.0, 6.0, 0.0, 5.0, 2525.8, -1304.5, 402.4, 3776.4, -3126.4, 402.4, 450.0],
    ],
    [
        [1.0, 8.0, 0.0, 10.0, 1217.1, -2129.9, 394.3, 2412.4, -1316.4, 394.3, 450.0],
        [2.0, 12.0, 0.0, 11.0, 2490.9, -1269.7, 397.8, 3762.9, -3109.5, 397.8, 450.0],
    ],
    [
        [1.0, 11.0, 0.0, 16.0, 1217.2, -2130.1, 397.1, 2391.1, -1327.7, 397.1, 450.0],
        [2.0, 18.0, 0.0, 17.0, 2554.9, -1348.7, 399.9, 3763.1, -3109.3, 399.9, 450.0],
    ],
]
"""Of six frames each: number, frames, first and last of them, ends, mm, and depth, mm."""


def test_edges_of_a_corner_are_told_with_the_numbers_they_had() -> None:
    session = MapSession()
    for part, expected in enumerate(EXPECTED):
        found = drive(session, 6 * part, 6)
        np.testing.assert_allclose(numbers(found), expected, rtol=1e-4, atol=0.5)
        for drop in found:
            # Ahead is what falls along the scene's x axis, to the left what falls along its y axis.
            angle = TURN + (np.pi / 2 if drop.id == 1 else 0.0)
            np.testing.assert_allclose(drop.outward[:2], [np.cos(angle), np.sin(angle)], atol=0.03)
