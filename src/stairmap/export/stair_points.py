"""Exact treads, risers and landings of stairways as points or as a height layer, each with class and trust.

A planner with a step limit cannot climb stairs that a map shows smeared. What it gets here is what the model
knows: level treads and upright risers.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from stairmap.arrays import Float64Array, Points, readonly
from stairmap.stairway import Flight, Landing, Stairway
from stairmap.transforms import invert_transform, transform_points

SPACING = 0.02
"""Distance between points, m: what maps of points are thinned to."""

CELL = 0.04
"""Side of a cell of a height layer, m: seven to a tread."""

SEEN, INFERRED = 1.0, 0.5
"""Trust in a step that was seen, and in one between others that was not."""

MAX_CELLS = 25_000_000
"""Most cells of a height layer: a stairway 200 m by 200 m."""


class StairClass(IntEnum):
    """What a point or cell belongs to."""

    NONE = 0
    TREAD = 1
    RISER = 2
    LANDING = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class StairPoints:
    """Points on the surfaces of stairs.

    Attributes
    ----------
    points
        (N, 3), map, m.
    classes
        (N,) uint8 values of ``StairClass``.
    trust
        (N,) float32 between 0 and 1.
    """

    points: Points
    classes: NDArray[np.uint8]
    trust: NDArray[np.float32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points).reshape(-1, 3))
        object.__setattr__(self, "classes", readonly(self.classes, np.uint8))
        object.__setattr__(self, "trust", readonly(self.trust, np.float32))


def points_from_stairways(stairways: Sequence[Stairway], *, spacing: float = SPACING) -> StairPoints:
    """Return points all over the treads, risers and landings of stairways."""
    parts: list[tuple[Points, StairClass, float]] = []
    for stairway in stairways:
        for flight in stairway.flights:
            parts += _flight_parts(flight, spacing)
        parts += [
            (_landing_points(landing, spacing), StairClass.LANDING, SEEN) for landing in stairway.landings
        ]
    return StairPoints(
        points=np.concatenate([np.zeros((0, 3)), *(points for points, _, _ in parts)]),
        classes=np.concatenate([np.zeros(0), *(np.full(len(points), kind) for points, kind, _ in parts)]),
        trust=np.concatenate([np.zeros(0), *(np.full(len(points), trust) for points, _, trust in parts)]),
    )


def _flight_parts(flight: Flight, spacing: float) -> list[tuple[Points, StairClass, float]]:
    """Points of each riser and of the tread behind it; the upper floor is not the flight's."""
    parts = []
    trusts = _trusts(flight)
    across = _spaced(-flight.width / 2, flight.width / 2, spacing)
    for step in range(flight.num_risers):
        s, z = step * flight.run, step * flight.rise
        up = _spaced(z, z + flight.rise, spacing)
        parts.append((_placed(flight, _grid([s], across, up)), StairClass.RISER, trusts[step]))
        if step < flight.num_risers - 1:
            along = _spaced(s, s + flight.run, spacing)
            tread = _grid(along, across, [z + flight.rise])
            parts.append((_placed(flight, tread), StairClass.TREAD, trusts[step]))
    return parts


def _trusts(flight: Flight) -> list[float]:
    seen = [step.num_observations > 0 for step in flight.steps[: flight.num_risers]]
    seen += [not flight.steps] * (flight.num_risers - len(seen))
    return [SEEN if is_seen else INFERRED for is_seen in seen]


def _landing_points(landing: Landing, spacing: float) -> Points:
    along = _spaced(-landing.size[0] / 2, landing.size[0] / 2, spacing)
    across = _spaced(-landing.size[1] / 2, landing.size[1] / 2, spacing)
    local = _grid(along, across, [0.0])
    cosine, sine = np.cos(landing.heading), np.sin(landing.heading)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(local @ turn.T + landing.center)


def _spaced(low: float, high: float, spacing: float) -> Float64Array:
    num = max(int(np.ceil((high - low) / spacing)) + 1, 2)
    return np.linspace(low, high, num)


def _grid(s: Sequence[float] | Float64Array, t: Float64Array, z: Sequence[float] | Float64Array) -> Points:
    return np.stack(np.meshgrid(s, t, z, indexing="ij"), axis=-1).reshape(-1, 3)


def _placed(flight: Flight, local: Points) -> Points:
    return np.asarray(transform_points(flight.map_from_flight, local))


