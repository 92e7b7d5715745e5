"""Stairways, stair edges and the camera's way as scene entities of Foxglove.

It is handed the module ``foxglove.messages`` and imports nothing of Foxglove itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from stairmap.arrays import Points, Vector
from stairmap.stairway import Flight, Stairway
from stairmap.transforms import quat_from_rotation
from stairmap.visualization.stairway_labels import (
    ASCENT_COLOR,
    EDGE_COLOR,
    SURFACE_COLOR,
    TRAJECTORY_COLOR,
    Color,
    ascent_arrow,
    flight_measures,
    flight_title,
    stairway_color,
)


class FoxgloveScene:
    """Makes ``SceneUpdate`` messages.

    Parameters
    ----------
    messages
        The module ``foxglove.messages``.
    frame_id
        Name of the map's coordinate frame.
    """

    def __init__(self, messages: Any, frame_id: str) -> None:
        self._messages = messages
        self._frame_id = frame_id

    def stairways_update(self, stairways: Sequence[Stairway], stamp: Any) -> Any:
        """Return an update that replaces all stairways: surfaces, nosings, boxes, arrows, labels."""
        messages = self._messages
        delete_all = messages.SceneEntityDeletion(timestamp=stamp, type=messages.SceneEntityDeletionType.All)
        return messages.SceneUpdate(
            deletions=[delete_all],
            entities=[self._stairway_entity(stairway, stamp) for stairway in stairways],
        )

    def edges_update(self, edges: Points, stamp: Any) -> Any:
        """Return an update with the (N, 2, 3) stair edges of one frame, map, m; none clears the last ones."""
        lines = [self._lines(edges, EDGE_COLOR, thickness=0.012)] if len(edges) else []
        return self._messages.SceneUpdate(entities=[self._entity("stair_edges", stamp, lines=lines)])

    def way_update(self, positions: Points, stamp: Any) -> Any:
        """Return an update with the (N, 3) way of the camera, map, m."""
        segments = np.stack([positions[:-1], positions[1:]], axis=1)
        lines = [self._lines(segments, TRAJECTORY_COLOR, thickness=0.015)]
        return self._messages.SceneUpdate(entities=[self._entity("trajectory", stamp, lines=lines)])

    def _stairway_entity(self, stairway: Stairway, stamp: Any) -> Any:
        messages, color = self._messages, stairway_color(stairway.id)
        vertices, triangles = stairway.surface()
        surface = messages.TriangleListPrimitive(
            pose=self._pose(np.zeros(3), np.eye(3)),
            points=[self._point(vertex) for vertex in vertices],
            indices=triangles.ravel().tolist(),
            color=self._color(SURFACE_COLOR),
        )
        measures = [
            messages.KeyValuePair(key=f"flight {index + 1}", value=", ".join(flight_measures(flight)))
            for index, flight in enumerate(stairway.flights)
        ]
        return self._entity(
            f"stairway_{stairway.id}",
            stamp,
            metadata=[
                messages.KeyValuePair(key="observations", value=str(stairway.num_observations)),
                *measures,
            ],
            triangles=[surface],
            lines=[self._lines(stairway.edges(), color, thickness=0.02)],
            cubes=[self._box(flight, color) for flight in stairway.flights],
            arrows=[self._arrow(flight) for flight in stairway.flights],
            texts=[self._label(stairway, index) for index in range(len(stairway.flights))],
        )

    def _entity(self, name: str, stamp: Any, **primitives: Any) -> Any:
        return self._messages.SceneEntity(timestamp=stamp, frame_id=self._frame_id, id=name, **primitives)

    def _lines(self, segments: Points, color: Color, *, thickness: float) -> Any:
        return self._messages.LinePrimitive(
            type=self._messages.LinePrimitiveLineType.LineList,
            pose=self._pose(np.zeros(3), np.eye(3)),
            thickness=thickness,
            points=[self._point(point) for point in np.reshape(segments, (-1, 3))],
            color=self._color(color),
        )

    def _box(self, flight: Flight, color: Color) -> Any:
        box = flight.box
        return self._messages.CubePrimitive(
            pose=self._pose(box.center, flight.map_from_flight[:3, :3]),
            size=self._messages.Vector3(x=box.depth, y=box.width, z=box.height),
            color=self._color(color, alpha=0.12),
        )

    def _arrow(self, flight: Flight) -> Any:
        start, end = ascent_arrow(flight)
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        left = flight.map_from_flight[:3, 1]
        rotation = np.stack([along, left, np.cross(along, left)], axis=1)
        return self._messages.ArrowPrimitive(
            pose=self._pose(start, rotation),
            shaft_length=max(length - 0.2, 0.1),
            shaft_diameter=0.04,
            head_length=0.2,
            head_diameter=0.12,
            color=self._color(ASCENT_COLOR),
        )

    def _label(self, stairway: Stairway, index: int) -> Any:
        flight = stairway.flights[index]
        return self._messages.TextPrimitive(
            pose=self._pose(ascent_arrow(flight)[1] + np.array([0.0, 0.0, 0.4]), np.eye(3)),
            billboard=True,
            font_size=16.0,
            scale_invariant=True,
            color=self._color((255, 255, 255)),
            text="\n".join([flight_title(stairway, index), *flight_measures(flight)]),
        )

    def _pose(self, position: Vector, rotation: Points) -> Any:
        x, y, z, w = quat_from_rotation(rotation)
        return self._messages.Pose(
            position=self._messages.Vector3(x=position[0], y=position[1], z=position[2]),
            orientation=self._messages.Quaternion(x=x, y=y, z=z, w=w),
        )

    def _point(self, point: Vector) -> Any:
        return self._messages.Point3(x=point[0], y=point[1], z=point[2])

    def _color(self, color: Color, *, alpha: float = 1.0) -> Any:
        red, green, blue = (value / 255 for value in color)
        return self._messages.Color(r=red, g=green, b=blue, a=alpha)
