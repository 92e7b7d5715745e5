"""What RViz shows: nosings, the box and a label with the measures of each flight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from stairmap.drop import Drop
from stairmap.stairway import Flight, Stairway
from stairmap_ros.messages import box_size, point_from, pose_at

FLIGHTS_PER_STAIRWAY = 100
"""Marker id = stairway id × this + number of the flight."""

# Blue and orange of Okabe and Ito: told apart by all eyes.
NOSING_COLOR = ColorRGBA(r=0.9, g=0.62, b=0.0, a=1.0)
BOX_COLOR = ColorRGBA(r=0.0, g=0.45, b=0.7, a=0.25)
DROP_COLOR = ColorRGBA(r=0.84, g=0.37, b=0.0, a=1.0)
LABEL_COLOR = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


def make_marker_array(stairways: Sequence[Stairway], drops: Sequence[Drop], header: Header) -> MarkerArray:
    """Return markers of all flights and drops, after one that deletes all that were shown before.

    So each array stands for itself: what has vanished goes, also where an array was lost on its way, and
    what a node showed that has been restarted since.
    """
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for stairway in stairways:
        for number, flight in enumerate(stairway.flights, start=1):
            marker_id = stairway.id * FLIGHTS_PER_STAIRWAY + number
            name = f"{stairway.id}" if len(stairway.flights) == 1 else f"{stairway.id}/{number}"
            markers += [
                _make_nosings(flight, header, marker_id),
                _make_box(flight, header, marker_id),
                _make_label(flight, header, marker_id, name),
            ]
    markers += [_make_drop(drop, header) for drop in drops]
    return MarkerArray(markers=markers)


def describe_flight(flight: Flight, name: str) -> str:
    """Return the label of a flight: its measures with one standard deviation, in mm and degrees."""
    std = flight.std
    lines = [
        f"stairway {name}: {flight.num_risers} risers",
        f"rise {_with_std(flight.rise, std.rise)} mm",
        f"run {_with_std(flight.run, std.run)} mm",
        f"width {'' if flight.left_bounded and flight.right_bounded else 'at least '}"
        f"{_with_std(flight.width, std.width)} mm",
        f"pitch {np.degrees(flight.pitch):.1f} deg",
    ]
    return "\n".join(lines)


def _with_std(value: float, std: float) -> str:
    return f"{value * 1e3:.0f} ± {np.ceil(std * 1e3):.0f}"


def _make_nosings(flight: Flight, header: Header, marker_id: int) -> Marker:
    marker = Marker(header=header, ns="nosings", id=marker_id, type=Marker.LINE_LIST, action=Marker.ADD)
    marker.pose.orientation.w = 1.0
    marker.scale.x = 0.02
    marker.color = NOSING_COLOR
    marker.points = [point_from(end) for nosing in flight.edges() for end in nosing]
    return marker


def _make_drop(drop: Drop, header: Header) -> Marker:
    marker = Marker(header=header, ns="drops", id=drop.id, type=Marker.LINE_LIST, action=Marker.ADD)
    marker.pose.orientation.w = 1.0
    marker.scale.x = 0.04
    marker.color = DROP_COLOR
    marker.points = [point_from(end) for end in drop.edge]
    return marker


def _make_box(flight: Flight, header: Header, marker_id: int) -> Marker:
    marker = Marker(header=header, ns="box", id=marker_id, type=Marker.CUBE, action=Marker.ADD)
    marker.pose = pose_at(flight.box.center, flight.heading)
    marker.scale = box_size(flight)
    marker.color = BOX_COLOR
    return marker


def _make_label(flight: Flight, header: Header, marker_id: int, name: str) -> Marker:
    marker = Marker(header=header, ns="label", id=marker_id, type=Marker.TEXT_VIEW_FACING, action=Marker.ADD)
    top = flight.box.center + np.array([0.0, 0.0, flight.box.height / 2 + 0.5])
    marker.pose = pose_at(top, 0.0)
    marker.scale.z = 0.12
    marker.color = LABEL_COLOR
    marker.text = describe_flight(flight, name)
    return marker
