"""An edge where the ground a robot stands on ends and goes on lower, in the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from stairmap.arrays import Points, Vector, readonly
from stairmap.input_files import validated
from stairmap.saved_drop import SavedDrop
from stairmap.stairway import rounded


@dataclass(frozen=True, slots=True, kw_only=True)
class Drop:
    """A straight edge where the ground ends and goes on lower: the top of stairs, a loading dock, a well.

    Attributes
    ----------
    id
        Number of the drop, the same from one query to the next.
    edge
        (2, 3) segment on the upper ground, m, map; the left end first as seen from that ground.
    depth
        How far below the edge the nearest surface behind it lies, m: the drop is at least that deep. ``None``
        where nothing was ever measured behind it: a deep well, or a floor that gives no returns.
    num_observations
        Number of frames that showed it.
    first_seen_ns, last_seen_ns
        Stamps of the first and last of them, nanoseconds.
    stairway_id
        The stairway that begins at this edge; ``None`` where none is known.
    """

    id: int
    edge: Points
    depth: float | None
    num_observations: int
    first_seen_ns: int
    last_seen_ns: int
    stairway_id: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "edge", readonly(self.edge).reshape(2, 3))

    @property
    def length(self) -> float:
        """Length of the edge in plan, m."""
        return float(np.hypot(*(self.edge[1] - self.edge[0])[:2]))

    @property
    def center(self) -> Vector:
        """(3,) middle of the edge, m, map."""
        return np.asarray(self.edge.mean(axis=0))

    @property
    def outward(self) -> Vector:
        """(3,) level unit vector from the ground out over the edge, map."""
        along = self.edge[1] - self.edge[0]
        length = max(float(np.hypot(along[0], along[1])), 1e-9)
        return np.array([-along[1], along[0], 0.0]) / length

    def to_dict(self) -> dict[str, Any]:
        """Return the drop as it stands in ``stairways.json``."""
        return {
            "id": self.id,
            "edge": rounded(self.edge),
            "depth": None if self.depth is None else rounded(self.depth),
            "num_observations": self.num_observations,
            "first_seen_ns": self.first_seen_ns,
            "last_seen_ns": self.last_seen_ns,
            "stairway": self.stairway_id,
        }

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Drop:
        """Rebuild a drop from ``to_dict``.

        Raises
        ------
        ValueError
            If a key is missing or a value impossible; see ``stairmap.saved_drop``.
        """
        return cls.from_saved(validated(SavedDrop, data))

    @classmethod
    def from_saved(cls, saved: SavedDrop) -> Drop:
        """Rebuild a drop from what a file holds."""
        return cls(
            id=saved.id,
            edge=np.array(saved.edge),
            depth=saved.depth,
            num_observations=saved.num_observations,
            first_seen_ns=saved.first_seen_ns,
            last_seen_ns=saved.last_seen_ns,
            stairway_id=saved.stairway,
        )
