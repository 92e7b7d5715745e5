"""All observations so far as flat arrays, in the camera frame with their stamps.

Each observation is kept in its own stair axes (forward, left, up from its origin), so a changed
trajectory moves one point and one angle per observation and leaves its edges as they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stairmap.arrays import Float64Array, IntArray, Mask
from stairmap.detection.observation import StairObservation
from stairmap.geometry import cross
from stairmap.modeling.saved_records import check_each, check_records

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
        ("overhang", np.float64),
        ("overhang_std", np.float64),
        ("from_below", np.bool_),
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
        ("forward_std", np.float32),
        ("up_std", np.float32),
    ]
)

_LATER_FIELDS = ("overhang", "overhang_std", "forward_std", "up_std", "from_below")
"""Fields that records of earlier versions lack; NaN, unknown, where they are read, or worked out."""

MAX_STEP_INDEX = 1_000
"""Largest index of a step in a saved record: no flight has half as many."""

DEFAULT_VARIANCES = (0.02**2, 0.02**2, 0.03**2, 0.03**2, np.radians(3.0) ** 2)
"""Variances of (rise, run, forward, up, heading) for a detector that gives no covariance."""


class ObservationTable:
    """Observations in arrays that grow by doubling: adding one costs the same at any length."""

    def __init__(self) -> None:
        self._observations = np.zeros(64, dtype=OBSERVATION_FIELDS)
        self._edges = np.zeros(512, dtype=EDGE_FIELDS)
        self._edge_ends: IntArray = np.zeros(64, dtype=np.int64)
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
            If the records have other fields or hold numbers that are none, or an edge belongs to no
            observation or to one before that of the edge before it, or an observation has no edge.
        """
        observations = _with_all_fields("observations", observations, OBSERVATION_FIELDS)
        edges = _with_all_fields("edges", edges, EDGE_FIELDS)
        _check_values(observations, edges)
        owners = edges["observation"]
        if len(owners) and not 0 <= owners.min() <= owners.max() < len(observations):
            raise ValueError(f"an edge belongs to none of the {len(observations)} observations")
        if (np.diff(owners) < 0).any():
            raise ValueError("the edges are not in the order of their observations")
        num_edges = np.bincount(owners, minlength=len(observations))
        check_each("observations", "an edge", num_edges > 0)
        table = cls()
        table._observations, table._num_observations = observations.copy(), len(observations)
        table._edges, table._num_edges = edges.copy(), len(edges)
        table._edge_ends = np.cumsum(num_edges)
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

    def edges_of(self, members: IntArray) -> tuple[np.ndarray[tuple[int], np.dtype[np.void]], IntArray]:
        """Return the edges of (M,) observations, ascending, and the place of each one's in ``members``.

        What it costs depends on these observations, not on how many there are.
        """
        ends = self._edge_ends[members]
        starts = np.where(members > 0, self._edge_ends[members - 1], 0)
        counts = ends - starts
        owner = np.repeat(np.arange(len(members)), counts)
        if len(members) and members[-1] - members[0] == len(members) - 1:
            return self.edges[starts[0] : ends[-1]], owner
        row = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts) + starts[owner]
        return self.edges[row], owner

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
        self._observations = with_room(self._observations, self._num_observations + 1)
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
            observation.overhang,
            observation.overhang_std,
            observation.view == "ascending",
        )
        count = len(ends)
        self._edges = with_room(self._edges, self._num_edges + count)
        rows = self._edges[self._num_edges : self._num_edges + count]
        rows["observation"] = self._num_observations
        rows["index"] = [edge.step_index for edge in observation.edges]
        rows["forward"], rows["up"] = middle @ observation.forward, middle @ observation.up
        rows["left"], rows["right"] = left, right
        rows["left_bounded"] = [edge.left_bounded for edge in observation.edges]
        rows["right_bounded"] = [edge.right_bounded for edge in observation.edges]
        stds = np.array([edge.std for edge in observation.edges])
        rows["forward_std"], rows["up_std"] = stds.T
        self._num_observations += 1
        self._num_edges += count
        self._edge_ends = with_room(self._edge_ends, self._num_observations)
        self._edge_ends[self._num_observations - 1] = self._num_edges


