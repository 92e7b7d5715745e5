"""What was seen in one input of a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stairmap.export.history import history_values
from stairmap.stairway import Stairway


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What was seen in one input.

    Attributes
    ----------
    num_frames, num_detections
        Frames looked at (windows of sweeps; 1 for a cloud), and those with stair edges.
    stairways
        JSON types as in ``history.jsonl``: without single steps.
    failure
        Why the recording broke off; empty if it did not.
    num_to_split
        Frames of a recording that is too long; it was not looked at then.
    """

    num_frames: int = 0
    num_detections: int = 0
    stairways: tuple[Mapping[str, Any], ...] = ()
    failure: str = ""
    num_to_split: int = 0


def without_steps(stairways: Sequence[Stairway]) -> tuple[Mapping[str, Any], ...]:
    """Return stairways as ``Look`` holds them."""
    return tuple(history_values(0, stairways)["stairways"])
