"""A simulated place: its surfaces, its true stairways, and where a robot may drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stairmap.arrays import Points, readonly
from stairmap.simulation.triangle_mesh import TriangleMesh
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import transform_points


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """Where a robot drives: straight lines between points on the floor, with turns on the spot.

    Attributes
    ----------
    waypoints
        (N, 3) points on the floor, N at least 2, m.
    first_heading
        Where it looks before it turns to the second waypoint, rad; ``None``: at that point.
    last_heading
        Where it turns at the end, rad; ``None``: it does not.
    last_pause
        How long it stands at the end, s.
    min_camera_pitch
        How far the camera looks down at least, rad: a robot that wants to see stairs that lead
        down tilts its camera or body. Zero leaves every robot's own tilt as it is.
    """

    waypoints: Points
    first_heading: float | None = None
    last_heading: float | None = None
    last_pause: float = 0.0
    min_camera_pitch: float = 0.0

    def __post_init__(self) -> None:
        waypoints = readonly(self.waypoints).reshape(-1, 3)
        if len(waypoints) < 2:
            raise ValueError(f"a route needs at least two waypoints, got {len(waypoints)}")
        object.__setattr__(self, "waypoints", waypoints)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A place to simulate.

    Attributes
    ----------
    name
        What ``stairmap simulate`` calls it.
    mesh
        All surfaces, map coordinates, z up.
    stairways
        The true stairways, ids from 1.
    optional_stairways
        Stairways that are there but need not be found, such as the four straight steps of a
        winding stair: no method is blamed for reporting or for missing them.
    route
        Where a robot should drive to see them.
    """

    name: str
    mesh: TriangleMesh
    stairways: tuple[Stairway, ...] = ()
    optional_stairways: tuple[Stairway, ...] = ()
    route: Route


def make_approach_route(
    flight: Flight,
    *,
    distance: float = 4.5,
    stop: float = 0.6,
    lateral: float = 0.7,
    first_turn: float = 0.0,
) -> Route:
    """Return a route on the lower floor that leads to a flight's first riser.

    Parameters
    ----------
    flight
        Where to go.
    distance, stop
        Distance from the first riser at the start and at the end, m.
    lateral
        How far to the left of the flight's middle line the route starts, m.
    first_turn
        Angle by which the robot first looks away, to the left, rad.
    """
    middle = stop + (distance - stop) * 0.45
    local = np.array([[-distance, lateral, 0.0], [-middle, 0.25 * lateral, 0.0], [-stop, 0.0, 0.0]])
    waypoints = transform_points(flight.map_from_flight, local)
    leg = waypoints[1] - waypoints[0]
    heading = float(np.arctan2(leg[1], leg[0]))
    return Route(waypoints=waypoints, first_heading=heading + first_turn, last_heading=flight.heading)


def make_descent_route(flight: Flight, *, distance: float = 3.0, stop: float = 0.25) -> Route:
    """Return a route on the upper floor to the top nosing of a flight, to halt there and look down it.

    Parameters
    ----------
    flight
        Where to go; its ``steps`` tell where the top nosing is.
    distance, stop
        Distance from the top nosing at the start and at the end, m.
    """
    top = flight.steps[-1].nosing.mean(axis=0)
    left = flight.map_from_flight[:3, 1]
    waypoints = [
        top + flight.forward * distance + 0.5 * left,
        top + flight.forward * (stop + 1.0),
        top + flight.forward * stop,
    ]
    return Route(
        waypoints=np.array(waypoints),
        last_heading=flight.heading + np.pi,
        last_pause=2.0,
        min_camera_pitch=float(np.radians(35)),
    )
