"""``history.jsonl``: the stairways as a run knew them while observations came in."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stairmap.export.loading import ResultsError, nan_for_null
from stairmap.stairway import Stairway

HISTORY_FILE = "history.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class StairwaysAtStamp:
    """The stairways as they were known after the frame with this stamp."""

    stamp_ns: int
    stairways: tuple[Stairway, ...]


def history_values(stamp_ns: int, stairways: Sequence[Stairway]) -> dict[str, Any]:
    """Return one line of ``history.jsonl`` as JSON types, without the flights' steps, to keep it short."""
    values = [stairway.to_dict() for stairway in stairways]
    for stairway in values:
        for flight in stairway["flights"]:
            flight["steps"] = []
    return {"stamp_ns": stamp_ns, "stairways": values}


def load_history(run: Path) -> Iterator[StairwaysAtStamp]:
    """Read ``history.jsonl`` of a run folder; nothing where there is none.

    A last line that a killed run left unfinished is passed over.

    Raises
    ------
    ResultsError
        If it cannot be read, or a line is not what stairmap writes.
    """
    path = run / HISTORY_FILE
    if not path.is_file():
        return
    try:
        *lines, unfinished = path.read_text(encoding="utf-8").split("\n")
    except OSError as error:
        raise ResultsError(f"cannot read {path}: {error.strerror}") from error
    for number, line in enumerate(lines, start=1):
        yield _stairways_at_stamp(line, f"{path}, line {number}")
    if unfinished:
        with contextlib.suppress(ResultsError):
            yield _stairways_at_stamp(unfinished, "the last line")


def _stairways_at_stamp(line: str, place: str) -> StairwaysAtStamp:
    try:
        values = json.loads(line)
        return StairwaysAtStamp(
            stamp_ns=int(values["stamp_ns"]),
            stairways=tuple(Stairway.from_dict(nan_for_null(data)) for data in values["stairways"]),
        )
    except KeyError as error:
        raise ResultsError(f"{place} lacks the key {error}") from error
    except (TypeError, ValueError) as error:
        raise ResultsError(f"{place} cannot be read: {error}") from error
