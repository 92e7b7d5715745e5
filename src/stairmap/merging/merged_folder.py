"""Read runs that are to be merged, and write the folder of the merged map."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from stairmap.errors import ResultsError
from stairmap.export.building import load_building
from stairmap.export.loading import load_stairways
from stairmap.export.results import RunFolder
from stairmap.export.summary import format_summary
from stairmap.input_files import CheckedModel, Stamp, parse_json, read_text, shown, validated
from stairmap.merging.alignment import SiteAlignment
from stairmap.merging.alignment_file import ALIGNMENT_FILE, alignment_text
from stairmap.merging.merged_map import MergedMap, MergeInput, Source
from stairmap.navigation.floors import FloorError
from stairmap.saved_stairway import MAX_STAIRWAYS, Count

MERGE_FILE = "merge.json"

SCHEMA = 1


class _SavedSource(CheckedModel):
    run: str
    stairway: Annotated[int, Field(ge=1)]
    num_observations: Count
    first_seen_ns: Stamp
    last_seen_ns: Stamp


class _SavedStairway(CheckedModel):
    id: Annotated[int, Field(ge=1)]
    observed_by: list[_SavedSource]


class _MergeFile(CheckedModel):
    """``merge.json``."""

    stairways: Annotated[list[_SavedStairway], Field(max_length=MAX_STAIRWAYS)]


def load_merge_input(run: Path) -> MergeInput:
    """Read a run, or a map that was merged before.

    Raises
    ------
    ResultsError
        If it is none.
    """
    results = load_stairways(run)
    folder = run if run.is_dir() else run.parent
    sources: dict[int, tuple[Source, ...]] = {
        stairway.id: (
            Source(
                run=str(folder.resolve()),
                stairway_id=stairway.id,
                num_observations=stairway.num_observations,
                first_seen_ns=stairway.first_seen_ns,
                last_seen_ns=stairway.last_seen_ns,
            ),
        )
        for stairway in results.stairways
    }
    if (folder / MERGE_FILE).exists():
        sources |= _load_sources(folder / MERGE_FILE)
    return MergeInput(
        name=folder.resolve().name,
        stairways=results.stairways,
        sources=sources,
        num_frames=results.num_frames,
        floors=_load_floors(run),
    )


def _load_floors(run: Path) -> tuple[float, ...]:
    """Heights of the floors that a run knows, m; of a floor that only open ends of stairs tell, none."""
    try:
        floors = load_building(run).floors
    except FloorError:
        return ()
    return tuple(floor.height for floor in floors.floors if not floor.is_open)


def _load_sources(path: Path) -> dict[int, tuple[Source, ...]]:
    text = read_text(path, error_type=ResultsError)
    try:
        saved = validated(_MergeFile, parse_json(text))
    except ValueError as error:
        raise ResultsError(f"{shown(path)} is not what stairmap writes: {error}") from error
    return {
        stairway.id: tuple(
            Source(
                run=source.run,
                stairway_id=source.stairway,
                num_observations=source.num_observations,
                first_seen_ns=source.first_seen_ns,
                last_seen_ns=source.last_seen_ns,
            )
            for source in stairway.observed_by
        )
        for stairway in saved.stairways
    }


def write_merged_map(
    folder: RunFolder, merged: MergedMap, inputs: Sequence[MergeInput], alignment: SiteAlignment
) -> None:
    """Write ``stairways.json``, ``merge.json``, ``alignment.yaml``, the mesh and the summary."""
    num_frames = sum(given.num_frames for given in inputs)
    names = [given.name for given in inputs]
    folder.write_stairways(merged.stairways, num_frames=num_frames)
    folder.write_text(MERGE_FILE, json.dumps(_merge_values(merged), indent=1) + "\n")
    folder.write_text(ALIGNMENT_FILE, alignment_text(alignment, names))
    folder.write_mesh(merged.stairways)
    lines = [f"merged from {', '.join(names)}"]
    folder.write_summary(
        format_summary(merged.stairways, num_frames=num_frames, num_detections=0, problems=lines)
    )


def _merge_values(merged: MergedMap) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "stairways": [
            {
                "id": stairway.id,
                "observed_by": [source.to_dict() for source in merged.sources[stairway.id]],
            }
            for stairway in merged.stairways
        ],
    }
