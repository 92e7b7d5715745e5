"""``history.jsonl``: the stairways as a run knew them while observations came in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from stairmap.errors import ResultsError
from stairmap.input_files import CheckedModel, Stamp, parse_json, read_lines, shown, validated
from stairmap.saved_stairway import MAX_STAIRWAYS, SavedStairway
from stairmap.stairway import Stairway

HISTORY_FILE = "history.jsonl"


@dataclass(frozen=True, slots=True, kw_only=True)
class StairwaysAtStamp:
    """The stairways as they were known after the frame with this stamp."""

    stamp_ns: int
    stairways: tuple[Stairway, ...]


class _HistoryLine(CheckedModel):
    """A line of ``history.jsonl``."""

    stamp_ns: Stamp
    stairways: Annotated[list[SavedStairway], Field(max_length=MAX_STAIRWAYS)]


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
    if not path.exists():
        return
    for number, (line, is_whole) in enumerate(read_lines(path, error_type=ResultsError), start=1):
        try:
            saved = validated(_HistoryLine, parse_json(line))
        except ValueError as error:  # noqa: PERF203
            if is_whole:
                raise ResultsError(f"{shown(path)}, line {number} cannot be read: {error}") from error
        else:
            yield StairwaysAtStamp(
                stamp_ns=saved.stamp_ns,
                stairways=tuple(Stairway.from_saved(stairway) for stairway in saved.stairways),
            )
