"""What a drop in a file may hold: the ranges of every number under ``drops`` of ``stairways.json``."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import AfterValidator, Field

from stairmap.input_files import CheckedModel, Place, Stamp
from stairmap.saved_stairway import Count

MAX_DROP_DEPTH = 1000.0
"""Deepest drop, m: a cliff beside a path."""

MAX_DROPS = 100_000
"""Most drops of a file."""

MAX_EDGE_LENGTH = 1000.0
"""Longest edge, m: a quay."""


def _level_edge(edge: list[Place]) -> list[Place]:
    (x0, y0, _), (x1, y1, _) = edge
    length = math.hypot(x1 - x0, y1 - y0)
    if not 0 < length <= MAX_EDGE_LENGTH:
        raise ValueError(
            f"should be more than 0 and at most {MAX_EDGE_LENGTH:g} m long in plan, is {length:g} m"
        )
    return edge


class SavedDrop(CheckedModel):
    """A drop."""

    id: Count
    edge: Annotated[list[Place], Field(min_length=2, max_length=2), AfterValidator(_level_edge)]
    depth: Annotated[float, Field(gt=0, le=MAX_DROP_DEPTH)] | None
    num_observations: Count
    first_seen_ns: Stamp
    last_seen_ns: Stamp
    stairway: Count | None = None
