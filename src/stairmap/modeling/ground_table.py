"""All views of the ground so far, and the edges seen in them, in the camera frame with their stamps."""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, Mask, Points, Transform
from stairmap.detection.drops import DropEdge
from stairmap.detection.ground import NUM_RANGE_BINS, RANGE_BIN, GroundView
from stairmap.modeling.observation_table import with_room
from stairmap.modeling.saved_records import check_records

NUM_BEARINGS = 48
"""What was seen is kept along this many bearings: 1.2 degrees apart in an ordinary camera's view."""

VIEW_FIELDS = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("height", np.float64),
        ("up", np.float64, 3),
        ("forward", np.float64, 3),
        ("bearings", np.float64, 2),
        ("seen", np.uint32, NUM_BEARINGS),
    ]
)
"""A view: height of the camera above the ground, m; axes, camera frame; first and last bearing, descending;
along each bearing, a bit for each eighth of a metre in which the ground was seen."""

EDGE_FIELDS = np.dtype(
    [("stamp_ns", np.int64), ("edge", np.float64, (2, 3)), ("depth", np.float64), ("distance", np.float64)]
)
"""An edge: its ends, camera frame, m; its depth, NaN at a void, and its distance from the camera, m."""

HEIGHT_WINDOW = 0.06
"""Heights of the camera within this much of each other are one, m: gait and noise make less."""

MIN_HEIGHT_SHARE = 0.5
"""Least share of the views that must agree on the camera's height: over a table it is carried by hand."""

MIN_HEIGHT_VIEWS = 3
"""Fewest views that tell the camera's height."""

MAX_OFF_PLANE = 0.15
"""A place is on the ground of a view within this of its plane, m."""

_BITS = (np.uint32(1) << np.arange(NUM_RANGE_BINS, dtype=np.uint32)).astype(np.uint32)


class GroundTable:
    """Views and edges in arrays that grow by doubling."""

    def __init__(self) -> None:
        self._views = np.zeros(64, dtype=VIEW_FIELDS)
        self._edges = np.zeros(64, dtype=EDGE_FIELDS)
        self._num_views = self._num_edges = 0

    @classmethod
    def from_records(
        cls,
        views: np.ndarray[tuple[int], np.dtype[np.void]],
        edges: np.ndarray[tuple[int], np.dtype[np.void]],
    ) -> GroundTable:
        """Rebuild a table from its ``views`` and ``edges``.

        Raises
        ------
        ValueError
            If the records have other fields or hold numbers that are none, or an edge is of no view.
        """
        check_records("ground's views", views, VIEW_FIELDS)
        check_records("ground's edges", edges, EDGE_FIELDS, may_be_unknown=("depth",))
        if not np.isin(edges["stamp_ns"], views["stamp_ns"]).all():
            raise ValueError("an edge of the ground is of a frame without a view")
        table = cls()
        table._views, table._num_views = views.copy(), len(views)
        table._edges, table._num_edges = edges.copy(), len(edges)
        return table

    @property
    def views(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(N,) records of ``VIEW_FIELDS``."""
        return self._views[: self._num_views]

    @property
    def edges(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(M,) records of ``EDGE_FIELDS``, in the order of their frames."""
        return self._edges[: self._num_edges]

    def add(self, stamp_ns: int, view: GroundView, edges: tuple[DropEdge, ...]) -> None:
        """Take in what one frame saw of the ground."""
        self._views = with_room(self._views, self._num_views + 1)
        column = np.round(np.linspace(0, len(view.bearing) - 1, NUM_BEARINGS)).astype(np.int64)
        seen = np.where(view.is_seen[column], _BITS, np.uint32(0)).sum(axis=1, dtype=np.uint32)
        bearings = (view.bearing[0], view.bearing[-1])
        self._views[self._num_views] = (stamp_ns, view.height, view.up, view.forward, bearings, seen)
        self._num_views += 1
        for edge in edges:
            self._edges = with_room(self._edges, self._num_edges + 1)
            self._edges[self._num_edges] = (stamp_ns, edge.edge, edge.depth, edge.distance)
            self._num_edges += 1

    def camera_height(self) -> float | None:
        """Return the height of the camera above the ground that it moves on, m.

        The ground of one frame may be another one, such as the floor below an edge. Over the frames, the
        height at which most agree counts; ``None`` where fewer than half of them do.
        """
        heights = np.sort(self.views["height"])
        if len(heights) < MIN_HEIGHT_VIEWS:
            return None
        counts = np.searchsorted(heights, heights + HEIGHT_WINDOW, side="right") - np.arange(len(heights))
        best = int(np.argmax(counts))
        if counts[best] < MIN_HEIGHT_SHARE * len(heights):
            return None
        return float(np.median(heights[best : best + counts[best]]))


def sees_ground(view: np.void, map_from_camera: Transform, places: Points) -> Mask:
    """Tell at which (N, 3) places of the map a view saw its ground, m."""
    ahead, left, above = _in_view(view, map_from_camera, places)
    first, last = view["bearings"]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.rint((left / ahead - first) / (last - first) * (NUM_BEARINGS - 1))
        inside = (ahead > 0) & (column >= 0) & (column < NUM_BEARINGS)
    inside &= (ahead < NUM_RANGE_BINS * RANGE_BIN) & (np.abs(above) < MAX_OFF_PLANE)
    index = np.where(inside, column, 0).astype(np.int64)
    range_bin = np.where(inside, ahead / RANGE_BIN, 0).astype(np.int64)
    return np.asarray(inside & ((view["seen"][index] & _BITS[range_bin]) > 0))


def _in_view(
    view: np.void, map_from_camera: Transform, places: Points
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Forward and leftward distance and height above the ground of (N, 3) places, m."""
    offset = (places - map_from_camera[:3, 3]) @ map_from_camera[:3, :3]
    up, forward = view["up"], view["forward"]
    left = np.cross(up, forward)
    return offset @ forward, offset @ left, offset @ up + view["height"]