def ply_from_points(stairs: StairPoints) -> bytes:
    """Return a binary PLY file of points with their class and trust; positions are doubles."""
    records = np.zeros(len(stairs.points), dtype=[("position", "<f8", 3), ("class", "u1"), ("trust", "<f4")])
    records["position"], records["class"], records["trust"] = stairs.points, stairs.classes, stairs.trust
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        "comment stairs, metres, map coordinates, z up; class 1 tread, 2 riser, 3 landing\n"
        f"element vertex {len(records)}\nproperty double x\nproperty double y\nproperty double z\n"
        "property uchar class\nproperty float trust\nend_header\n"
    )
    return header.encode("ascii") + records.tobytes()


@dataclass(frozen=True, slots=True, kw_only=True)
class HeightLayer:
    """Heights of a stairway's surface from above.

    Attributes
    ----------
    elevation
        (rows, columns) float32 height of each cell's centre, map z, m; NaN beside the stairs. Row 0 has the
        lowest y.
    classes, trust
        Of the same shape; see ``StairPoints``.
    resolution
        Side of a cell, m.
    origin
        (2,) x and y of the corner of cell (0, 0), m.
    """

    elevation: NDArray[np.float32]
    classes: NDArray[np.uint8]
    trust: NDArray[np.float32]
    resolution: float
    origin: Float64Array

    def to_npz(self) -> bytes:
        """Return a NumPy archive with these arrays."""
        buffer = io.BytesIO()
        np.savez_compressed(
            buffer,
            elevation=self.elevation,
            stair_class=self.classes,
            trust=self.trust,
            resolution=self.resolution,
            origin=self.origin,
        )
        return buffer.getvalue()


def height_layer(stairway: Stairway, *, cell: float = CELL) -> HeightLayer:
    """Return the heights of one stairway; where two of its flights lie one above the other, of the lower.

    Raises
    ------
    ValueError
        If there are too many cells.
    """
    corners = [flight.edges().reshape(-1, 3) for flight in stairway.flights]
    corners += [_landing_points(landing, max(landing.size)) for landing in stairway.landings]
    places = np.concatenate(corners)[:, :2]
    low = np.floor((places.min(axis=0) - cell) / cell) * cell
    columns, rows = np.ceil((places.max(axis=0) + cell - low) / cell).astype(int).tolist()
    if rows * columns > MAX_CELLS:
        raise ValueError(f"{rows} by {columns} cells are too many")
    x, y = (low[axis] + cell * (np.arange(num) + 0.5) for axis, num in ((0, columns), (1, rows)))
    centers = np.stack([*np.meshgrid(x, y)], axis=-1).reshape(-1, 2)
    elevation, classes, trust = np.full(len(centers), np.nan), np.zeros(len(centers)), np.zeros(len(centers))

    def take(inside: NDArray[np.bool_], height: Float64Array, kind: StairClass, trusts: Float64Array) -> None:
        lower = inside & ~(elevation <= height)
        elevation[lower], classes[lower], trust[lower] = height[lower], kind, trusts[lower]

    for flight in stairway.flights:
        at_base = np.column_stack([centers, np.full(len(centers), flight.base[2])])
        s, t, _ = transform_points(invert_transform(flight.map_from_flight), at_base).T
        step = np.floor(s / flight.run).astype(int).clip(0, flight.num_risers - 1)
        inside = (s >= 0) & (s < (flight.num_risers - 1) * flight.run) & (np.abs(t) <= flight.width / 2)
        trusts = np.array(_trusts(flight))[step]
        take(inside, flight.base[2] + (step + 1) * flight.rise, StairClass.TREAD, trusts)
    for landing in stairway.landings:
        offset = centers - landing.center[:2]
        along = np.array([np.cos(landing.heading), np.sin(landing.heading)])
        inside = np.abs(offset @ along) <= landing.size[0] / 2
        inside &= np.abs(offset @ [-along[1], along[0]]) <= landing.size[1] / 2
        take(
            inside, np.full(len(centers), landing.center[2]), StairClass.LANDING, np.full(len(centers), SEEN)
        )
    shape = (rows, columns)
    return HeightLayer(
        elevation=elevation.reshape(shape).astype(np.float32),
        classes=classes.reshape(shape).astype(np.uint8),
        trust=trust.reshape(shape).astype(np.float32),
        resolution=cell,
        origin=low,
    )
