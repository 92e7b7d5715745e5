"""Grounds that end: docks, wells, stairs that go down, kerbs and ramps, each with its edge at x = 0."""

from __future__ import annotations

import numpy as np

from stairmap.simulation.triangle_mesh import (
    TriangleMesh,
    joined,
    make_block,
    make_prism,
    make_rectangle,
    make_wall,
)


def dock(depth: float, *, wall_at: float = 4.0) -> TriangleMesh:
    """Ground that ends at x = 0 over another ``depth`` m lower, with a wall beyond."""
    return joined(
        [
            make_block((-8, -4, -depth), (0, 4, 0.0)),
            make_rectangle((0, -4), (wall_at, 4), -depth),
            make_wall((wall_at, -4), (wall_at, 4), -depth, 3.0),
        ]
    )


def deep_dock() -> TriangleMesh:
    """Ground that ends at x = 0 over nothing that any sensor sees."""
    return make_block((-8, -4, -30), (0, 4, 0.0))


def deep_well() -> TriangleMesh:
    """Ground about a well from x = 0 to 2, 2 m wide, of which no sensor sees the bottom or a side."""
    parts = [((-8, -4), (0, 4)), ((2, -4), (6, 4)), ((0, 1), (2, 4)), ((0, -4), (2, -1))]
    return joined([*(make_rectangle(*part, 0.0) for part in parts), make_wall((6, -4), (6, 4), 0.0, 3.0)])


def stairs_down(num_risers: int = 14, rise: float = 0.17, run: float = 0.28) -> TriangleMesh:
    """A flight down along +x whose top nosing is at x = 0, between walls, with a wall at its foot."""
    profile = [(-8.0, -4.0), (-8.0, 0.0), (0.0, 0.0)]
    for index in range(1, num_risers):
        profile += [((index - 1) * run, -index * rise), (index * run, -index * rise)]
    foot = ((num_risers - 1) * run, -num_risers * rise)
    profile += [foot, (foot[0], -4.0)]
    return joined(
        [
            make_prism(profile, -0.6, 0.6),
            make_block((-8, 0.6, -0.3), (6, 4, 0.0)),
            make_block((-8, -4, -0.3), (6, -0.6, 0.0)),
            make_wall((0, 0.6), (6, 0.6), -3.0, 0.0),
            make_wall((0, -0.6), (6, -0.6), -3.0, 0.0),
            make_rectangle((foot[0], -0.6), (6, 0.6), foot[1]),
            make_wall((6, -4), (6, 4), -3.0, 3.0),
        ]
    )


def ramp_down(slope_deg: float, length: float = 4.0) -> TriangleMesh:
    """Ground that falls from x = 0 on, evenly, down to lower ground."""
    fall = float(np.tan(np.radians(slope_deg))) * length
    profile = [(-8, -3), (-8, 0), (0, 0), (length, -fall), (length + 4, -fall), (length + 4, -3)]
    return joined([make_prism(profile, -4, 4), make_wall((length + 4, -4), (length + 4, 4), -3.0, 3.0)])
