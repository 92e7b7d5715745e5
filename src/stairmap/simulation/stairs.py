"""Stairways of chosen dimensions as meshes, each with its truth.

Truth of an irregular flight: ``rise`` and ``run`` are the mean over treads, that is
from the first tread to the upper floor; a single odd riser at the bottom does not
count. ``base`` lies on the lower floor, vertically below the first nosing, because a
flight's model has no overhang. ``steps`` hold every nosing where it really is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stairmap.arrays import Points
from stairmap.simulation.stair_shapes import FlightShape, StairwayShape
from stairmap.simulation.stair_solids import make_flight_mesh
from stairmap.simulation.triangle_mesh import TriangleMesh, joined, make_block
from stairmap.stairway import Flight, FlightStd, Landing, Stairway, Step
from stairmap.transforms import transform_points


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltStairway:
    """A stairway as mesh and truth."""

    mesh: TriangleMesh
    stairway: Stairway

    @property
    def top_z(self) -> float:
        """Height of the upper floor, m."""
        return float(self.stairway.flights[-1].steps[-1].nosing[0, 2])


def true_std() -> FlightStd:
    """Return the standard deviations of a truth: zeros."""
    return FlightStd(rise=0, run=0, width=0, pitch=0, heading=0, base=np.zeros(3), overhang=0)


def build_flight(
    shape: FlightShape, *, base: ArrayLike, heading: float, random: np.random.Generator
) -> tuple[TriangleMesh, Flight]:
    """Return the mesh of a flight and its truth.

    Parameters
    ----------
    shape
        Its dimensions.
    base
        (3,) point on the lower floor below the middle of the first nosing, m.
    heading
        Direction of ascent, rad.
    random
        Draws the irregularities; not used when there are none.
    """
    num = shape.num_risers
    rises, runs = np.full(num, shape.rise), np.full(num - 1, shape.run)
    if shape.irregularity > 0:
        rises = rises + random.normal(0, shape.irregularity, num)
        runs = runs + random.normal(0, shape.irregularity, num - 1)
    nosing_x = np.concatenate([[0.0], np.cumsum(runs)])
    nosing_z = np.cumsum(rises)
    frame = Flight(
        base=np.asarray(base, np.float64), heading=heading, rise=shape.rise, run=shape.run, width=shape.width,
        num_risers=num, std=true_std(),
    )  # fmt: skip
    nosings = np.zeros((num, 2, 3))
    nosings[..., 0], nosings[..., 2] = nosing_x[:, None], nosing_z[:, None]
    nosings[..., 1] = np.array([0.5, -0.5]) * shape.width
    truth = Flight(
        base=frame.base,
        heading=heading,
        rise=float(np.diff(nosing_z).mean()) if num > 1 else float(rises[0]),
        run=float(runs.mean()) if num > 1 else shape.run,
        width=shape.width,
        num_risers=num,
        overhang=shape.overhang,
        bottom_seen=True,
        top_seen=True,
        std=true_std(),
        steps=tuple(
            Step(nosing=nosing, num_observations=0, std=(0.0, 0.0))
            for nosing in transform_points(frame.map_from_flight, nosings)
        ),
    )
    return make_flight_mesh(shape, nosings).transformed(frame.map_from_flight), truth


def build_stairway(
    shape: StairwayShape, *, base: ArrayLike, heading: float, stairway_id: int, random: np.random.Generator
) -> BuiltStairway:
    """Return the mesh of a stairway with its landings, and its truth.

    Parameters
    ----------
    shape
        Its flights and turns.
    base
        (3,) base of the first flight, m.
    heading
        Direction in which the first flight ascends, rad.
    stairway_id
        Id of the truth, from 1.
    random
        Draws the irregularities.
    """
    meshes, flights, landings = [], [], []
    place, direction = np.asarray(base, dtype=np.float64), heading
    for index, flight_shape in enumerate(shape.flights):
        mesh, flight = build_flight(flight_shape, base=place, heading=direction, random=random)
        meshes.append(mesh)
        flights.append(flight)
        if index + 1 == len(shape.flights):
            break
        following = shape.flights[index + 1]
        turn = shape.turns[index]
        landing, place, direction = _place_landing(flight, flight_shape, following, turn, shape)
        landings.append(landing)
        meshes.append(_landing_mesh(landing))
    stairway = Stairway(
        id=stairway_id, flights=tuple(flights), landings=tuple(landings),
        num_observations=0, first_seen_ns=0, last_seen_ns=0,
    )  # fmt: skip
    return BuiltStairway(mesh=joined(meshes), stairway=stairway)


def _place_landing(
    flight: Flight, shape: FlightShape, following: FlightShape, turn: int, stairway: StairwayShape
) -> tuple[Landing, Points, float]:
    """Return the landing after a flight, and base and heading of the next flight."""
    start_x = flight.steps[-1].nosing.mean(axis=0)
    start = (start_x - flight.base) @ flight.map_from_flight[:3, :3]
    length, half = stairway.landing_length, shape.width / 2
    sign = 1.0 if turn > 0 else -1.0
    y_min, y_max = -half, half
    if abs(turn) == 90:
        length = max(length, following.width)
        base = np.array([length - following.width / 2, sign * half, 0.0])
    elif abs(turn) == 180:
        offset = half + stairway.well + following.width / 2
        base = np.array([0.0, sign * offset, 0.0])
        if sign > 0:
            y_max = half + stairway.well + following.width
        else:
            y_min = -(half + stairway.well + following.width)
    else:
        base = np.array([length, 0.0, 0.0])
    local = np.array([start[0], 0.0, start[2]])
    center = transform_points(
        flight.map_from_flight, local + np.array([length / 2, (y_min + y_max) / 2, 0.0])
    )
    landing = Landing(center=center, size=(length, y_max - y_min), heading=flight.heading)
    return landing, transform_points(flight.map_from_flight, local + base), flight.heading + np.radians(turn)


def _landing_mesh(landing: Landing) -> TriangleMesh:
    cos, sin = np.cos(landing.heading), np.sin(landing.heading)
    turn = np.eye(4)
    turn[:2, :2] = [[cos, -sin], [sin, cos]]
    turn[:3, 3] = landing.center
    half_length, half_width = landing.size[0] / 2, landing.size[1] / 2
    # 1 mm shorter, so that its front face does not lie in the plane of the last riser.
    return make_block([-half_length + 0.001, -half_width, -0.15], [half_length, half_width, 0.0]).transformed(
        turn
    )