def _with_all_fields(
    name: str, records: np.ndarray[tuple[int], np.dtype[np.void]], fields: np.dtype[np.void]
) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """The records as this version has them; fields that came in later are unknown."""
    if records.ndim != 1 or not records.dtype.names:
        raise ValueError(f"the {name} are {records.dtype} of shape {records.shape}, expected records")
    if records.dtype == fields:
        return records
    full = np.zeros(len(records), dtype=fields)
    known = records.dtype.names or ()
    missing = [field for field in fields.names or () if field not in known]
    if not set(missing) <= set(_LATER_FIELDS) or set(known) - set(fields.names or ()):
        raise ValueError(f"the {name} have the fields {known}, expected {fields.names}")
    for field in known:
        if records.dtype[field] != fields[field]:
            raise ValueError(f"{name}: the field {field} is {records.dtype[field]}, expected {fields[field]}")
        full[field] = records[field]
    for field in missing:
        # Seen from above, a flight heads towards the camera that version had; a LiDAR looks all round.
        full[field] = records["forward"][:, 2] > 0 if field == "from_below" else np.nan
    return full


def _check_values(
    observations: np.ndarray[tuple[int], np.dtype[np.void]], edges: np.ndarray[tuple[int], np.dtype[np.void]]
) -> None:
    check_records("observations", observations, OBSERVATION_FIELDS, may_be_unknown=_LATER_FIELDS)
    check_records("edges", edges, EDGE_FIELDS, may_be_unknown=_LATER_FIELDS)
    for field in ("rise", "run", *(name for name in OBSERVATION_FIELDS.names or () if "variance" in name)):
        check_each("observations", f"a {field} above 0", observations[field] > 0)
    check_each("observations", "a left side left of the right", observations["left"] > observations["right"])
    check_each("edges", f"an index within {MAX_STEP_INDEX}", np.abs(edges["index"]) <= MAX_STEP_INDEX)


def with_room(records: Any, wanted: int) -> Any:
    """The rows, in an array twice as long where ``wanted`` do not fit."""
    if wanted <= len(records):
        return records
    larger = np.zeros((max(2 * len(records), wanted), *records.shape[1:]), dtype=records.dtype)
    larger[: len(records)] = records
    return larger


class PlacedObservations:
    """Observations where a trajectory puts them; map, m, rad. NaN, or anything, for one that has no pose.

    Attributes
    ----------
    origin
        (N, 3) lattice origins.
    heading
        (N,) directions of ascent.
    """

    def __init__(self, table: ObservationTable, poses: Float64Array | None = None) -> None:
        self._table = table
        self.origin: Float64Array = np.full((len(table), 3), np.nan)
        self.heading: Float64Array = np.full(len(table), np.nan)
        if poses is not None:
            self.place(np.arange(len(table)), poses)

    def __len__(self) -> int:
        return len(self._table)

    @property
    def records(self) -> np.ndarray[tuple[int], np.dtype[np.void]]:
        """(N,) records of ``OBSERVATION_FIELDS``, in the camera frame."""
        return self._table.observations

    def place(self, chosen: IntArray, poses: Float64Array) -> Mask:
        """Put (M,) observations where (M, 4, 4) poses say, new ones too; return which of them moved."""
        self.origin = with_room(self.origin, len(self._table))
        self.heading = with_room(self.heading, len(self._table))
        records = self.records[chosen]
        origin = rotated(poses, records["origin"]) + poses[:, :3, 3]
        forward = rotated(poses, records["forward"])
        heading = np.arctan2(forward[:, 1], forward[:, 0])
        moved = (self.origin[chosen] != origin).any(axis=1) | (self.heading[chosen] != heading)
        self.origin[chosen], self.heading[chosen] = origin, heading
        return np.asarray(moved)

    def in_axes(self, heading: float, chosen: IntArray | None = None) -> Float64Array:
        """Return (M, 3) origins along a heading, to its left and up, m."""
        origin = self.origin[: len(self)] if chosen is None else self.origin[chosen]
        cosine, sine = np.cos(heading), np.sin(heading)
        return np.stack(
            [
                origin[:, 0] * cosine + origin[:, 1] * sine,
                origin[:, 1] * cosine - origin[:, 0] * sine,
                origin[:, 2],
            ],
            axis=1,
        )


def rotated(poses: Float64Array, vectors: Float64Array) -> Float64Array:
    """Return (M, 3) vectors turned by (M, 4, 4) poses; each the same whatever the others are."""
    return np.asarray(
        poses[:, :3, 0] * vectors[:, :1]
        + poses[:, :3, 1] * vectors[:, 1:2]
        + poses[:, :3, 2] * vectors[:, 2:]
    )
