"""All observations so far as flat arrays, in the camera frame with their stamps.

Each observation is kept in its own stair axes (forward, left, up from its origin), so a changed
trajectory moves one point and one angle per observation and leaves its edges as they are.
"""

from __future__ import annotations

import numpy as np

from stairmap.arrays import Float64Array, IntArray
from stairmap.detection.observation import StairObservation
from stairmap.geometry import cross

OBSERVATION_FIELDS = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("origin", np.float64, 3),
        ("forward", np.float64, 3),
        ("rise", np.float64),
        ("run", np.float64),
        ("width", np.float64),
        ("rise_variance", np.float64),
        ("run_variance", np.float64),
        ("forward_variance", np.float64),
        ("up_variance", np.float64),
        ("heading_variance", np.float64),
        ("rise_information", np.float64, (2, 3)),
        ("num_steps", np.int64),
        ("left", np.float64),
        ("right", np.float64),
        ("floor_seen", np.bool_),
        ("top_seen", np.bool_),
    ]
)

EDGE_FIELDS = np.dtype(
    [
        ("observation", np.int64),
        ("index", np.int64),
        ("forward", np.float32),
        ("up", np.float32),
        ("left", np.float32),
        ("right", np.float32),
        ("left_bounded", np.bool_),
        ("right_bounded", np.bool_),
    ]
)

DEFAULT_VARIANCES = (0.02**2, 0.02**2, 0.03**2, 0.03**2, np.radians(3.0) ** 2)
"""Variances of (rise, run, forward, up, heading) for a detector that gives no covariance."""


class ObservationTable:
    """Observations in arrays that grow by doubling: adding one costs the same at any length."""

    def __init__(self) -> None:
        self._observations = np.zeros(64, dtype=OBSERVATION_FIELDS)
        self._edges = np.zeros(512, dtype=EDGE_FIELDS)
        self._num_observations = 0
        self._num_edges = 0

    @classmethod
    def from_records(
        cls,
        observations: np.ndarray[tuple[int], np.dtype[np.void]],
        edges: np.ndarray[tuple[int], np.dtype[np.void]],
    ) -> ObservationTable:
        """Rebuild a table from its ``observations`` and ``edges``.

        Raises
        ------
        ValueError
            If the records have other fields, or an edge belongs to no observation.
        """
        for name, records, fields in (
            ("observations", observations, OBSERVATION_FIELDS),
            ("edges", edges, EDGE_FIELDS),
        ):
            if records.dtype != fields:
                raise ValueError(f"the {name} have the fields {records.dtype.names}, expected {fields.names}")
        owners = edges["observation"]
        if len(owners) and not 0 <= owners.min() <= owners.max() < len(observations):
            raise ValueError(f"an edge belongs to none of the {len(observations)} observations")
        table = cls()
        table._observations, table._num_observations = observations.copy(), len(observations)
        table._edges, table._num_edges = edges.copy(), len(edges)
        return table

    def __len__(self) -> int:
        return self._num_observations

    @property
    def observations(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(N,) records of ``OBSERVATION_FIELDS``, camera frame, m, rad."""
        return self._observations[: self._num_observations]

    @property
    def edges(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(E,) records of ``EDGE_FIELDS``: where each edge lies from its observation's origin, m."""
        return self._edges[: self._num_edges]

    def add(self, observation: StairObservation) -> None:
        """Append one observation."""
        left_axis = cross(observation.up, observation.forward)
        ends = np.array([edge.nosing for edge in observation.edges]) - observation.origin
        left, right = ends[:, 0] @ left_axis, ends[:, 1] @ left_axis
        middle = ends.mean(axis=1)
        variances = DEFAULT_VARIANCES
        if observation.covariance.size:
            variances = tuple(np.diag(observation.covariance)[[0, 1, 2, 3, 5]])
        information = observation.rise_information
        if information.size == 0:
            information = np.array([[1.0, 0.0, observation.rise], [0.0, 0.0, 0.0]]) / variances[0]
        self._observations = _with_room(self._observations, self._num_observations + 1)
        self._observations[self._num_observations] = (
            observation.stamp_ns,
            observation.origin,
            observation.forward,
            observation.rise,
            observation.run,
            observation.width,
            *variances,
            information,
            observation.num_steps,
            left.max(),
            right.min(),
            observation.floor_seen,
            observation.top_seen,
        )
        count = len(ends)
        self._edges = _with_room(self._edges, self._num_edges + count)
        rows = self._edges[self._num_edges : self._num_edges + count]
        rows["observation"] = self._num_observations
        rows["index"] = [edge.step_index for edge in observation.edges]
        rows["forward"], rows["up"] = middle @ observation.forward, middle @ observation.up
        rows["left"], rows["right"] = left, right
        rows["left_bounded"] = [edge.left_bounded for edge in observation.edges]
        rows["right_bounded"] = [edge.right_bounded for edge in observation.edges]
        self._num_observations += 1
        self._num_edges += count


def _with_room(
    records: np.ndarray[tuple[int], np.dtype[np.void]], wanted: int
) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """The records, in an array twice as long where ``wanted`` do not fit."""
    if wanted <= len(records):
        return records
    larger = np.zeros(max(2 * len(records), wanted), dtype=records.dtype)
    larger[: len(records)] = records
    return larger


class PlacedObservations:
    """Observations where a trajectory puts them; arrays (N,) or (N, 3), map, m, rad.

    Attributes
    ----------
    origin
        (N, 3) lattice origins.
    heading
        (N,) directions of ascent.
    """

    def __init__(self, table: ObservationTable, poses: Float64Array) -> None:
        records = table.observations
        self.records = records
        self.origin = np.einsum("nij,nj->ni", poses[:, :3, :3], records["origin"]) + poses[:, :3, 3]
        forward = np.einsum("nij,nj->ni", poses[:, :3, :3], records["forward"])
        self.heading = np.arctan2(forward[:, 1], forward[:, 0])

    def __len__(self) -> int:
        return len(self.heading)

    def in_axes(self, heading: float, chosen: IntArray | None = None) -> Float64Array:
        """Return (M, 3) origins along a heading, to its left and up, m."""
        origin = self.origin if chosen is None else self.origin[chosen]
        cosine, sine = np.cos(heading), np.sin(heading)
        return np.stack(
            [
                origin[:, 0] * cosine + origin[:, 1] * sine,
                origin[:, 1] * cosine - origin[:, 0] * sine,
                origin[:, 2],
            ],
            axis=1,
        )
