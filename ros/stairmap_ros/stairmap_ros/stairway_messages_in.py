"""Messages of the map's node back into what they were made of: stairways, flights, keep-out masks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stairmap.arrays import Float64Array
from stairmap.navigation.occupancy import OccupancyGrid
from stairmap.stairway import Flight, FlightStd, Landing, Stairway, Step
from stairmap_ros.transforms_in import ns_from_time


def stairways_from_message(message: Any) -> tuple[Stairway, ...]:
    """Return the stairways of a ``stairmap_msgs/StairwayArray``."""
    return tuple(
        Stairway(
            id=stairway.id,
            flights=tuple(flight_from_message(flight) for flight in stairway.flights),
            landings=tuple(_landing(landing) for landing in stairway.landings),
            num_observations=stairway.num_observations,
            first_seen_ns=ns_from_time(stairway.first_seen),
            last_seen_ns=ns_from_time(stairway.last_seen),
        )
        for stairway in message.stairways
    )


def flight_from_message(message: Any) -> Flight:
    """Return the flight of a ``stairmap_msgs/Flight``."""
    measures = _deviations(message.covariance)
    place = _deviations(message.pose.covariance)
    return Flight(
        base=xyz(message.pose.pose.position),
        heading=yaw_of(message.pose.pose.orientation),
        rise=message.rise,
        run=message.run,
        width=message.width,
        num_risers=message.num_risers,
        left_bounded=message.left_bounded,
        right_bounded=message.right_bounded,
        overhang=message.overhang,
        bottom_seen=message.bottom_seen,
        top_seen=message.top_seen,
        std=FlightStd(
            rise=measures[0],
            run=measures[1],
            width=measures[2],
            pitch=measures[3],
            heading=place[5],
            base=place[:3],
            overhang=message.overhang_std,
        ),
        steps=tuple(
            Step(
                nosing=np.array([xyz(step.left), xyz(step.right)]),
                num_observations=step.num_observations,
                std=(step.std_along, step.std_up),
            )
            for step in message.steps
        ),
    )


def mask_from_message(message: Any) -> OccupancyGrid:
    """Return the cells of a ``nav_msgs/OccupancyGrid`` that is not turned."""
    info = message.info
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    origin = (float(info.origin.position.x), float(info.origin.position.y))
    return OccupancyGrid(cells=cells, resolution=float(info.resolution), origin=origin)


def xyz(point: Any) -> Float64Array:
    """Return a ``geometry_msgs/Point`` as a (3,) position, m."""
    return np.array([point.x, point.y, point.z])


def yaw_of(turn: Any) -> float:
    """Return the heading of a ``geometry_msgs/Quaternion``, rad."""
    return math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y * turn.y + turn.z * turn.z))


def _landing(message: Any) -> Landing:
    return Landing(
        center=xyz(message.pose.position),
        size=(message.length, message.width),
        heading=yaw_of(message.pose.orientation),
    )


def _deviations(covariance: Any) -> Float64Array:
    """Standard deviations of a covariance that comes row by row."""
    size = math.isqrt(len(covariance))
    variances = np.diag(np.reshape(np.asarray(covariance, dtype=np.float64), (size, size)))
    return np.asarray(np.sqrt(variances))
