"""What a drop in a file may hold: the ranges of every number under ``drops`` of ``stairways.json``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from stairmap.input_files import CheckedModel, Place, Stamp
from stairmap.saved_stairway import Count

MAX_DROP_DEPTH = 1000.0
"""Deepest drop, m: a cliff beside a path."""

MAX_DROPS = 100_000
"""Most drops of a file."""


class SavedDrop(CheckedModel):
    """A drop."""

    id: Count
    edge: Annotated[list[Place], Field(min_length=2, max_length=2)]
    depth: Annotated[float, Field(gt=0, le=MAX_DROP_DEPTH)] | None
    num_observations: Count
    first_seen_ns: Stamp
    last_seen_ns: Stamp
    stairway: Count | None = None
