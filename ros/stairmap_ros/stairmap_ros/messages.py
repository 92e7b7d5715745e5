"""Stairways as messages: ``stairmap_msgs/StairwayArray`` and ``vision_msgs/Detection3DArray``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from stairmap_msgs import msg as stairmap_msgs
from std_msgs.msg import Header

from stairmap.arrays import Float64Array, Vector
from stairmap.stairway import Flight, Landing, Stairway, Step
from stairmap_ros.covariances import measures_covariance, pose_covariance


def make_header(map_frame: str, stamp_ns: int) -> Header:
    """Return the header of a message about a map at a stamp."""
    return Header(frame_id=map_frame, stamp=time_from_ns(stamp_ns))


def time_from_ns(stamp_ns: int) -> Time:
    """Return a stamp as a message."""
    return Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)


def make_stairway_array(stairways: Sequence[Stairway], header: Header) -> stairmap_msgs.StairwayArray:
    """Return all stairways as one message."""
    return stairmap_msgs.StairwayArray(
        header=header, stairways=[_make_stairway(stairway) for stairway in stairways]
    )


def make_detection_array(stairways: Sequence[Stairway], header: Header) -> Any:
    """Return the flights, named ``id/flight``, as ``Detection3DArray``; ``None`` without vision_msgs."""
    try:
        from vision_msgs import msg as vision_msgs  # noqa: PLC0415
    except ImportError:
        return None
    detections = []
    for stairway in stairways:
        for number, flight in enumerate(stairway.flights, start=1):
            result = vision_msgs.ObjectHypothesisWithPose()
            result.hypothesis.class_id = "stairway"
            result.hypothesis.score = 1.0
            result.pose.pose = pose_at(flight.box.center, flight.heading)
            result.pose.covariance = pose_covariance(flight).ravel()
            detection = vision_msgs.Detection3D(header=header, id=f"{stairway.id}/{number}", results=[result])
            detection.bbox.center = result.pose.pose
            detection.bbox.size = box_size(flight)
            detections.append(detection)
    return vision_msgs.Detection3DArray(header=header, detections=detections)


def pose_at(position: Vector, heading: float) -> Pose:
    """Return a level pose at a (3,) position in metres, turned to a heading in radians."""
    turn = Quaternion(z=float(np.sin(heading / 2)), w=float(np.cos(heading / 2)))
    return Pose(position=point_from(position), orientation=turn)


def point_from(position: Float64Array) -> Point:
    """Return a (3,) position in metres as a message."""
    x, y, z = (float(value) for value in position)
    return Point(x=x, y=y, z=z)


def box_size(flight: Flight) -> Vector3:
    """Return the size of a flight's box, x along its heading, m."""
    box = flight.box
    return Vector3(x=float(box.depth), y=float(box.width), z=float(box.height))


def _make_stairway(stairway: Stairway) -> stairmap_msgs.Stairway:
    return stairmap_msgs.Stairway(
        id=stairway.id,
        flights=[make_flight(flight) for flight in stairway.flights],
        landings=[_make_landing(landing) for landing in stairway.landings],
        num_observations=stairway.num_observations,
        first_seen=time_from_ns(stairway.first_seen_ns),
        last_seen=time_from_ns(stairway.last_seen_ns),
    )


def make_flight(flight: Flight) -> stairmap_msgs.Flight:
    """Return a flight as a message."""
    message = stairmap_msgs.Flight(
        rise=float(flight.rise),
        run=float(flight.run),
        width=float(flight.width),
        pitch=flight.pitch,
        covariance=measures_covariance(flight).ravel(),
        num_risers=flight.num_risers,
        left_bounded=flight.left_bounded,
        right_bounded=flight.right_bounded,
        overhang=float(flight.overhang),
        overhang_std=float(flight.std.overhang),
        bottom_seen=bool(flight.bottom_seen),
        top_seen=bool(flight.top_seen),
        plane=flight.plane,
        box_center=point_from(flight.box.center),
        box_size=box_size(flight),
        steps=[_make_step(step) for step in flight.steps],
    )
    message.pose.pose = pose_at(flight.base, flight.heading)
    message.pose.covariance = pose_covariance(flight).ravel()
    return message


def _make_step(step: Step) -> stairmap_msgs.Step:
    left, right = step.nosing
    return stairmap_msgs.Step(
        left=point_from(left),
        right=point_from(right),
        num_observations=step.num_observations,
        std_along=step.std[0],
        std_up=step.std[1],
    )


def _make_landing(landing: Landing) -> stairmap_msgs.Landing:
    length, width = landing.size
    return stairmap_msgs.Landing(pose=pose_at(landing.center, landing.heading), length=length, width=width)
