"""Points along edges that a robot must not cross, for obstacle layers. No ROS in here.

Edges of the image at hand count from the first sighting, not only once the map has confirmed them. Stairs
that the robot can climb are no obstacle.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from stairmap.arrays import Points, Transform
from stairmap.detection.observation import Detection
from stairmap.modeling.landings import top_of
from stairmap.navigation.edge_pieces import drops_not_climbed, pieces_beside
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import transform_points
from stairmap_ros.stairway_map import MapAnswer

SPACING = 0.05
"""Distance of two points along an edge, m: a cell of a costmap."""

HEIGHTS = (0.05, 0.15, 0.25)
"""Heights of the points above the edge, m: above the noise that obstacle layers cut off, below every
bumper."""

BELOW_CAMERA, ABOVE_CAMERA = 2.5, 0.5
"""Edges between so much below and above the camera count, m: those of the floor that the robot is on."""

NEAR_STAIRS = 0.4
"""An edge of the image at hand within this of stairs that the robot can climb is theirs, m."""

MAX_ASLANT = 0.6
"""Sine of the largest angle, 37 degrees, between the nosings of stairs and an edge that is theirs."""


def obstacle_points(
    answer: MapAnswer, passable: Iterable[int], detection: Detection | None, map_from_camera: Transform | None
) -> Points:
    """Return (N, 3) points on the edges of drops and stairs, m, map.

    Parameters
    ----------
    answer
        What is confirmed.
    passable
        Ids of the stairways that the robot can climb.
    detection, map_from_camera
        What the newest image shows, and the (4, 4) pose it was taken from; ``None`` before the first.
    """
    if map_from_camera is None:
        return np.zeros((0, 3))
    ids = set(passable)
    climbed = [stairway for stairway in answer.stairways if stairway.id in ids]
    edges = [drop.edge for drop in drops_not_climbed(answer.drops, climbed)]
    for stairway in answer.stairways:
        if stairway.id not in ids:
            edges += _end_edges(stairway)
    if detection is not None:
        seen = [edge.edge for edge in detection.drops]
        seen += [edge.nosing for observation in detection.observations for edge in observation.edges]
        in_map = [transform_points(map_from_camera, np.asarray(edge)) for edge in seen]
        for edge in in_map:
            edges += _not_climbed(edge, climbed)
    points = [_fence(edge) for edge in edges]
    height = map_from_camera[2, 3]
    joined: Points = np.concatenate([np.zeros((0, 3)), *points])
    inside = (joined[:, 2] > height - BELOW_CAMERA) & (joined[:, 2] < height + ABOVE_CAMERA)
    return np.asarray(joined[inside])


def _end_edges(stairway: Stairway) -> list[Points]:
    """The foot of the first riser and the last nosing, (2, 3) segments."""
    first, last = stairway.flights[0], stairway.flights[-1]
    ends = []
    for flight, middle in ((first, first.base), (last, top_of(last))):
        left = np.array([-flight.forward[1], flight.forward[0], 0.0])
        ends.append(np.array([middle + left * flight.width / 2, middle - left * flight.width / 2]))
    return ends


def _not_climbed(edge: Points, climbed: Sequence[Stairway]) -> list[Points]:
    """What of an edge is no part of stairs that the robot climbs."""
    pieces = [edge]
    for stairway in climbed:
        for flight in stairway.flights:
            if _is_across(edge, flight):
                pieces = [part for piece in pieces for part in pieces_beside(piece, flight)]
    return pieces


def _is_across(edge: Points, flight: Flight) -> bool:
    """Whether an edge lies across a flight, on it or right before one of its ends.

    An edge along stairs is the side of their well, which nobody may step over.
    """
    along = edge[1] - edge[0]
    if abs(float(along @ flight.forward)) > MAX_ASLANT * max(float(np.linalg.norm(along)), 1e-9):
        return False
    offset = edge.mean(axis=0) - flight.box.center
    ahead, above = float(offset @ flight.forward), float(offset[2])
    return (
        abs(ahead) < flight.box.depth / 2 + NEAR_STAIRS and abs(above) < flight.box.height / 2 + NEAR_STAIRS
    )


def _fence(edge: Points) -> Points:
    """(N, 3) points along an edge, and above it."""
    first, last = np.asarray(edge)
    number = max(2, int(np.ceil(np.linalg.norm(last - first) / SPACING)) + 1)
    line = first + np.linspace(0.0, 1.0, number)[:, None] * (last - first)
    return np.concatenate([line + np.array([0.0, 0.0, height]) for height in HEIGHTS])
