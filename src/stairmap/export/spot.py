"""Stairways as messages of Boston Dynamics' Spot: ``bosdyn.api.StaircaseWithLandings``, one a flight.

Needs bosdyn-api (extra ``spot``), which no other module imports.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stairmap.errors import MissingPackageError
from stairmap.navigation.floors import FloorStack
from stairmap.output_files import check_new_file, write_whole
from stairmap.stairway import Flight, Landing, Stairway
from stairmap.transforms import invert_transform, quat_from_rotation, transform_points

_NAMESPACE = uuid.UUID("6f1d6f0c-5f0e-4d43-9d0e-9d3b6381a002")
"""Ids of staircases are made from their measures in it: the same stairs have the same one in every export."""

END_LENGTH = 1.0
"""Length of the free ground before a flight and behind it where no landing tells it, m: room for a Spot."""


def dump_spot(
    stairways: Sequence[Stairway], folder: Path, *, floors: FloorStack | None = None, frame_id: str = "map"
) -> tuple[Path, ...]:
    """Write a serialized ``StaircaseWithLandings`` for each flight: ``spot_stairway_<id>_flight_<n>.pb``.

    Spot climbs one straight flight at a time, from landing to landing. Its staircase frame is that of a
    flight here: bottom centre of the first riser, x up the stairs, y left, z up. At an end that nobody saw
    there is no landing in the message: the steps may go on.

    Parameters
    ----------
    stairways
        What there is.
    folder
        Where to write; it exists.
    floors
        They tell of unseen ends that lie at the height of a floor; ``None``: nothing does.
    frame_id
        Coordinate frame of all positions.

    Returns
    -------
    Paths of the files.

    Raises
    ------
    MissingPackageError
        If bosdyn-api is not installed.
    OutputError
        If a file is there already or cannot be written.
    """
    paths = []
    for stairway in stairways:
        for index, flight in enumerate(stairway.flights):
            path = folder / f"spot_stairway_{stairway.id}_flight_{index + 1}.pb"
            check_new_file(path, option="-f spot:")
            below = stairway.landings[index - 1] if 0 < index <= len(stairway.landings) else None
            above = stairway.landings[index] if index < len(stairway.landings) else None
            message = spot_from_flight(flight, (below, above), frame_id=frame_id)
            if below is None and flight.is_open_below and _may_go_on(stairway, floors, upper=False):
                message.ClearField("bottom_landing")
            if above is None and flight.is_open_above and _may_go_on(stairway, floors, upper=True):
                message.ClearField("top_landing")
            write_whole(path, message.SerializeToString(deterministic=True))
            paths.append(path)
    return tuple(paths)


def _may_go_on(stairway: Stairway, floors: FloorStack | None, *, upper: bool) -> bool:
    """Whether no floor that is known otherwise lies at an end of stairs that nobody saw."""
    return floors is None or floors.has_open_end(stairway.id, upper=upper)


def spot_from_flight(
    flight: Flight, landings: tuple[Landing | None, Landing | None], *, frame_id: str = "map"
) -> Any:
    """Return a flight and the landings below and above it as ``bosdyn.api.StaircaseWithLandings``.

    Raises
    ------
    MissingPackageError
        If bosdyn-api is not installed.
    """
    try:
        from bosdyn.api import geometry_pb2, stairs_pb2  # noqa: PLC0415
    except ImportError as error:
        raise MissingPackageError("bosdyn-api", "spot", "writing Spot's staircases") from error

    def pose(position: Any, rotation: Any) -> Any:
        x, y, z, w = quat_from_rotation(rotation)
        return geometry_pb2.SE3Pose(
            position=geometry_pb2.Vec3(x=position[0], y=position[1], z=position[2]),
            rotation=geometry_pb2.Quaternion(x=x, y=y, z=z, w=w),
        )

    def landing(place: tuple[Any, Any, float, float]) -> Any:
        position, rotation, length, width = place
        return stairs_pb2.StaircaseLanding(
            stairs_tform_landing_center=pose(position, rotation),
            landing_extent_x=length / 2,
            landing_extent_y=width / 2,
        )

    bounded = {(False, False): 1, (True, False): 2, (False, True): 3, (True, True): 4}
    width = stairs_pb2.Staircase.Width(
        width=flight.width, bounded_width=bounded[flight.left_bounded, flight.right_bounded]
    )
    local = transform_points(invert_transform(flight.map_from_flight), flight.edges()).mean(axis=1)
    steps = [
        stairs_pb2.Staircase.Step(
            point=geometry_pb2.Vec3(x=point[0], y=point[1], z=point[2]),
            north=geometry_pb2.Vec2(x=1.0, y=0.0),
            width=width,
        )
        for point in local
    ]
    identity = uuid.uuid5(_NAMESPACE, json.dumps(flight.to_dict()))
    staircase = stairs_pb2.Staircase(
        knowledge_type=stairs_pb2.Staircase.KNOWLEDGE_TYPE_MAPPED,
        stair_tform=stairs_pb2.StairTransform(
            frame_tform_stairs=pose(flight.base, flight.map_from_flight[:3, :3]), frame_name=frame_id
        ),
        number_of_steps=flight.num_risers,
        average_rise=flight.rise,
        average_run=flight.run,
        average_width=width,
        steps=steps,
        id=str(identity),
    )
    below, above = (_place_landing(flight, item, is_above=bool(index)) for index, item in enumerate(landings))
    return stairs_pb2.StaircaseWithLandings(
        bottom_landing=landing(below), staircase=staircase, top_landing=landing(above)
    )


def _place_landing(
    flight: Flight, landing: Landing | None, *, is_above: bool
) -> tuple[Any, Any, float, float]:
    """Centre, rotation, length and width of a landing in the flight's frame; assumed where none is known."""
    if landing is None:
        end = (flight.num_risers - 1) * flight.run
        along = end + END_LENGTH / 2 if is_above else -END_LENGTH / 2
        height = flight.num_risers * flight.rise if is_above else 0.0
        return np.array([along, 0.0, height]), np.eye(3), END_LENGTH, flight.width
    center = transform_points(invert_transform(flight.map_from_flight), landing.center)
    turn = landing.heading - flight.heading
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return center, rotation, landing.size[0], landing.size[1]
